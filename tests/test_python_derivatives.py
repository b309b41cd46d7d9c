"""Derivatives of motions in Python: numbers of the program, datasets, messages, fits (docs/gradients.md)."""
import importlib.util
import re
import sys
import time
import types

import numpy
import pytest

from program import MODELS, REFERENCE, SOURCE
from python_package import package  # noqa: F401


def test_numbers_are_those_of_the_program(package, tmp_path):
    arm = package.Model(REFERENCE, n_rfe=2)
    names = ["E", "m_E", "arm_psi", "arm_psi_d"]
    options = {"t_end": 0.3, "every": 0.1, "parameters": {"eta": 1e-3}, "method": "radau9"}
    own = arm.simulate(derivatives=names, **options)
    assert own["d_E_x"].dims == ("t", "parameter") and list(own["parameter"].values) == names
    plain = arm.simulate(**options)
    assert all(numpy.array_equal(plain[name], own[name]) for name in plain)
    change = 1e-4
    a, b = (arm.simulate(**{**options, "parameters": {"eta": 1e-3, "m_E": 2 + side}, "tol": 1e-12}) for side in (change, -change))
    difference = (a["column_psi"] - b["column_psi"]).values / (2 * change)
    assert numpy.allclose(own["d_column_psi"].sel(parameter="m_E"), difference, rtol=0, atol=1e-4 * abs(difference).max())


@pytest.mark.parametrize("how", [{}, {"from_": "statics"}], ids=["in the process", "by the program"])
def test_units(package, how):
    """The unit of the column divided by the unit of the value: one for each value, or one for all if they are alike."""
    arm = package.Model(REFERENCE, n_rfe=2)
    names = ["E", "eta", "nu", "m_E", "s_sup", "arm_psi", "arm_psi_d"]
    run = arm.simulate(0.02, every=0.01, derivatives=names, **how)
    assert run["d_arm_psi"].attrs["units"] == "rad/Pa, rad/s, rad, rad/kg, rad/(N/m), 1, rad/(rad/s)"
    assert run["d_E_xd"].attrs["units"] == "m/s/Pa, m/s/s, m/s, m/s/kg, m/s/(N/m), m/s/rad, m/s/(rad/s)"
    assert run["d_arm_psi_d"].attrs["units"].endswith("rad/s/rad, 1")
    assert run["d_energy"].attrs["units"].startswith("J/Pa, ") and "units" not in run["d_phi_1"].attrs
    plain = arm.simulate(0.02, every=0.01, **how)
    assert {name for name in plain if "units" in plain[name].attrs} == {name[2:] for name in run if name.startswith("d_") and "units" in run[name].attrs}
    assert all(run[name].attrs == plain[name].attrs for name in plain)
    one = arm.simulate(0.02, every=0.01, derivatives=["m_E"], dataset=False, **how)
    assert one.units["d_force_effector_z"] == "N/kg" and one.units["effector_z"] == "m"


def test_columns_without_a_dataset(package):
    bar = package.Model(MODELS / "fourbar.lua")
    run = bar.simulate(0.2, derivatives="torque", dataset=False)
    assert run["d_crank_psi"].shape == (len(run["t"]), 1) and run.variables == ("torque",)


def test_wrong_names(package):
    bar = package.Model(MODELS / "fourbar.lua")
    for names, message in ((["torq"], "derivatives: 'torq' is unknown; did you mean 'torque'"), (["a", "a"], "twice")):
        with pytest.raises(ValueError, match=message):
            bar.simulate(0.2, derivatives=names)


def test_warns_where_there_are_none(package, tmp_path):
    path = tmp_path / "jump.lua"
    path.write_text("""local rd = require "refdyn"
local p = rd.parameters { { "T0", 0, "s" } }
return rd.model { name = "jump", gravity = { 0, 0, 0 }, links = { { "a", joint = "x", mass = 1 } },
  forces = function(s) return { a_x = rd.where(rd.less(s.t, p.T0), 3, 1) } end }""")
    with pytest.warns(UserWarning, match="derivatives T0: nan from t = 0 s on"):
        run = package.Model(path).simulate(1.0, derivatives=["T0"])
    assert numpy.isnan(run["d_a_x"]).all()


def test_fit_of_two_parameters(package):
    """E and eta from 125 samples of the tip."""
    from scipy.optimize import least_squares
    arm = package.Model(REFERENCE, n_rfe=4)
    truth = {"E": 2.0e11, "eta": 1.1e-3}
    # a start with the arm bent, so that it vibrates: heavy for the first run only
    options = {"t_end": 0.5, "every": 0.004, "tol": 1e-6, "method": "radau9", "dataset": False}
    measured = arm.simulate(parameters=truth, **options)["E_z"][1:] + 0
    noise = 1e-7 * numpy.random.default_rng(1).standard_normal(len(measured))
    names = list(truth)
    scale = numpy.array([1e11, 1e-3])
    runs = {}

    def run(x):
        if tuple(x) not in runs:
            runs[tuple(x)] = arm.simulate(parameters=dict(zip(names, x * scale)), derivatives=names, **options)
        return runs[tuple(x)]
    assert len(measured) == 125
    column = "arm_phi_1" if "arm_phi_1" in run(numpy.array([2.1, 1.0])) else "E_z"
    measured = arm.simulate(parameters=truth, **options)[column][1:]
    size = numpy.max(numpy.abs(measured))
    began = time.perf_counter()
    runs.clear()
    found = least_squares(lambda x: (run(x)[column][1:] - measured) / size + noise, [2.1, 1.0], jac=lambda x: run(x)["d_" + column][1:] * scale / size)
    took = time.perf_counter() - began
    assert numpy.allclose(found.x * scale, list(truth.values()), rtol=1e-3), found
    assert took < 5, took  # 1 s asked for without load; docs/gradients.md states the time


class Array(numpy.ndarray):
    """A tensor of the stub below."""

    def __new__(cls, values):
        return numpy.asarray(values, float).view(cls)


def stub():
    """What the page uses of PyTorch, where it is not installed: as_tensor, and a Function with forward and backward."""
    torch = types.ModuleType("torch")
    torch.as_tensor = Array
    torch.autograd = types.SimpleNamespace(Function=object)
    return torch


def test_programs_of_the_page(package, monkeypatch):
    """The blocks of Python in docs/gradients.md, in order; PyTorch is replaced by a stub where it is missing."""
    page = (SOURCE / "docs" / "gradients.md").read_text()
    if importlib.util.find_spec("torch") is None:
        monkeypatch.setitem(sys.modules, "torch", stub())
    monkeypatch.chdir(SOURCE)
    names = {}
    for block in re.findall(r"^```python\n(.*?)^```", page, re.M | re.S):
        exec(block, names)
    assert numpy.allclose(names["fit"].x, [2.0, 1.1], rtol=1e-4)
    assert abs(names["run"]["crank_psi"][-1] - 4) < 1e-6
    context, Motion, torch = types.SimpleNamespace(), names["Motion"], names["torch"]
    value = Motion.forward(context, torch.as_tensor([2.1e11, 1e-3]))
    gradient = Motion.backward(context, torch.as_tensor(numpy.ones(len(value))))
    change = 1e-7
    other = Motion.forward(types.SimpleNamespace(), torch.as_tensor([2.1e11, 1e-3 + change]))
    assert abs(float(gradient[1]) - float((other - value).sum()) / change) < 1e-2 * abs(float(gradient[1]))
