"""Limits of a model: extremes, first time beyond a limit and its duration, against closed forms and dense motions; they change no motion."""
import csv
import json
import re

import numpy
import pytest

from program import MODELS, TESTS, motion, refdyn

# x = cos(w t) and y = 0.3 sin(3 w t) + z t^2 / 2, known in closed form; an impact doubles the speed of b at t = 0.4.
SLIDES = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "w", 5, "rad/s" }}, {{ "z", 2, "m/s^2" }} }}
return rd.model {{
  name = "slides", gravity = {{ 0, 0, 0 }},
  links = {{
    {{ "a", joint = "x", mass = 1, spring = {{ x = p.w^2 }}, start = {{ x = 1 }}, limits = {{ x = {{ from = -0.9, rate = 4.5 }} }} }},
    {{ "b", joint = "x", mass = 1, start_rate = {{ x = 1 }} }},
    {{ "c", joint = "x", mass = 2 }},
  }},
  points = {{ E = {{ on = "a", at = {{ 0, 1, 0 }} }} }},
  events = function(s) return {{ rd.event {{ s.q.b_x - 0.4, rates = {{ b_x = 2 * s.qd.b_x }}, direction = "up" }} }} end,
  constraints = function(s) return {{ rd.drive {{ "c_x", 0.1 * rd.sin(3 * s.t), alpha = 0, beta = 0 }} }} end,
  limits = function(s)
    return {{
      {{ "mixed", 0.3 * rd.sin(3 * p.w * s.t) + s.q.a_x, from = -1.1, to = 0.8 }}, {{ "fast", column = "b_x_d", to = 1.5 }},
      {{ "acceleration", column = "a_x_dd", to = 20 }}, {{ "hold", column = "force_c_x", from = -1, to = 1.5 }}, {{ "wide", s.points.E.xd, to = 1000 }}{more}
    }}
  end,
}}"""


def written(folder, text=SLIDES, more=""):
    (folder / "slides.lua").write_text(text.format(more=more))
    return folder / "slides.lua"


def beyond(t, value, least, most):
    """First time and duration beyond bounds, of dense samples; and the smallest and largest value."""
    out = (value < least) | (value > most)
    return (t[numpy.argmax(out)] if out.any() else None), numpy.mean(out) * (t[-1] - t[0]), value.min(), value.max()


EXACT = {
    "a_x": (lambda t: numpy.cos(5 * t), -0.9, numpy.inf), "a_x_d": (lambda t: -5 * numpy.sin(5 * t), -4.5, 4.5),
    "mixed": (lambda t: 0.3 * numpy.sin(15 * t) + numpy.cos(5 * t), -1.1, 0.8), "fast": (lambda t: numpy.where(t < 0.4, 1.0, 2.0), -numpy.inf, 1.5),
    "acceleration": (lambda t: -25 * numpy.cos(5 * t), -numpy.inf, 20), "hold": (lambda t: -1.8 * numpy.sin(3 * t), -1, 1.5),
    "wide": (lambda t: -5 * numpy.sin(5 * t), -numpy.inf, 1000),
}


@pytest.mark.parametrize("every", [0.01, 0.7])
@pytest.mark.parametrize("method", ["rk8", "radau9", "rodas5p", "gauss12"])
def test_against_closed_forms(method, every, tmp_path):
    """Of methods with few, long steps, too; outputs do not matter."""
    run, said, summary = motion(written(tmp_path), "--until", 3, "--method", method, "--tol", 1e-9, "--every", every)
    t = numpy.linspace(0, 3, 3_000_001)
    found = {limit["name"]: limit for limit in summary["limits"]}
    assert found.keys() == EXACT.keys()
    for name, (value, least, most) in EXACT.items():
        limit = found[name]
        first, duration, smallest, largest = beyond(t, value(t), least, most)
        assert abs(limit["smallest"] - smallest) < 1e-6 and abs(limit["largest"] - largest) < 1e-6, name
        if name != "fast":
            assert abs(value(numpy.array(limit["t_smallest"])) - smallest) < 1e-6 and abs(value(numpy.array(limit["t_largest"])) - largest) < 1e-6, name
        assert (limit["from"], limit["to"]) == tuple(None if numpy.isinf(x) else x for x in (least, most))
        assert (limit["t"] is None) == (first is None) and abs(limit["duration"] - duration) < 3e-6, name
        assert abs(limit["violation"] - (max(least - smallest, largest - most, 0))) < 1e-6, name
        if first is not None:
            assert abs(limit["t"] - first) < 2e-6, name
            assert re.search(rf"warning: {name} exceeds its limits: ", said), said
    assert "warning: wide" not in said and "hold exceeds its limits: programme force -1.8 N " in said


def test_a_motion_does_not_change(tmp_path):
    """The same bits with and without limits, but for their own columns."""
    texts = [SLIDES, re.sub(r", limits = \{\{ x.*?\}\} \}\}", "", re.sub(r"  limits = function.*?  end,\n", "", SLIDES, flags=re.S))]
    runs = []
    for text in texts:
        refdyn("sim", written(tmp_path, text), "--until", 2, "--every", 0.05, "-o", tmp_path / "run.csv")
        with open(tmp_path / "run.csv") as file:
            runs.append(list(csv.DictReader(file)))
    assert set(runs[0][0]) - set(runs[1][0]) == {"mixed", "wide"}
    assert all(a[name] == b[name] for a, b in zip(*runs, strict=True) for name in b)


def test_emitted_code_of_columns_is_equal(tmp_path):
    """Bounds of columns emit nothing; a value is a course."""
    text = (MODELS / "crane.lua").read_text()
    (tmp_path / "crane.lua").write_text(text)
    refdyn("gen", tmp_path / "crane.lua", "-o", tmp_path / "plain")
    bounded = re.sub(r"(return rd.model \{)", r'\1 limits = function(s) return { { "swing", column = "load_z_d", to = 1 } } end,', text, count=1)
    assert bounded != text
    (tmp_path / "crane.lua").write_text(bounded)
    refdyn("gen", tmp_path / "crane.lua", "-o", tmp_path / "bounded")
    for path in (tmp_path / "plain").iterdir():
        assert path.read_text() == (tmp_path / "bounded" / path.name).read_text(), path.name


def test_to_the_time_of_a_stop(tmp_path):
    """A condition that ends the motion within a step ends the comparison, too."""
    run, said, summary = motion(written(tmp_path), "--until", 3, "--stop", "a_x<-0.95")
    end = run["t"][-1]
    limit = summary["limits"][0]
    assert limit["name"] == "a_x" and limit["t"] < end == limit["t_smallest"] and abs(limit["smallest"] + 0.95) < 1e-6
    assert abs(limit["duration"] - (numpy.arccos(-0.95) - numpy.arccos(-0.9)) / 5) < 1e-7


def test_equilibria(tmp_path):
    """At rest: coordinates, points, courses, and the forces that hold coordinates, of their rows and drives."""
    text = """local rd = require "refdyn"
return rd.model {
  name = "held", gravity = { 0, -9.81, 0 },
  links = {
    { "a", joint = "psi", mass = 5, center = { 0.4, 0, 0 }, inertia = { zz = 0.3 }, start = { psi = 0.1 },
      limits = { psi = { from = -1, to = 0.2, force = 30 } } },
    { "b", on = "a", at = { 0.8, 0, 0 }, joint = "psi", mass = 3, center = { 0.3, 0, 0 }, inertia = { zz = 0.1 }, start = { psi = 0.5 } },
  },
  points = { E = { on = "b", at = { 0.6, 0, 0 } } },
  drives = { { "b_psi", limit = 5 } },
  hold = { "a_psi", "b_psi" },
  limits = function(s) return { { "low", column = "E_y", to = 0.2 }, { "sum", s.q.a_psi + 2 * s.q.b_psi, from = 0.6 }, { "fast", column = "a_psi_d", to = 1 } } end,
}"""
    (tmp_path / "held.lua").write_text(text)
    done = refdyn("statics", tmp_path / "held.lua", "-o", tmp_path / "held.json")
    result = json.loads((tmp_path / "held.json").read_text())
    turn = 3 * 9.81 * 0.3 * numpy.cos(0.6)
    exact = {"a_psi": 0.1, "force_a_psi": (5 * 0.4 + 3 * 0.8) * 9.81 * numpy.cos(0.1) + turn, "drive_b_psi": turn, "low": 0.8 * numpy.sin(0.1) + 0.6 * numpy.sin(0.6),
             "sum": 1.1, "fast": 0}
    limits = {limit["name"]: limit for limit in result["limits"]}
    assert limits.keys() == exact.keys() and all(abs(limits[name]["value"] - value) < 1e-9 for name, value in exact.items())
    beyond = {"force_a_psi": 30, "drive_b_psi": 5, "low": 0.2}
    assert {name: limit["violation"] > 0 for name, limit in limits.items()} == {name: name in beyond for name in exact}
    assert all(abs(limits[name]["violation"] - (exact[name] - most)) < 1e-9 and f"warning: {name} exceeds its limits: " in done.stderr for name, most in beyond.items())
    refdyn("sim", tmp_path / "held.lua", "--from", tmp_path / "held.json", "--until", 0.01, "-o", tmp_path / "run.csv")


def test_outputs_of_the_linear_model(tmp_path):
    """A value with bounds is an output."""
    model = written(tmp_path, SLIDES.replace("  events = function", "  courses = function(s) return {{ height = s.q.a_x }} end,\n  events = function"))
    refdyn("linearise", model, "--at", "initial", "-o", tmp_path / "linear.json")
    assert {"height", "mixed", "wide"} <= set(json.loads((tmp_path / "linear.json").read_text())["outputs"])


def test_batches_keep_limits(tmp_path):
    """As in single motions, to what the outputs show; a limit that holds has no time beyond it."""
    model = written(tmp_path)
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { w = { 4, 5, 6.5 } }, t_end = 3, keep = { limits = true } }')
    refdyn("batch", model, tmp_path / "sweep.lua", "-o", tmp_path / "runs.csv", "--every", 0.005)
    with open(tmp_path / "runs.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3
    for row in rows:
        _, _, summary = motion(model, "--set", f"w={row['w']}", "--until", 3)
        for limit in summary["limits"]:
            found = {key: float(row[f"limit_{limit['name']}_{key}"] or "nan") for key in ("min", "min_t", "max", "max_t", "beyond_t", "beyond_s")}
            rough = 0.01 if limit["name"] == "fast" else 1e-4  # its value jumps
            assert abs(found["min"] - limit["smallest"]) < 1e-4 and abs(found["max"] - limit["largest"]) < 1e-4
            assert abs(found["beyond_s"] - limit["duration"]) < 40 * rough * 0.005 + 1e-3
            assert numpy.isnan(found["beyond_t"]) if limit["t"] is None else abs(found["beyond_t"] - limit["t"]) < rough


def test_groups_of_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { w = { 4, 5 } }, t_end = 1, keep = { final = true, limits = true } }')
    refdyn("batch", written(tmp_path), tmp_path / "sweep.lua", "-o", tmp_path / "runs.h5")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert set(file["limits"]) == {*EXACT, "which"} and file["limits/mixed"].shape == (2, 6)
    refdyn("sim", "--case", 1, "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv")


def test_plot_draws_bounds(tmp_path):
    """A chart for each limit with its column, near bounds as dashed lines, and an area where the motion is beyond one."""
    model = written(tmp_path)
    refdyn("sim", model, "--until", 2, "-o", tmp_path / "run.csv", "--summary", tmp_path / "run.json")
    refdyn("plot", tmp_path / "run.csv", "--units", tmp_path / "run.json", "--panel", "limits", "-o", tmp_path / "run.svg")
    text = (tmp_path / "run.svg").read_text()
    assert [name in text for name in ("Limit: a_x<", "Limit: mixed<", "Limit: fast<", "Limit: hold<")] == [True] * 4
    assert text.count("#e8b0b0") == text.count("stroke-dasharray") == 9  # each bound of the first six limits has both
    refdyn("plot", tmp_path / "run.csv", "--panel", "limits", "-o", tmp_path / "none.svg", status=1)


@pytest.mark.parametrize("method", ["rk8", "radau9"])
def test_before_a_jump_in_time(method, tmp_path):
    """A value that rises until it jumps at a time event has its extreme just before the jump, and one that falls afterwards has its at the end."""
    more = ', {{ "saw", rd.where(rd.less(s.t, 0.73), s.t, -s.t), from = -0.8, to = 0.7 }}'.replace("{{", "{").replace("}}", "}")
    _, _, summary = motion(written(tmp_path, more=more), "--until", 1, "--method", method)
    limit = next(limit for limit in summary["limits"] if limit["name"] == "saw")
    assert abs(limit["largest"] - 0.73) < 1e-9 and abs(limit["smallest"] + 1) < 1e-9 and abs(limit["t"] - 0.7) < 1e-8 and abs(limit["duration"] - 0.23) < 1e-8


def test_rounding_is_not_beyond(tmp_path):
    """A value that rounds about its bound holds the limit, in motions and in batches."""
    model = written(tmp_path, more=', {{ "one", rd.sin(7 * s.t)^2 + rd.cos(7 * s.t)^2, to = 1 }}'.replace("{{", "{").replace("}}", "}"))
    _, _, summary = motion(model, "--until", 2)
    assert next(limit for limit in summary["limits"] if limit["name"] == "one")["t"] is None
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { w = { 5 } }, t_end = 2, keep = { limits = true } }')
    refdyn("batch", model, tmp_path / "sweep.lua", "-o", tmp_path / "runs.csv")
    header, row = ((tmp_path / "runs.csv").read_text().splitlines()[i].split(",") for i in (0, 1))
    found = dict(zip(header, row))
    assert found["limit_one_beyond_t"] in ("", "nan") and float(found["limit_one_beyond_s"]) == 0
