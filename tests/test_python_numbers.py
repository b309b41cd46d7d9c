"""Extreme numbers in every numeric argument of the Python package: an answer within 10 s of CPU time and 1 GB, and never a wrong result without a word."""
import math
import os
import random
import re
import resource
import signal
import traceback
import warnings

import numpy as np
import pytest

from extreme import CART, DRIVEN, MEGABYTES, SECONDS
from program import LONG
from python_package import package  # noqa: F401 (a fixture)

EXTREME = [0, 0.0, -0.0, -1, -1.0, 5e-324, 1e-310, 1e-300, 1e-12, 1e9, 10**10, 1e300, 1.7e308, 10**400, math.inf, -math.inf, math.nan]

TIMES = np.arange(0, 2.01, 0.05)
PLACES = 0.02 * (1 - np.cos(5 * TIMES) * np.exp(-0.75 * TIMES))


class Models:
    """The models, and a motion of each."""

    def __init__(self, refdyn):
        self.refdyn = refdyn
        self.cart, self.driven = refdyn.Model.from_text(CART), refdyn.Model.from_text(DRIVEN)
        self.run = self.cart.simulate(1, every=0.1)


def advanced(motion, t=0.1):
    motion.advance(t)
    return motion.q, motion.qd, motion.t


def moved(m, **options):
    return advanced(m.cart.motion(**options))


def changed(m, **values):
    motion = m.cart.motion()
    motion.advance(0.05)
    motion.set(**values)
    return advanced(motion)


def advanced_to(m, x):
    motion = m.cart.motion()
    motion.advance(x)
    assert motion.t == x, motion.t
    return motion.q


def simulated(m, t_end=0.5, **options):
    run = m.cart.simulate(t_end, dataset=False, **options)
    assert options.get("stop") or run["t"][-1] == t_end, run["t"][-1]
    return list(run.values())


def realised(m, **options):
    return dict(m.driven.simulate(1, realise=True, **options))


def planned(m, vary=(0.5, 3), from_=0.9, to=1.1, t_end="T", **options):
    return m.driven.plan(vary={"T": vary}, t_end=t_end, minimise="T", within=[m.refdyn.at_end("a_x", from_=from_, to=to)],
                         **{"starts": 2, **options}).values


def fitted(m, vary=("m", "c"), noise=0.01, t=None, x=None, **options):
    times, places = TIMES.copy(), PLACES.copy()
    if t is not None:
        times[20] = t
    if x is not None:
        places[20] = x
    return m.cart.fit({"t": times, "a_x": places, "push": np.ones(len(times))}, vary=vary, noise={"a_x": noise}, **options).values


def batch(m, cases=None, t_end=0.5, **options):
    runs = m.cart.batch({"m": [1, 2, 3]} if cases is None else cases, t_end, **options)
    assert runs.status.dtype.kind in "iu"
    return runs.where(runs.status == 0, 0) if (runs.status != 0).any() else runs


def each(call, *names):
    """The call with each of the options."""
    return {name: (lambda m, x, name=name: call(m, **{name: x})) for name in names}


SIZES = ("tol", "tol_rates", "step", "step_max")
CALLS = {
    **{f"motion {name}": call for name, call in each(moved, "q", "qd", "t", *SIZES, "step_limit").items()},
    "motion q list": lambda m, x: moved(m, q=[x]), "motion qd list": lambda m, x: moved(m, qd=[x]),
    "motion input": lambda m, x: moved(m, inputs={"push": x}), "motion parameter": lambda m, x: moved(m, parameters={"m": x}), "motion parameter c": lambda m, x: moved(m, parameters={"c": x}),
    "motion inputs": lambda m, x: moved(m, inputs=[x]), "advance": advanced_to,
    "set q": lambda m, x: changed(m, q=[x]), "set qd": lambda m, x: changed(m, qd=[x]), "set input": lambda m, x: changed(m, inputs={"push": x}), "set inputs": lambda m, x: changed(m, inputs=[x]),
    "set parameter": lambda m, x: changed(m, parameters={"m": x}), "set parameters": lambda m, x: changed(m, parameters=[2, x, 3, 1]),
    **{f"simulate {name}": call for name, call in each(simulated, "t_end", *SIZES, "every", "accuracy", "t", "step_limit").items()},
    "simulate verify": lambda m, x: simulated(m, every=x, verify=True), "simulate q": lambda m, x: simulated(m, q=[x]), "simulate qd": lambda m, x: simulated(m, qd={"a_x": x}),
    "simulate input": lambda m, x: simulated(m, inputs={"push": x}), "simulate sample": lambda m, x: simulated(m, inputs={"t": [0, 0.2, 0.4], "push": [0, x, 1]}),
    "simulate sample time": lambda m, x: simulated(m, inputs={"t": [0, x, 0.4], "push": [0, 2, 1]}), "simulate parameter": lambda m, x: simulated(m, parameters={"m": x}),
    "simulate derivatives": lambda m, x: simulated(m, derivatives=["m", "push"], parameters={"c": x}), "simulate stop": lambda m, x: simulated(m, stop=f"a_x>{x}"),
    **{f"realise {name}": call for name, call in each(realised, "before", "after", "mesh", "tol", "every").items()},
    "step q": lambda m, x: m.cart.step([x], [0], 0, 0.01), "step qd": lambda m, x: m.cart.step([0], [x], 0, 0.01), "step t": lambda m, x: m.cart.step([0], [0], x, 0.01),
    "step h": lambda m, x: m.cart.step([0], [0], 0, x), "step h implicit": lambda m, x: m.cart.step([0], [0], 0, x, method="radau"), "step steps": lambda m, x: m.cart.step([0], [0], 0, 0.01, steps=x),
    "step input": lambda m, x: m.cart.step([0], [0], 0, 0.01, inputs={"push": x}), "step parameter": lambda m, x: m.cart.step([0], [0], 0, 0.01, parameters={"m": x}),
    "step batch": lambda m, x: m.cart.step([[0], [x]], [[0], [0]], 0, 0.01), "step batch times": lambda m, x: m.cart.step([[0], [1]], [[0], [0]], [0, x], 0.01),
    "qdd q": lambda m, x: m.cart.qdd([x], [0]), "qdd t": lambda m, x: m.cart.qdd([0], [0], x), "qdd input": lambda m, x: m.cart.qdd([0], [0], inputs={"push": x}),
    "qdd parameter": lambda m, x: m.cart.qdd([0], [0], parameters={"m": x}), "qdd batch": lambda m, x: m.cart.qdd([[0], [x]], [[0], [0]]),
    "inverse_dynamics": lambda m, x: m.cart.inverse_dynamics([0], [0], [x]),
    **{f"batch {name}": call for name, call in each(batch, "t_end", *SIZES, "every", "threads", "lanes").items()},
    "batch case": lambda m, x: batch(m, {"m": [1, x, 3]}), "batch start": lambda m, x: batch(m, {"a_x": [1, x, 3]}), "batch number": lambda m, x: batch(m, {"m": [1, 2], "c": x}),
    "batch keep": lambda m, x: batch(m, keep={"at": [0.1, x]}), "batch history": lambda m, x: batch(m, keep={"history": ["a_x"]}, every=x),
    **{f"batch realise {name}": lambda m, x, name=name: m.driven.batch({"m": [1, 2]}, 1, realise=True, **{name: x}) for name in ("before", "after", "mesh")},
    **{f"plan {name}": call for name, call in each(planned, "from_", "to", *SIZES, "starts", "seed", "t_end", "lanes").items()},
    "plan vary": lambda m, x: planned(m, (x, 3)), "plan vary to": lambda m, x: planned(m, (0.5, x)), "plan vary start": lambda m, x: planned(m, (0.5, 3, x)),
    "plan for_all": lambda m, x: planned(m, for_all={"m": [2, x]}), "plan parameter": lambda m, x: planned(m, parameters={"m": x}),
    **{f"fit {name}": call for name, call in each(fitted, "noise", "t", "x", *SIZES, "lanes").items()},
    "fit vary": lambda m, x: fitted(m, {"m": (x, 3)}), "fit vary to": lambda m, x: fitted(m, {"m": (1, x)}), "fit vary start": lambda m, x: fitted(m, {"m": (1, 3, x)}),
    "fit delay": lambda m, x: fitted(m, sensors={"a_x": {"delay": x}}), "fit gain": lambda m, x: fitted(m, sensors={"a_x": {"gain": x}}), "fit offset": lambda m, x: fitted(m, sensors={"a_x": {"offset": x}}),
    "fit until": lambda m, x: m.cart.fit(check=True, until=x, vary=["m"], noise={"a_x": 0.01}).values, "fit every": lambda m, x: m.cart.fit(check=True, until=1, every=x, vary=["m"], noise={"a_x": 0.01}).values,
    "fit parameter": lambda m, x: fitted(m, ["m"], parameters={"c": x}),
    "states": lambda m, x: m.cart.states({"a_x": [0, x], "a_x_d": [0, 0]}),
    "statics q": lambda m, x: m.cart.statics([x]), "statics t": lambda m, x: m.cart.statics(t=x), "statics input": lambda m, x: m.cart.statics(inputs={"push": x}),
    "statics parameter": lambda m, x: m.cart.statics(parameters={"c": x}),
    "modes q": lambda m, x: m.cart.modes(q=[x]), "modes t": lambda m, x: m.cart.modes(at="initial", t=x), "modes modes": lambda m, x: m.cart.modes(modes=x), "modes parameter": lambda m, x: m.cart.modes(parameters={"c": x}),
    "modes mass": lambda m, x: m.cart.modes(parameters={"m": x}),
    "linearise q": lambda m, x: m.cart.linearise(q=[x]), "linearise qd": lambda m, x: m.cart.linearise(qd=[x]), "linearise t": lambda m, x: m.cart.linearise(at="initial", t=x),
    "linearise parameter": lambda m, x: m.cart.linearise(parameters={"d": x}),
    "view height": lambda m, x: m.cart.view(m.run, height=x) and None, "live height": lambda m, x: m.cart.live(height=x) and None,
    "live range": lambda m, x: m.cart.live(m=(1, x)) and None, "live value": lambda m, x: m.cart.live(m=x) and None,
    **{f"live {name}": lambda m, x, name=name: m.cart.live(**{name: x}) and None for name in ("t_end", "step", "tol", "tol_rates")},
    "sample count": lambda m, x: m.refdyn.sample(x, m=m.refdyn.normal(2, 0.1)), "sample halton": lambda m, x: m.refdyn.sample(x, m=m.refdyn.normal(2, 0.1), sequence="halton"),
    "sample sobol": lambda m, x: m.refdyn.sample(x, m=m.refdyn.normal(2, 0.1), sequence="sobol"), "sample seed": lambda m, x: m.refdyn.sample(3, m=m.refdyn.normal(2, 0.1), seed=x),
    "normal": lambda m, x: m.refdyn.sample(5, m=m.refdyn.normal(x, 1)), "normal deviation": lambda m, x: m.refdyn.sample(5, m=m.refdyn.normal(1, x)),
    "uniform": lambda m, x: m.refdyn.sample(5, m=m.refdyn.uniform(-2, x)), "uniform from": lambda m, x: m.refdyn.sample(5, m=m.refdyn.uniform(x, 5)),
    "log_uniform": lambda m, x: m.refdyn.sample(5, m=m.refdyn.log_uniform(x, 5)), "log_uniform to": lambda m, x: m.refdyn.sample(5, m=m.refdyn.log_uniform(1e-3, x)),
    "grid of": lambda m, x: batch(m, m.refdyn.grid(m=[1, x], c=[40, 50])),
    "model parameter": lambda m, x: m.refdyn.Model.from_text(CART, m=x).parameters,
    "model quantity": lambda m, x: m.refdyn.Model.from_text(CART, m=x).qdd([0.1]),
}


# Values of quantities, which have NaN where they are undefined, and data that nothing computes with.
MAY_BE_NAN = re.compile("qdd|inverse_dynamics|model quantity|states")


def numbers_of(found):
    """All numbers of a result, as one array."""
    if found is None:
        return np.zeros(0)
    if hasattr(found, "data_vars"):
        return np.concatenate([np.zeros(0), *(np.abs(v.values).ravel() for v in found.data_vars.values() if v.dtype.kind in "fcui")])
    if isinstance(found, (list, tuple)):
        return np.concatenate([np.zeros(0), *(numbers_of(x) for x in found)])
    if hasattr(found, "items") and not isinstance(found, np.ndarray):
        return np.concatenate([np.zeros(0), *(numbers_of(x) for _, x in found.items())])
    found = np.asarray(found)
    return np.abs(found).astype(float).ravel() if found.dtype.kind in "fcui" else np.zeros(0)


def answer(m, name, x):
    """What is wrong with the answer; '' if nothing is."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            found = numbers_of(CALLS[name](m, x))
        except (ValueError, TypeError, ArithmeticError, m.refdyn.ModelError, m.refdyn.NumericalError) as error:
            own = type(error).__module__.startswith("refdyn") or type(error) in (ValueError, TypeError)
            return "" if own and len(str(error)) > 10 else f"{type(error).__name__}: {error}"
        except BaseException:
            return traceback.format_exc()[-700:]
    strange = [str(warning.message) for warning in told if not issubclass(warning.category, m.refdyn.ModelWarning)]
    if strange:
        return f"warns: {strange[0]}"
    if not np.isfinite(found).all() and not told and not MAY_BE_NAN.match(name):
        return "returns numbers that are not finite, without a word"
    return ""


def fault(m, name, x, folder):
    """The call in a child of this process."""
    said = folder / "said"
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (2 * SECONDS, 2 * SECONDS + 5))
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        os.chdir(folder)
        wrong = "no answer"
        try:
            wrong = answer(m, name, x)
        finally:
            said.write_text(wrong)
            os._exit(0)
    _, ended, usage = os.wait4(child, 0)
    status = os.waitstatus_to_exitcode(ended)
    if usage.ru_utime + usage.ru_stime > SECONDS or status == -signal.SIGXCPU:
        return f"took {usage.ru_utime + usage.ru_stime:.1f} s"
    if usage.ru_maxrss / 1024 > MEGABYTES:
        return f"took {usage.ru_maxrss / 1024:.0f} MB"
    return f"exit status {status}" if status else said.read_text()


@pytest.fixture(scope="module")
def models(package):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", package.ModelWarning)
        return Models(package)


def test_ordinary_numbers(models):
    """Calls succeed before their numbers are changed."""
    for name in ("motion tol", "set q", "simulate t_end", "step h", "batch t_end", "fit noise", "statics q", "modes parameter", "sample count"):
        x = 3 if name == "sample count" else 0.5
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", models.refdyn.ModelWarning)
            found = numbers_of(CALLS[name](models, x))
        assert found.size and np.isfinite(found).all(), name


def test_extreme_numbers(models, tmp_path):
    """Every number in turn; in tests/run, a sample of the calls that need no compiler for WebAssembly."""
    every = [(name, x) for name in CALLS for x in EXTREME]
    assert len(every) > 2000
    chosen = every if LONG else random.Random(2).sample([case for case in every if not case[0].startswith("live")], 120)
    faults = [f"{name} = {x!r:.20}: {found}" for name, x in chosen if (found := fault(models, name, x, tmp_path))]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("options", [{"step": 1e-12}, {"step_max": 1e-12}], ids=str)
def test_too_many_steps_of_a_motion(models, options):
    """The message has their number, and the motion stays where it is; a copy has the same bound."""
    motion = models.cart.motion(**options)
    for each_motion in (motion, motion.copy()):
        with pytest.raises(ValueError, match=r"t: 0\.1 needs 1e\+11 steps of 1e-12 s; must be at most 1e\+09"):
            each_motion.advance(0.1)
        assert each_motion.t == 0 and each_motion.advance(1e-11)


@pytest.mark.parametrize("sequence", ["random", "halton", "sobol"])
def test_too_many_random_cases(package, sequence):
    with pytest.raises(ValueError, match="count: value 100000000; must be at most 10000000"):
        package.sample(10**8, m=package.normal(2, 0.1), sequence=sequence)
