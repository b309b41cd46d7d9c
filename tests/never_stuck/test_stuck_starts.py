"""Starts far from the programme, equilibria with free parts, follower loads, and results used as states."""
import itertools
import json

import numpy as np
import pytest

from program import LEAN, MODELS, TESTS, refdyn

PI = np.pi


# ---- Starts far from the programme ----

SLIDER = """local rd = require "refdyn"
return rd.model { name = "slider", links = {
  { "crank", joint = "psi", mass = 1, center = { 0.07, 0, 0 }, inertia = { zz = 0.01 }, start = { psi = 0.6 } },
  { "rod", on = "crank", at = { 0.15, 0, 0 }, joint = "psi", mass = 1, center = { 0.25, 0, 0 }, inertia = { zz = 0.03 }, start = { psi = -0.7 } },
  { "slider", joint = "x", mass = 1.2 } },
  points = { tip = { on = "rod", at = { 0.5, 0, 0 } } },
  constraints = function() return { rd.loop { "tip", "slider", keep = "x, y" } } end }
"""


def four_bar():
    """All assemblies of models/fourbar.lua up to whole revolutions: the crank goes round, on two branches."""
    a, b, c, d = 0.2, 0.6, 0.45, 0.55
    crank = np.linspace(-PI, PI, 4001)
    x, y = d - a * np.cos(crank), -a * np.sin(crank)
    diagonal, slope = np.hypot(x, y), np.arctan2(y, x)
    at_coupler = np.arccos((diagonal**2 + b**2 - c**2) / (2 * diagonal * b))
    at_rocker = np.arccos((diagonal**2 + c**2 - b**2) / (2 * diagonal * c))
    return np.concatenate([np.stack([crank, slope + side * at_coupler - crank, slope + PI - side * at_rocker], 1) for side in (1, -1)])


def slider_crank():
    crank = np.linspace(-PI, PI, 8001)
    tilt = -np.arcsin(0.15 * np.sin(crank) / 0.5)
    return np.concatenate([np.stack([crank, rod - crank, 0.15 * np.cos(crank) + 0.5 * np.cos(rod)], 1) for rod in (tilt, PI - tilt)])


def five_bar():
    """Both arms of models/fivebar.lua are at their driven angles: two assemblies, and whole revolutions of the lower arms."""
    base, upper, lower, left, right = 0.3, 0.35, 0.5, 2.3, 0.9
    along = base + upper * (np.cos(right) - np.cos(left)) + 1j * upper * (np.sin(right) - np.sin(left))
    slope, lift = np.angle(along), np.arccos(abs(along) / (2 * lower))
    return np.array([[left, slope + side * lift - left, right, PI + slope - side * lift - right] for side in (1, -1)])


# name: model, its assemblies, coordinates whose whole revolutions have no effect, ranges of the starts
LINKAGES = {"fourbar": (None, four_bar, (0, 1, 2), (PI, PI, PI)),
            "slider": (SLIDER, slider_crank, (0, 1), (PI, PI, 1)),
            "fivebar": (None, five_bar, (1, 3), (PI, PI, PI, PI))}


def nearest(assemblies, start, mass, turning):
    """The least distance in the metric M of the start: over all assemblies, and whole revolutions of each."""
    apart = assemblies - start
    apart[:, turning] -= 2 * PI * np.round(apart[:, turning] / (2 * PI))
    least = np.inf
    for turns in itertools.product((-2, -1, 0, 1, 2), repeat=len(turning)):
        shifted = apart.copy()
        shifted[:, turning] += 2 * PI * np.array(turns)
        least = min(least, np.einsum("ij,jk,ik->i", shifted, mass, shifted).min())
    return np.sqrt(least)


def model_file(name, folder):
    if LINKAGES[name][0] is None:
        return MODELS / f"{name}.lua"
    (folder / "model.lua").write_text(LINKAGES[name][0])
    return folder / "model.lua"


def mass_at(model, q, folder):
    (folder / "state.json").write_text(json.dumps({"q": list(q)}))
    return np.array(json.loads(refdyn("eval", model, "--state", folder / "state.json").stdout)["M"])


def landings(model, starts, folder):
    """States of motions that begin there as they are, after a negligible time; and the summary."""
    names = json.loads(refdyn("eval", model, "--state", empty_state(folder)).stdout)["coordinates"]
    rows = [",".join(names)] + [",".join(map(repr, map(float, row))) for row in starts]
    (folder / "cases.csv").write_text("\n".join(rows) + "\n")
    done = refdyn("batch", model, "--table", folder / "cases.csv", "--until", 1e-9, "--method", "rk4", "--step", 1e-9, "--stabilise", "project",
                  "-o", folder / "runs.csv", "--summary", folder / "summary.json")
    header, *lines = [line.split(",") for line in (folder / "runs.csv").read_text().splitlines()]
    first = header.index("t") + 1
    return np.array([line[first:first + len(names)] for line in lines], float), json.loads((folder / "summary.json").read_text()), done.stderr


def empty_state(folder):
    (folder / "empty.json").write_text("{}")
    return folder / "empty.json"


@pytest.mark.parametrize("name", list(LINKAGES)[:1] if LEAN else LINKAGES)
def test_random_starts(name, tmp_path):
    """Each of 40 starts ends at most 1.1 times the nearest distance away."""
    _, assemblies, turning, widths = LINKAGES[name]
    model, points = model_file(name, tmp_path), assemblies()
    starts = np.random.default_rng(5).uniform(-1, 1, (40, len(widths))) * widths
    found, summary, said = landings(model, starts, tmp_path)
    assert summary["failed"] == 0 and summary["far_starts"] > 30 and "start far from the programme, the first is case" in said
    for start, state in zip(starts, found):
        mass = mass_at(model, start, tmp_path)
        moved = np.sqrt((state - start) @ mass @ (state - start))
        assert moved < 1.1 * nearest(points, start, mass, list(turning)), (name, start, state)


@pytest.mark.parametrize("model, n, width", [("bricard", 5, 0.3), ("bricard", 5, 3), ("stewart", 6, 1), ("slidercrank", 5, 3)])
def test_other_linkages_arrive(model, n, width, tmp_path):
    """Redundant rows, many rows, straight rows: each start arrives, and stays there."""
    starts = np.random.default_rng(3).uniform(-width, width, (25, n)) if model != "stewart" else None
    if starts is None:
        n = len(json.loads(refdyn("eval", MODELS / "stewart.lua", "--state", empty_state(tmp_path)).stdout)["coordinates"])
        starts = np.random.default_rng(3).uniform(-width, width, (25, n))
    found, summary, _ = landings(MODELS / f"{model}.lua", starts, tmp_path)
    assert summary["failed"] == 0 and abs(found - starts).max() < 100


@pytest.mark.parametrize("start", ["project", "as-is"])
def test_far_start_is_reported(start, tmp_path):
    state, summary = tmp_path / "far.json", tmp_path / "summary.json"
    state.write_text(json.dumps({"q": [3, -2, 1.5]}))
    done = refdyn("sim", MODELS / "fourbar.lua", "--from", state, "--start", start, "--until", 0.001, "-o", tmp_path / "run.csv", "--summary", summary)
    moved = json.loads(summary.read_text())["start_moved"]
    assert list(moved) == ["crank_psi", "coupler_psi", "rocker_psi"] and abs(moved["rocker_psi"] - 0.578) < 1e-3
    assert "refdyn: warning: the start is far from the programme. The projection moves rocker_psi by 0.5781 rad to 2.07806, " in done.stderr


def test_near_start_is_not(tmp_path):
    """A few hundredths away, no message mentions distances."""
    found = json.loads(refdyn("statics", MODELS / "fourbar.lua", "--set", "torque=0", "--way", "downhill").stdout)["q"]
    (tmp_path / "near.json").write_text(json.dumps({"q": [found[0] + 0.02, found[1], found[2]]}))
    done = refdyn("sim", MODELS / "fourbar.lua", "--from", tmp_path / "near.json", "--start", "project", "--until", 0.001, "-o", tmp_path / "run.csv",
                  "--summary", tmp_path / "summary.json")
    assert "far from the programme" not in done.stderr and "start_moved" not in json.loads((tmp_path / "summary.json").read_text())


def test_rows_that_feel_whole_turns(tmp_path):
    """A gear keeps the sum of turns, so that no turn may be undone alone."""
    (tmp_path / "gear.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "gear", links = { { "a", joint = "psi", mass = 1, inertia = { zz = 1 } }, { "b", joint = "psi", mass = 1, inertia = { zz = 4 } } },
  constraints = function(s) return { rd.position { s.q.a_psi + 2 * s.q.b_psi } } end }
""")
    found, summary, _ = landings(tmp_path / "gear.lua", [[20, 5]], tmp_path)
    # the least of da^2 + 4 db^2 with da + 2 db = -30
    assert summary["failed"] == 0 and abs(found[0] - [5, -2.5]).max() < 1e-9


# ---- Unsupported parts ----

FREE = """local rd = require "refdyn"
local row, kind = rd.option("row", 1), rd.option("kind", "beam")
local links = { { "cart", joint = "x", mass = 1 } }
if kind == "beam" then
  links[2] = { "rod", on = "cart", joint = {}, beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 4 } }
elseif kind == "bent" then
  links[2] = { "rod", on = "cart", turn = { { "y", 0.4 }, { "z", 0.3 } }, joint = {}, beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 3 } }
elseif kind == "arm" then
  links[2] = { "arm", on = "cart", joint = "theta", mass = 1, center = { 0.3, 0, -0.5 }, inertia = { yy = 0.1 }, spring = { theta = 3 } }
elseif kind == "wheel" then
  links[2] = { "arm", on = "cart", joint = "theta", mass = 1, center = { 0.3, 0, -0.5 }, inertia = { yy = 0.1 }, spring = { theta = 30 } }
  links[3] = { "wheel", on = "arm", at = { 0.4, 0.1, 0 }, joint = "theta", mass = 2, inertia = { yy = 0.3 } }
end
links[#links + 1] = { "other", joint = "psi", turn = { { "x", rd.pi / 2 } }, start = { psi = -0.6 }, mass = 2, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 } }
links[#links + 1] = { "third", on = "other", at = { 1, 0, 0 }, joint = "psi", start = { psi = -1.2 }, mass = 2, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 } }
return rd.model { name = "free", gravity = { 0, 0, -9.81 }, links = links, points = { tip = { on = "third", at = { 1, 0, 0 } } },
  constraints = function(s) return row == 1 and { rd.position { s.points.tip.x^2 + s.points.tip.z^2 - 2 } } or {} end }
"""


@pytest.mark.parametrize("kind, free", [("cart", 1), ("beam", 1), ("bent", 1), ("arm", 1), ("wheel", 2)])
@pytest.mark.parametrize("row", [0, 1])
def test_free_slide(kind, free, row, tmp_path):
    """An unsupported part is neutral, regardless of the rows of other links."""
    (tmp_path / "free.lua").write_text(FREE)
    done = refdyn("statics", tmp_path / "free.lua", "--set", f"row={row}", "--set", f"kind={kind}", "--way", "downhill" if kind == "bent" else "load")
    assert json.loads(done.stdout)["neutral"] == free and "nothing holds" not in done.stderr


# ---- Follower loads ----

BECK = """local rd = require "refdyn"
local n, dofs, row = rd.option("n", 16), rd.option("dofs", "psi"), rd.option("row", 0)
local p = rd.parameters { { "load", 15, "1" }, { "eta", 0, "s" } }                -- load: of E I / L^2
local EI = 2e11 * 0.01^4 / 12
local links = { { "column", beam = { length = 1, section = rd.rectangle(0.01, 0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = n, dofs = dofs, eta = p.eta } } }
if row == 1 then
  links[2], links[3] = { "a", joint = "z", mass = 1, spring = { z = 100 } }, { "b", joint = "z", mass = 1, spring = { z = 100 } }
end
return rd.model { name = "beck", links = links, points = { tip = "column.tip" },
  forces = function() return { rd.force { "tip", { -p.load * EI, 0, 0 }, axes = "column.tip" } } end,
  constraints = function(s) return row == 1 and { rd.position { s.q.a_z - s.q.b_z } } or {} end }
"""


def judged(folder, command="statics", **settings):
    (folder / "beck.lua").write_text(BECK)
    done = refdyn(command, folder / "beck.lua", *itertools.chain(*(("--set", f"{key}={value}") for key, value in settings.items())))
    return json.loads(done.stdout), done.stderr


@pytest.mark.parametrize("settings", [{}, {"row": 1}, {"dofs": "psi,theta"}])
@pytest.mark.parametrize("load, unstable", [(15, 0), (19.8, 0), (20.3, 1), (30, 1)])
def test_beck(load, unstable, settings, tmp_path):
    """Stable until two modes meet at 20.05 (Beck, ZAMP 3:225-228, 1952), bent in one plane or in two."""
    found, said = judged(tmp_path, load=load, **settings)
    assert found["unstable"] == unstable * (2 if "dofs" in settings else 1) and found["neutral"] == 0
    assert found["criterion"] == "linear motion" and found["potential"] is False
    assert "its forces have no potential, so the growing modes were counted; refdyn modes shows them" in said


@pytest.mark.parametrize("load, eta", [(12, 1e-4), (8, 1e-2), (15, 1e-2), (25, 1e-4)])
def test_dampers_that_destabilise(load, eta, tmp_path):
    """As many growing modes as `modes` computes."""
    assert judged(tmp_path, load=load, eta=eta)[0]["unstable"] == judged(tmp_path, "modes", load=load, eta=eta)[0]["unstable"]


def test_follower_load_in_a_batch_and_a_motion(tmp_path):
    judged(tmp_path)
    (tmp_path / "cases.csv").write_text("load\n15\n19\n21\n30\n")
    refdyn("batch", tmp_path / "beck.lua", "--table", tmp_path / "cases.csv", "--from", "statics", "--until", 1e-5, "-o", tmp_path / "runs.csv",
           "--summary", tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text())["unstable"] == 2
    refdyn("sim", tmp_path / "beck.lua", "--from", "statics", "--until", 1e-5, "-o", tmp_path / "run.csv", "--summary", tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text())["equilibrium"] == "stable"


def test_potential_is_the_criterion_elsewhere():
    found = json.loads(refdyn("statics", MODELS / "fourbar.lua", "--set", "torque=0", "--way", "downhill").stdout)
    assert found["criterion"] == "potential" and found["potential"] is True


# ---- Results used as states ----

def first_row(path):
    return np.array(path.read_text().splitlines()[1].split(","), float)


@pytest.mark.parametrize("model, settings", [
    (MODELS / "fourbar.lua", ["--set", "torque=0.3", "--set", "g=5", "--way", "downhill"]),
    (MODELS / "bricard.lua", ["--way", "downhill"]),
    (MODELS / "slidercrank.lua", ["--set", "m_slider=2"]),
    (MODELS / "manipulator.lua", ["--set", "m_E=3", "--set", "n_rfe=2"]),
    (TESTS / "models" / "princeton.lua", ["--set", "P=5", "--set", "angle=20"]),
])
def test_equilibrium_is_a_state(model, settings, tmp_path):
    """A motion, modes and values from the result of statics equal those from the equilibrium itself."""
    state, options = tmp_path / "equilibrium.json", [word for word in settings if word.startswith("n_rfe")]
    structure = ["--set", *options] if options else []
    refdyn("statics", model, *settings, "-o", state)
    way = settings[-2:] if "--way" in settings else []
    common = ["--until", 0.001, "--method", "rk4", "--step", 1e-4]
    refdyn("sim", model, *structure, "--from", state, *common, "-o", tmp_path / "a.csv")
    refdyn("sim", model, *[word for word in settings if word not in way], *way, "--from", "statics", *common, "-o", tmp_path / "b.csv")
    assert np.allclose(first_row(tmp_path / "a.csv"), first_row(tmp_path / "b.csv"), rtol=1e-9, atol=1e-6, equal_nan=True)
    found = json.loads(state.read_text())
    seen = json.loads(refdyn("eval", model, *structure, "--state", state).stdout)
    assert {name: seen["points"][name]["r"] for name in seen["points"]} == found["points"] and set(found["qd"]) <= {0}


def test_modes_at_results(tmp_path):
    """Modes about the result of statics, and about the result of modes; with --fold, too."""
    model, said = MODELS / "fourbar.lua", []
    refdyn("statics", model, "--set", "g=5", "--set", "torque=0", "--fold", "--way", "downhill", "-o", tmp_path / "0.json")
    for number in range(2):
        done = refdyn("modes", model, "--at", tmp_path / f"{number}.json", "-o", tmp_path / f"{number + 1}.json")
        said.append(json.loads((tmp_path / f"{number + 1}.json").read_text())["modes"])
        assert "not an equilibrium" not in done.stderr
    assert said[0] == said[1]


def test_time_is_kept(tmp_path):
    (tmp_path / "at.json").write_text('{"t": 0.2}')
    refdyn("statics", MODELS / "slidercrank.lua", "--state", tmp_path / "at.json", "-o", tmp_path / "state.json")
    refdyn("sim", MODELS / "slidercrank.lua", "--from", tmp_path / "state.json", "--until", 0.201, "-o", tmp_path / "run.csv")
    assert first_row(tmp_path / "run.csv")[0] == 0.2


def test_states_of_other_models_are_refused(tmp_path):
    refdyn("statics", MODELS / "fourbar.lua", "--set", "torque=0", "--way", "downhill", "-o", tmp_path / "state.json")
    done = refdyn("eval", MODELS / "slidercrank.lua", "--state", tmp_path / "state.json", status=1)
    assert ":3: coordinates[1]: coupler_psi, but the model has rod_psi; use a state of the same model and options" in done.stderr


def test_misspelt_keys_are_still_found(tmp_path):
    (tmp_path / "state.json").write_text('{"Q": [0, 0, 0], "criterio": 1}')
    done = refdyn("eval", MODELS / "fourbar.lua", "--state", tmp_path / "state.json", status=1)
    assert "Q: unknown key of a state" in done.stderr and "criterio: unknown key of a state" in done.stderr
