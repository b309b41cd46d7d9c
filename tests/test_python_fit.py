"""`arm.fit` of the Python package: the same values as the program, kinds of data, sensors and starts, --check, messages."""
import json
import math
import random

import numpy as np
import pytest
import xarray

from program import refdyn
from python_package import package  # noqa: F401
from test_fit import SLIDE, sensor_data, slide_at

NOISE = {"a_x": 1e-5}


@pytest.fixture(scope="module")
def slide(package, tmp_path_factory):
    path = tmp_path_factory.mktemp("slide") / "slide.lua"
    path.write_text(SLIDE)
    with pytest.warns(package.ModelWarning):
        return package.Model(path, push=1.0)


@pytest.fixture
def columns():
    noise, t = random.Random(1), 0.01 * np.arange(400)
    return {"t": t, "a_x": np.array([slide_at(time) + noise.gauss(0, 1e-5) for time in t])}


def same(a, b):
    return a.values.dims == b.values.dims and np.array_equal(a.values, b.values) and np.array_equal(a.covariance, b.covariance)


def test_result_is_that_of_the_program(slide, columns, tmp_path):
    data = tmp_path / "d.csv"
    data.write_text("t,a_x\n" + "\n".join(f"{t!r},{x!r}" for t, x in zip(columns["t"].tolist(), columns["a_x"].tolist())) + "\n")
    (tmp_path / "slide.lua").write_text(SLIDE)
    refdyn("fit", tmp_path / "slide.lua", data, "--vary", "c,m=1:9,d", "--noise", "a_x=1e-5", "--set", "push=1", "--set", "c=48", "-o", tmp_path / "fit.json")
    told = json.loads((tmp_path / "fit.json").read_text())
    found = slide.fit(data, vary={"c": None, "m": (1, 9), "d": None}, noise=NOISE, parameters={"c": 48})
    for name, value in told["values"].items():
        assert float(found.values.sel(value=name)) == pytest.approx(value, rel=1e-9)
        assert float(found.standard_errors.sel(value=name)) == pytest.approx(told["standard_errors"][name], rel=1e-6)
        assert float(found.covariance.sel(value=name, other=name)) == pytest.approx(told["standard_errors"][name] ** 2, rel=1e-6)
        assert float(found.correlations.sel(value=name, other=name)) == 1
    assert found.chi2_dof == pytest.approx(told["chi2_dof"]) and found.degrees_of_freedom == 397 and found.not_identifiable == ()
    assert float(found.residuals.rms.sel(column="a_x")) == pytest.approx(told["residuals"]["a_x"]["rms"])
    assert found.parameters == {name: float(found.values.sel(value=name)) for name in ("c", "d", "m")} and found.validation is None
    run = slide.simulate(1, parameters=found.parameters)
    assert abs(float(run.a_x[-1]) - slide_at(1)) < 1e-5
    assert repr(found).startswith("<refdyn fit of 3 values>\n  c            ") and f"chi2_dof     {found.chi2_dof:.4g}" in repr(found)


def test_kinds_of_data(slide, columns, tmp_path):
    """Columns, a data frame, a dataset and a file are the same data; NaN is a gap."""
    pandas = pytest.importorskip("pandas")
    columns["a_x"][7] = np.nan
    first = slide.fit(columns, vary="c,d", noise=NOISE)
    assert first.degrees_of_freedom == 397
    for data in (pandas.DataFrame(columns), xarray.Dataset({"a_x": ("t", columns["a_x"])}, {"t": columns["t"]}), [columns]):
        assert same(slide.fit(data, vary=["c", "d"], noise=NOISE), first)
    held = slide.fit([columns, columns], vary="c,d", noise=NOISE, held_out=columns)
    assert held.degrees_of_freedom == 796 and 0.5 < held.validation["chi2_dof"] < 1.5 and held.validation["residuals"].sizes == {"column": 1}


def test_sensors_and_starts(slide, tmp_path):
    """Unknown properties of a sensor, and starts named after their data."""
    path = sensor_data(tmp_path / "d.csv", seed=2, gain=1.1, offset=0.02)
    found = slide.fit(path, vary="c", noise=NOISE, sensors={"a_x": {"offset": None, "gain": (0.5, 2, 1.2), "delay": 0}})
    assert found.values.value.values.tolist() == ["c", "a_x_offset", "a_x_gain"] and abs(float(found.values.sel(value="a_x_gain")) - 1.1) < 1e-3
    t = 0.01 * np.arange(400)
    data = {"t": t, "a_x": np.array([slide_at(time, x=0.03) for time in t])}
    found = slide.fit([path, data], vary="c", noise=NOISE, starts=["a_x"], sensors={"a_x": {"offset": 0.0}}, held_out=data)
    assert found.standard_errors.value.values.tolist() == ["c", f"a_x@{path}", "a_x@1"]
    assert found.values.value.values.tolist() == ["c", f"a_x@{path}", "a_x@1", "a_x@held_out[0]"] and list(found.parameters) == ["c"]
    found = slide.fit(data, vary="c", noise=NOISE, starts={"a_x": (0.0, 0.02), "a_x_d": None})
    assert float(found.values.sel(value="a_x@0")) == pytest.approx(0.02) and "a_x_d@0" in found.values.value


def test_check(slide, columns):
    """Before data exist: errors as after them, and what would not be determined."""
    after = slide.fit(columns, vary="c,d", noise=NOISE)
    before = slide.fit(vary="c,d", noise=NOISE, check=True, until=3.99, every=0.01)
    assert np.allclose(before.standard_errors, after.standard_errors, rtol=0.05) and before.values is None and math.isnan(before.chi2_dof)
    with pytest.warns(UserWarning, match="these columns do not determine d and d2"):
        assert slide.fit(vary="c,d,d2", noise=NOISE, check=True, until=3).not_identifiable == (("d", "d2"),)
    assert repr(before).startswith("<refdyn fit of 2 values>\n  c            +- ")


WRONG = {
    "no data": (lambda arm, data: arm.fit(vary="c", noise=NOISE), TypeError, "fit: data is missing; add measurements, or check=True before data exist"),
    "check": (lambda arm, data: arm.fit(data, vary="c", noise=NOISE, check=True), TypeError, "fit: check=True needs no data; remove them"),
    "until": (lambda arm, data: arm.fit(data, vary="c", noise=NOISE, until=1), TypeError, "until: belongs to check=True; the data have their own times"),
    "unknown": (lambda arm, data: arm.fit(data, vary="cc", noise=NOISE), ValueError, "vary: 'cc' is unknown; did you mean 'c'?"),
    "column": (lambda arm, data: arm.fit(data, vary="c", noise={"a_y": 1}), ValueError, "noise: a_y is no column of the motion; did you mean 'a_x'?"),
    "noise": (lambda arm, data: arm.fit(data, vary="c", noise=1e-5), TypeError, "noise: float; must be standard deviations by column, {'NAME': 1e-3}"),
    "sigma": (lambda arm, data: arm.fit(data, vary="c", noise={"a_x": 0}), ValueError, "noise.a_x: value 0; must be positive"),
    "range": (lambda arm, data: arm.fit(data, vary={"c": 3}, noise=NOISE), ValueError, "vary: c: 3; must be None, (from, to) or (from, to, start)"),
    "zero": (lambda arm, data: arm.fit(data, vary="push", noise=NOISE, inputs={"push": 0}), ValueError,
             "vary: push is 0, which says nothing about its size; give its range, vary={'push': (from, to)}"),
    "sensor": (lambda arm, data: arm.fit(data, vary="c", noise=NOISE, sensors={"a_x": {"gian": 1}}), ValueError,
               "sensors: a_x: 'gian' is not one of offset, gain, delay; did you mean 'gain'?"),
    "kind": (lambda arm, data: arm.fit(3, vary="c", noise=NOISE), TypeError, "data: int; must be a file, a data frame, a dataset, columns by name, or a list of them"),
    "time": (lambda arm, data: arm.fit({"a_x": data["a_x"]}, vary="c", noise=NOISE), ValueError, "data[0]: no column t; add the time of each measurement [s]"),
    "shape": (lambda arm, data: arm.fit({**data, "a_x": data["a_x"][1:]}, vary="c", noise=NOISE), ValueError, "data[0]: a_x: has shape (399,); must have the shape of 't', (400,)"),
    "degrees": (lambda arm, data: arm.fit([data, {**data, "a_x": 1000 * data["a_x"]}], vary="c", noise=NOISE), ValueError,
                "data[1]: column a_x is 1e+03 times the motion: it seems to be in thousandths of the model's unit, such as mm"),
    "together": (lambda arm, data: arm.fit(data, vary="d,d2", noise=NOISE), Exception, "vary: d and d2: act only together on the measured columns; fix one of them or measure another column"),
    "option": (lambda arm, data: arm.fit(data, vary="c", noise=NOISE, setp=1), TypeError, "fit() got an unexpected keyword argument 'setp'; did you mean 'step'?"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_calls(slide, columns, name):
    call, kind, message = WRONG[name]
    with pytest.raises(kind) as error:
        call(slide, columns)
    assert str(error.value).endswith(message), str(error.value)
