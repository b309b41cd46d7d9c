"""`sim --steps`: a row for each attempted step, against the statistics of the motion and known reasons, by all kinds of methods."""
import collections
import csv
import math
import random
import re

import pytest

from program import LONG, MODELS, SOURCE, TESTS, motion, refdyn

SCENES = TESTS / "models"
ADAPTIVE = ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
# Models in which every kind of obstacle and of failure occurs.
VARIOUS = [MODELS / "fourbar.lua", MODELS / "crane.lua", SCENES / "double_pendulum.lua", SCENES / "bouncing.lua", SCENES / "equal_crank.lua",
           SCENES / "switched.lua", SCENES / "rows_in_time.lua", SCENES / "reach.lua", SCENES / "contacts" / "slide.lua", SCENES / "events" / "ball.lua"]
UNTAKEN = "jump crossed"  # a row without a step
FAILED = "Newton's iteration did not converge"


def steps(folder, model, *arguments, status=0):
    """The rows of --steps, and the standard error."""
    done = refdyn("sim", model, *arguments, "-o", folder / "run.csv", "--steps", folder / "steps.csv", status=status)
    with open(folder / "steps.csv", newline="") as file:
        return list(csv.DictReader(file)), done.stderr


def chosen(rows, **values):
    return [row for row in rows if all(row[name] == value for name, value in values.items())]


def end(row):
    return float(row["t"]) + float(row["h"])


def wrong_with(rows, said):
    """What contradicts the statistics, or itself."""
    taken, rejected = map(int, re.search(r"^steps +(\d+) taken, (\d+) rejected", said, re.M).groups())
    accepted = chosen(rows, verdict="accepted")
    refused = [row for row in rows if row["verdict"] not in ("accepted", UNTAKEN)]
    if (len(accepted), len(refused)) != (taken, rejected):
        yield f"{len(accepted)} accepted and {len(refused)} refused rows, {taken} and {rejected} steps"
    for before, after in zip(accepted, accepted[1:]):
        if abs(end(before) - float(after["t"])) > 1e-12 * max(1, abs(end(before))):
            yield f"{after['t']} does not follow {end(before)}"
    highest = collections.defaultdict(float)
    for row in rows:
        highest[row["method"]] = max(highest[row["method"]], float(row["order"] or 0))
    for before, row in zip([{"t": ""}, *rows], rows):
        is_compared = (before["t"] == row["t"] and before["verdict"] in ("error", "error of rates") and before["obstacle"] == "none"
                       and before["method"] == row["method"] and float(before["h"]) > float(row["h"]))
        if row["error"] and is_compared:
            observed = math.log(float(before["error"]) / float(row["error"])) / math.log(float(before["h"]) / float(row["h"]))
            if abs(float(row["order"]) - min(max(observed, 1), highest[row["method"]])) > 1e-9:
                yield f"order {row['order']}, not {observed}"
        elif row["error"] and float(row["order"]) != highest[row["method"]]:
            yield f"order {row['order']} without a refused attempt"
    for row in rows:
        ordinary = row["kind"] in ("ordinary", "start", "trial")
        if ordinary and row["error"] and {"accepted": float(row["error"]) > 1, "error": float(row["error"]) <= 1,
                                          "error of rates": float(row["error"]) <= 1}.get(row["verdict"]):
            yield f"{row['verdict']}: {row['error']}"
        if (row["verdict"] in ("stage failed", "end failed")) != bool(row["cause"]):
            yield f"{row['verdict']}: cause '{row['cause']}'"
        if bool(row["error"]) != bool(row["order"]) or bool(row["event"]) > (row["obstacle"] == "state event"):
            yield f"{row}"
        if (row["iterations"] != "") != (row["method"] in ("radau9", "gauss12")):
            yield f"{row['method']}: {row['iterations']} iterations"


def random_motion(rng):
    method = rng.choice([*ADAPTIVE, "auto", "rk4"])
    until = float(f"{10 ** rng.uniform(-1.3, 0.2):.3g}")
    arguments = ["--until", until, "--method", method, "--every", float(f"{until / rng.choice([1, 3, 40]):.3g}")]
    if method == "rk4" or (method != "auto" and rng.random() < 0.3):
        arguments += ["--step", float(f"{10 ** rng.uniform(-3, -1.7):.3g}")]
    else:
        arguments += ["--tol", 10 ** rng.uniform(-9, -3), *(["--tol-rates", 1e-5] if rng.random() < 0.2 else [])]
    arguments += ["--singular", "pass"] if rng.random() < 0.5 else []
    return rng.choice(VARIOUS), arguments


@pytest.mark.parametrize("seed", range(400 if LONG else 24))
def test_rows_are_the_steps_of_the_statistics(seed, tmp_path):
    model, arguments = random_motion(random.Random(seed))
    rows, said = steps(tmp_path, model, *arguments, status=None)
    assert not list(wrong_with(rows, said)), (model, arguments)
    if "what was computed until then" not in said and "event" not in said:
        assert abs(end(chosen(rows, verdict="accepted")[-1]) - arguments[1]) <= 1e-12


def fall(path, force="0", events="", more=""):
    """A mass that starts at x = 0 at 1.7 m/s; y is free."""
    path.write_text(f"""local rd = require "refdyn"
return rd.model {{ name = "fall",
  links = {{ {{ "m", joint = "x, y", mass = 2, start_rate = {{ x = 1.7 }} }} }},
  forces = function(s) local x, y, t = s.q.m_x, s.q.m_y, s.t return {{ m_y = {force} }} end,
  events = function(s) local x, y, t = s.q.m_x, s.q.m_y, s.t return {{ {events} }} end, {more} }}
""")
    return path


def ends_at(rows, t, obstacle, event=""):
    """An accepted step ends at this obstacle, and the next attempt starts the method again."""
    there = [i for i, row in enumerate(rows) if row["verdict"] == "accepted" and row["obstacle"] == obstacle]
    assert len(there) == 1 and abs(end(rows[there[0]]) - t) < 1e-9, rows
    assert rows[there[0]]["event"] == event and rows[there[0] + 1]["kind"] == "start"
    return there[0]


@pytest.mark.parametrize("method", ["auto", "rk54", "rk8", "rodas5p", "radau9", "gauss12"])
def test_obstacles(method, tmp_path):
    """Each kind of obstacle at a time of a closed form. What refuses the step before it says so."""
    event = 'rd.event { name = "gate", x - 0.5134, rates = { m_x = 1.7 } }'
    rows, _ = steps(tmp_path, fall(tmp_path / "gate.lua", events=event), "--until", 1, "--method", method)
    place = ends_at(rows, 0.5134 / 1.7, "state event", "gate")
    tried = [row for row in rows[:place] if float(row["t"]) == float(rows[place]["t"])]
    assert tried and all((row["verdict"], row["event"]) == ("passed obstacle", "gate") for row in tried[-1:]), rows
    rows, _ = steps(tmp_path, fall(tmp_path / "kink.lua", "40 * rd.max(0, x - 0.7134)"), "--until", 1, "--method", method)
    place = ends_at(rows, 0.7134 / 1.7, "kink")
    assert rows[place - 1]["obstacle"] == "kink" and rows[place - 1]["verdict"] in ("passed obstacle", "error", "error of rates"), rows
    rows, _ = steps(tmp_path, fall(tmp_path / "time.lua", "rd.where(rd.less(t, 0.371), 0, 3)"), "--until", 1, "--method", method)
    ends_at(rows, 0.371, "time event")
    assert rows[-1]["obstacle"] == "bound" and end(rows[-1]) == 1


@pytest.mark.parametrize("method", ["auto", "rk8", "radau9"])
def test_samples_are_bounds(method, tmp_path):
    model = fall(tmp_path / "pushed.lua", "u", more='').read_text().replace("return rd.model", 'local u = rd.input("u", 0)\nreturn rd.model')
    (tmp_path / "pushed.lua").write_text(model)
    (tmp_path / "u.csv").write_text("t,u\n0,1\n0.313,-2\n0.77,4\n")
    rows, _ = steps(tmp_path, tmp_path / "pushed.lua", "--until", 1, "--method", method, "--inputs", tmp_path / "u.csv", "--every", 1)
    assert [round(end(row), 12) for row in rows if row["obstacle"] == "bound"] == [0.313, 0.77, 1]


@pytest.mark.parametrize("how", [("--step", 0.013), ("--tol", 1e-6, "--tol-rates", 1e-4)], ids=["fixed", "rates"])
def test_outputs(how, tmp_path):
    """Steps that end at outputs; the last one is the end."""
    rows, _ = steps(tmp_path, SCENES / "double_pendulum.lua", "--until", 1, "--every", 0.25, "--method", "rk8", *how)
    assert [round(end(row), 12) for row in rows if row["obstacle"] == "output"] == [0.25, 0.5, 0.75]
    assert all((row["error"] == "") == ("--step" in how) for row in rows)


def test_rates_refuse(tmp_path):
    rows, said = steps(tmp_path, MODELS / "crane.lua", "--until", 1, "--tol", 1e-3, "--tol-rates", 1e-6, "--method", "rk54")
    assert chosen(rows, verdict="error of rates", obstacle="none") and not list(wrong_with(rows, said))


@pytest.mark.parametrize("method", ["rk8", "radau9", "rodas5p", "auto"])
def test_value_that_is_not_finite(method, tmp_path):
    """A root of a negative number from x = 0.85 on: stages there fail."""
    model = fall(tmp_path / "root.lua", "rd.sqrt(0.85 - x)")
    rows, said = steps(tmp_path, model, "--until", 1, "--method", method, status=3)
    last = rows[-1]
    assert last["verdict"] in ("stage failed", "end failed") and last["cause"] == "the equations gave an infinite or undefined value"
    assert abs(float(last["t"]) - 0.5) < 1e-6 and "what was computed until then" in said


def test_iterations_of_a_step_without_any(tmp_path):
    """An event stops y, where the tangent of the damper is infinite: no iteration begins."""
    model = fall(tmp_path / "halt.lua", "-rd.sqrt(rd.max(0, s.qd.m_y))", 'rd.event { x - 0.4, rates = { m_y = 0 } }')
    model.write_text(model.read_text().replace("{ x = 1.7 }", "{ x = 1.7, y = 1.1 }"))
    rows, _ = steps(tmp_path, model, "--until", 1, "--method", "radau9", status=3)
    failed = chosen(rows, verdict="stage failed", iterations="0", kind="start")
    assert failed == rows[-len(failed):] and all(int(row["iterations"]) > 0 for row in chosen(rows, verdict="accepted"))


@pytest.mark.parametrize("method", ["rk4", "rk8", "radau9"])
def test_fixed_step_that_fails(method, tmp_path):
    """The last row is the step that ended the motion, and counts as rejected."""
    rows, said = steps(tmp_path, fall(tmp_path / "root.lua", "rd.sqrt(0.85 - x)"), "--until", 1, "--method", method, "--step", 0.0317, status=3)
    assert rows[-1]["cause"] and not chosen(rows[:-1], verdict="stage failed") and not list(wrong_with(rows, said))


@pytest.mark.parametrize("method", ["auto", "gauss12", "radau9"])
def test_iteration_that_fails(method, tmp_path):
    """Two bars that are driven beyond their reach, which ends at sqrt(2 (1 - cos 0.9) / 0.3)."""
    rows, _ = steps(tmp_path, SCENES / "reach.lua", "--until", 2, "--method", method, status=3)
    failed = chosen(rows, cause=FAILED)
    assert {"stage failed"} <= {row["verdict"] for row in failed} <= {"stage failed", "end failed"}
    assert all(int(row["iterations"]) > 0 for row in chosen(failed, verdict="stage failed", method="gauss12"))
    reach = math.sqrt(2 * (1 - math.cos(0.9)) / 0.3)
    assert all(abs(float(row["t"]) - reach) < 1e-3 for row in failed[-3:])


@pytest.mark.parametrize("method", ["auto", "rk8", "gauss12", "rk4"])
def test_crossing(method, tmp_path):
    model, arguments = SCENES / "arm_through.lua", ["--until", 1.6, "--singular", "pass", "--method", method]
    rows, said = steps(tmp_path, model, *arguments)
    found = [float(t) for t in re.findall(r"t = ([\d.]+) s by", re.search(r"^passed.*$", said, re.M)[0])]
    across = chosen(rows, kind="crossing", verdict="accepted", obstacle="singular state", method="rk8")
    assert len(across) == len(found) > 0 and all(float(row["t"]) < t < end(row) for row, t in zip(across, found))
    assert method == "rk4" or all(float(row["error"]) <= 0.11 for row in across)
    assert not chosen(rows, kind="crossing", cause=FAILED, verdict="error")


def test_halfway_to_a_singular_state(tmp_path):
    """After a crossing that is refused, an ordinary step ends halfway to the state."""
    rows, said = steps(tmp_path, SCENES / "arm_through.lua", "--until", 1.6, "--singular", "pass", "--method", "rk8", "--tol", 1e-5)
    t = float(re.search(r"^passed.*t = ([\d.]+) s by", said, re.M)[1])
    halfway = [row for row in chosen(rows, obstacle="singular state", verdict="accepted") if row["kind"] != "crossing"]
    assert chosen(rows, kind="crossing", verdict="error") and len(halfway) == 1
    assert abs(float(halfway[0]["h"]) / (t - float(halfway[0]["t"])) - 0.5) < 0.01, halfway


def test_step_that_ends_before_its_kink(tmp_path):
    """An attempt too long for its error has passed a kink. The next one ends where it was seen, and the kink is still ahead."""
    rows, _ = steps(tmp_path, SCENES / "friction" / "belt.lua", "--until", 0.0186, "--method", "rk54", "--tol", 5.74e-5)
    first, second, third = rows[:3]
    assert (first["verdict"], first["obstacle"], second["verdict"], second["obstacle"]) == ("error", "kink", "accepted", "kink"), rows
    assert float(second["h"]) < float(first["h"]) and third["kind"] == "ordinary"


@pytest.mark.parametrize("method", ["rk8", "gauss12"])
def test_fading(method, tmp_path):
    rows, said = steps(tmp_path, SCENES / "rows_in_time.lua", "--until", 0.8, "--set", "weight=ramp", "--method", method)
    faded = chosen(rows, kind="fading", verdict="accepted", obstacle="fading rows", method="gauss12")
    assert len(faded) == 1 and 0 < float(faded[0]["error"]) <= 2 and int(faded[0]["iterations"]) > 0
    after = rows[rows.index(faded[0]) + 1]
    assert (int(faded[0]["rank"]), int(after["rank"]), after["method"]) == (2, 1, method), rows
    assert not list(wrong_with(rows, said))


def test_trials(tmp_path):
    """auto begins with a trial of each of two methods on a stiff model, and a named method with none."""
    rows, said = steps(tmp_path, MODELS / "slidercrank.lua", "--until", 0.5)
    used = collections.Counter(row["method"] for row in chosen(rows, verdict="accepted"))
    chose = {name: int(count) for name, count in re.findall(r"(\w+) for (\d+) step", re.search(r"^chosen.*?;", said, re.M)[0])}
    assert used == chose and chosen(rows, kind="trial")
    rows, _ = steps(tmp_path, MODELS / "slidercrank.lua", "--until", 0.5, "--method", "radau9")
    assert not chosen(rows, kind="trial") and chosen(rows, kind="ordinary")


def test_jump_that_is_crossed(tmp_path):
    """Forces that turn with both velocities: the motion rests where two jumps meet."""
    (tmp_path / "spiral.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "spiral", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "x, z", mass = 1, start = { z = 6.7e-14 } } },
  forces = function(s)
    local x, z = s.qd.a_x, s.qd.a_z
    return { a_z = 451.4 * rd.where(rd.less(0, x), 1, -1) - 90.3 * rd.where(rd.less(0, z), 1, -1),
             a_x = -451.4 * rd.where(rd.less(z, 0), -1, 1) - 90.3 * rd.where(rd.less(x, 0), -1, 1) }
  end }
""")
    rows, said = steps(tmp_path, tmp_path / "spiral.lua", "--until", 0.2, "--method", "radau9", status=3)
    crossed = chosen(rows, verdict=UNTAKEN)
    assert crossed and not list(wrong_with(rows, said))
    assert all((row["h"], row["obstacle"], row["error"]) == ("0", "kink", "") for row in crossed)


# ---- The option ----

@pytest.mark.parametrize("more", [[], ["--verify"], ["--derivatives", "a"], ["--from", "initial", "--stop", "energy>1e9"]], ids=str)
def test_rows_are_those_of_the_motion(more, tmp_path):
    """Without the option and with other motions beside it, the motion is the same to the bit."""
    refdyn("sim", MODELS / "fourbar.lua", "--until", 0.4, "-o", tmp_path / "alone.csv")
    alone, _ = steps(tmp_path, MODELS / "fourbar.lua", "--until", 0.4)
    assert (tmp_path / "run.csv").read_text() == (tmp_path / "alone.csv").read_text()
    rows, said = steps(tmp_path, MODELS / "fourbar.lua", "--until", 0.4, *more)
    assert rows == alone and not list(wrong_with(rows, said))


@pytest.mark.parametrize("lanes", [1, 4])
def test_case_of_a_batch(lanes, tmp_path):
    """A case computed again shows its steps, also those of lanes, without a change of its numbers."""
    (tmp_path / "cases.csv").write_text("a\n" + "".join(f"{0.2 + 0.01 * i}\n" for i in range(8)))
    runs = tmp_path / "runs.h5"
    refdyn("batch", MODELS / "fourbar.lua", "--table", tmp_path / "cases.csv", "--until", 0.4, "--method", "rk8", "--lanes", lanes, "-o", runs)
    refdyn("sim", "--case", 3, "--of", runs, "-o", tmp_path / "alone.csv")
    refdyn("sim", "--case", 3, "--of", runs, "-o", tmp_path / "run.csv", "--steps", tmp_path / "steps.csv")
    assert (tmp_path / "run.csv").read_text() == (tmp_path / "alone.csv").read_text()
    with open(tmp_path / "steps.csv", newline="") as file:
        rows = chosen(list(csv.DictReader(file)), verdict="accepted")
    assert abs(end(rows[-1]) - 0.4) < 1e-12 and all(abs(end(a) - float(b["t"])) < 1e-12 for a, b in zip(rows, rows[1:]))
    assert all(float(row["error"]) <= 1 for row in rows)


@pytest.mark.parametrize("arguments, fact", [
    (["--steps", "s.h5"], "--steps s.h5: attempts are written as CSV only; use a name .csv"),
    (["--steps", "s.json"], "--steps s.json: attempts are written as CSV only; use a name .csv"),
    (["--steps", "s.csv", "--accuracy", 1e-3], "--steps excludes --accuracy, which computes several motions; use --tol"),
    (["--steps", "s.csv", "--method", "msbdf"], "--steps: msbdf does not report its attempts; use one of auto, rk4"),
    (["--steps", "s.csv", "--realise"], "--realise excludes --steps"),
])
@pytest.mark.quick
def test_refusals(arguments, fact, tmp_path):
    done = refdyn("sim", SCENES / "double_pendulum.lua", "--until", 0.1, "-o", tmp_path / "run.csv", *arguments, status=2, cwd=tmp_path)
    if "msbdf" in arguments and "needs GSL" in done.stderr:
        pytest.skip("a program without GSL")
    assert fact in done.stderr and not list(tmp_path.iterdir()), done.stderr


@pytest.mark.quick
def test_files(tmp_path):
    """The file differs from all others, is complete or not there, and may be a pipe or stdout."""
    model, run = SCENES / "double_pendulum.lua", tmp_path / "run.csv"
    done = refdyn("sim", model, "--until", 0.1, "-o", run, "--steps", run, status=1)
    assert "run.csv" in done.stderr and not run.exists()
    done = refdyn("sim", model, "--until", 0.1, "-o", run, "--steps", "/dev/stdout")
    assert done.stdout.startswith("t,h,method,") and ",accepted,,bound," in done.stdout
    done = refdyn("sim", model, "--until", 0.1, "-o", run, "--steps", "/dev/full", status=1)
    assert "/dev/full" in done.stderr
    done = refdyn("sim", model, "--until", 0.1, "--stop", "nothing<0", "-o", tmp_path / "other.csv", "--steps", tmp_path / "steps.csv", status=2)
    assert not (tmp_path / "steps.csv").exists() and not list(tmp_path.glob("*.part"))


@pytest.mark.quick
def test_other_commands_lack_it(tmp_path):
    for command in "batch", "statics", "fit":
        done = refdyn(command, SCENES / "double_pendulum.lua", "--steps", tmp_path / "s.csv", status=2)
        assert f"refdyn {command}: unknown option --steps" in done.stderr


@pytest.mark.quick
def test_page_has_all_names(tmp_path):
    """The tables of the page are those of the header, in its order; the first one has the columns of the file."""
    page, header = (SOURCE / "docs" / "commands.md").read_text(), (SOURCE / "runtime" / "refdyn.h").read_text()
    section = page.split("### Attempted steps\n")[1].split("\n### ")[0]
    tables = [re.findall(r"^\| ((?:`[^`]+` ?)+)\|", table, re.M) for table in (text.split("\n\n")[0] for text in section.split("\n|---|---|\n")[1:])]
    names = [[name for cell in table for name in re.findall(r"`([^`]+)`", cell)] for table in tables]
    steps(tmp_path, SCENES / "double_pendulum.lua", "--until", 0.1)
    lists = [re.findall(r'REFDYN_ENTRY\(\w+, "([^"]+)"\)', re.search(rf"#define {name}\(.*?\n\n", header, re.S)[0])
             for name in ("REFDYN_STEP_KINDS", "REFDYN_VERDICTS", "REFDYN_OBSTACLES")]
    assert names[0] == (tmp_path / "steps.csv").read_text().splitlines()[0].split(",")
    assert [table[:len(known)] for table, known in zip(names[1:], lists)] == lists and all(map(len, lists))
