"""`arm.plan` of the Python package: the same values as the program, measures, cases, infeasible tasks, messages."""
import json
import math
import re

import numpy as np
import pytest

from program import SOURCE, refdyn
from python_package import package  # noqa: F401
from test_plan import FREE, PEAK, limit, plan, slide

pytestmark = pytest.mark.skipif("NLopt" not in refdyn("--version").stdout, reason="built without NLopt")

FAST = {"vary": {"T": (0.2, 5)}, "t_end": "T", "minimise": "T"}


@pytest.fixture(scope="module")
def arm(package, tmp_path_factory):
    path = tmp_path_factory.mktemp("slide") / "slide.lua"
    path.write_text(slide())
    return package.Model(path)


def test_result_is_that_of_the_program(arm, tmp_path):
    told, _ = plan(tmp_path, slide(), FREE)
    found = arm.plan(**FAST)
    assert found.values == found.parameters == told["parameters"] and found.objective == told["objective"] == found.t_end == told["t_end"]
    assert found.feasible and found.violation == {} and found.evaluations == told["evaluations"] and found.attrs == told
    assert found.starts.tolist() == told["starts"]
    for name in found.limits["limit"].values.tolist():
        for key in ("smallest", "largest", "from", "to", "t", "multiplier", "active"):
            assert found.limits[key].sel(limit=name).item() == limit(told, name)[key]
    run = arm.simulate(found.t_end, parameters=found.parameters, tol=1e-9)
    assert abs(float(run.cart_x[-1]) - 1) < 1e-9 and float(run.force_cart_x.max()) < 20 + 1e-6
    assert repr(found) == f"<refdyn plan: {found.objective:.6g}>\n  T            {found.objective:.6g}\n  active       force_cart_x"


def test_the_program_of_the_page(package):
    """docs/python.md; the wheel, in which test_python.py runs the others, has no NLopt."""
    program = next(text for text in re.findall(r"^```python\n(.*?)^```", (SOURCE / "docs" / "python.md").read_text(), re.M | re.S) if ".plan(" in text)
    exec(program, {"refdyn": package})


def test_measures_cases_and_options(package, arm):
    found = arm.plan(vary={"T": (0.8, 1), "m": (2, 3, 2.5)}, t_end="T", minimise=package.largest("force_cart_x"), starts=20, seed=3)
    assert found.objective == pytest.approx(2 * PEAK[5], rel=1e-6)
    found = arm.plan(vary={"T": (0.8, 1)}, t_end="T", minimise=package.integral("energy"), parameters={"m": 3}, within=[])
    assert found.objective == pytest.approx(15 / 7, rel=1e-6) and found.limits.sizes == {"limit": 0}
    found = arm.plan(vary={"d": (0.1, 2)}, t_end=1, minimise=package.at_end("cart_x"), within=package.at_end("cart_x", from_=0.3, to=0.5), tol=1e-8, tol_rates=1e-8)
    assert found.objective == pytest.approx(0.3, abs=1e-7) and found.limits["limit"].values.tolist() == ["cart_x at end"]
    worst = arm.plan(**FAST, for_all={"m": np.array([1.8, 2.2]), "d": [0.9, 1.1]}, within="force_cart_x")
    assert arm.plan(**FAST, search="cobyla").attrs["search"] == "cobyla"
    assert worst.worst_case == {"d": 1.1, "m": 2.2} and worst.objective == pytest.approx(math.sqrt(2.2 * 1.1 * PEAK[5] / 20), rel=1e-7)


def test_contradicting_limits(package, arm):
    with pytest.warns(package.ModelWarning, match="force_cart_x: must give way by"):
        found = arm.plan(vary={"T": (0.2, 0.7)}, t_end="T", minimise="T")
    amount = 2 * PEAK[5] / 0.49 - 20
    assert not found.feasible and found.violation["force_cart_x"] == pytest.approx(amount, abs=1e-5) and np.isnan(found.starts).all()
    assert f"  force_cart_x must give way by {amount:.4g}" in repr(found) and "beyond limits" in repr(found)


@pytest.mark.parametrize("change, kind, text", [
    ({"vary": {"T": 2}}, ValueError, "vary: T: 2; must be (from, to) or (from, to, start)"),
    ({"vary": "T"}, TypeError, "vary: str; must be a dictionary such as {'T': (0.5, 2)}"),
    ({"vary": {"T": (2, 1)}}, ValueError, "vary.T: rd.within: from 2 to 1; the range must ascend"),
    ({"vary": {"Tx": (1, 2)}}, ValueError, "vary.Tx: unknown name; did you mean 'T'?"),
    ({"minimise": 3}, TypeError, "minimise: int; must be a name, or made by refdyn.at_end, refdyn.integral or refdyn.largest"),
    ({"for_all": {"m": 3}}, ValueError, "for_all: m: 3; must be a list of numbers"),
    ({"vary": {"T": (1, math.inf)}}, ValueError, "vary.T: rd.within: a number is not finite; numbers must be finite"),
    ({"for_all": {"m": [1, math.nan]}}, ValueError, "for_all.m[2]: value nan; must be finite"),
    ({"search": "mma"}, ValueError, 'search: a text; must be "slsqp" or "cobyla"'),
    ({"within": ["force"]}, ValueError, "within: force is no limit of the model; use one of cart_x_d, force_cart_x"),
    ({"step_maxx": 1}, TypeError, "plan() got an unexpected keyword argument 'step_maxx'; did you mean 'step_max'?"),
])
def test_wrong_calls(change, kind, text, arm):
    with pytest.raises(kind) as error:
        arm.plan(**{**FAST, **change})
    assert text in str(error.value), str(error.value)
