"""Values that models refuse, endless or damaged files, impossible sweeps, full disks: one clear message each."""
import json
import os
import re
import subprocess

import pytest

from program import BUILD, REFDYN, SOURCE, refdyn
from test_fmi import REFUSALS, REFUSED_MODEL

HEAD = 'local rd = require "refdyn"\n'
LOSING = HEAD + """local p = rd.parameters { { "m", 1, "kg" }, { "b", 1, "m" }, { "step", 1, "m" } }
return rd.model { name = "losing", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "x, z", mass = p.m, start = { z = 1 } },
    { "bar", joint = "psi", bodies = { rd.box { { 1, p.b, 1 / p.b }, mass = 1 } } } },
  events = function(s) return {
    rd.event { s.q.ball_z - 0.5, parameters = { m = p.step - 1.5 }, name = "loses" },
    rd.event { s.q.ball_z - 0.9, parameters = { b = 0.5 }, name = "changes" } } end }
"""
FULL = "/dev/full"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stuck")
    (folder / "refused.lua").write_text(REFUSED_MODEL)
    (folder / "losing.lua").write_text(LOSING)
    os.mkfifo(folder / "pipe.csv")
    return folder


def sweep(folder, fields, **ways):
    """A batch of the model refused.lua."""
    (folder / "sweep.lua").write_text(HEAD + f"return rd.sweep {{ {fields} }}\n")
    return refdyn("batch", "refused.lua", "sweep.lua", "-o", "runs.csv", cwd=folder, timeout=60, **ways)


def rows(path):
    names, *lines = [line.split(",") for line in path.read_text().splitlines()]
    return [dict(zip(names, line)) for line in lines]


# ---- Values that the model refuses ----

@pytest.mark.parametrize("lanes", [1, 4])
@pytest.mark.parametrize("name", REFUSALS)
def test_cases_of_a_batch(folder, name, lanes):
    """One case is refused and not computed, its neighbours are; run alone, it reports the reason."""
    value, words = REFUSALS[name]
    good = {"m": 2, "inner": 0.04, "T": 2, "Ix": 1.5, "c": 0}[name]
    sweep(folder, f"vary = {{ {name} = {{ {good}, {value}, {good} }} }}, t_end = 0.1")
    found = rows(folder / "runs.csv")
    assert [row["status"] for row in found] == ["0", "1", "0"] and found[0]["cart_x"] == found[2]["cart_x"] and found[1]["cart_x"] == ""
    refdyn("batch", "refused.lua", "sweep.lua", "-o", "runs.h5", "--lanes", lanes, cwd=folder)
    said = refdyn("sim", "--case", 1, "--of", "runs.h5", "-o", "case.csv", cwd=folder, status=1).stderr
    assert re.fullmatch(r"refused\.lua:\d+: " + re.escape(words) + ".*\n", said), said


@pytest.mark.parametrize("name", REFUSALS)
def test_states_and_settings(folder, name):
    """Parameters of a state file, and of the command line, in every command that reads them."""
    value, words = REFUSALS[name]
    (folder / "state.json").write_text(json.dumps({"parameters": {name: value}}))
    for command in (["eval", "refused.lua", "--state", "state.json"], ["sim", "refused.lua", "--until", 1, "--from", "state.json"],
                    ["statics", "refused.lua", "--state", "state.json"], ["eval", "refused.lua", "--set", f"{name}={value}"]):
        said = refdyn(*command, cwd=folder, status=1).stderr
        assert words in said, said


def test_events(folder):
    """The motion ends before the event, in `sim`, in each case of a batch, and in one case again; an event that sets allowed values is
    accepted."""
    words = r"loses: losing\.lua:4: links\[1\]\.mass: value -0\.5; must be positive"
    said = refdyn("sim", "losing.lua", "--until", 1, "-o", "run.csv", "--summary", "run.json", cwd=folder, status=3).stderr
    assert re.search("the event " + words, said), said
    (folder / "cases.csv").write_text("step\n1\n3\n1\n")
    refdyn("batch", "losing.lua", "--table", "cases.csv", "--until", 0.5, "-o", "events.csv", cwd=folder)
    found = rows(folder / "events.csv")
    assert [row["status"] for row in found] == ["3", "0", "3"] and 0.31 < float(found[0]["t"]) < 0.32
    refdyn("batch", "losing.lua", "--table", "cases.csv", "--until", 0.5, "-o", "events.h5", cwd=folder)
    said = refdyn("sim", "--case", 0, "--of", "events.h5", "-o", "case.csv", cwd=folder, status=3).stderr
    assert re.search("the event " + words, said) and "/refdyn-" not in said, said


CALLER = r"""
#include "losing.h"
#include "refdyn.h"
#include <stdio.h>
#include <stdlib.h>
static void report(const struct refdyn_workspace *work, int status) {
    double x[REFDYN_REQUIREMENT_NUMBERS];
    printf("%d ", status);
    if (status == REFDYN_REFUSED) {
        const struct refdyn_requirement *needed = &work->model->requirements[work->refused];
        refdyn_refused_numbers(work, x);
        printf("%s: ", needed->subject);
        printf(needed->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
    }
    puts("");
}
int main(void) {
    const struct refdyn_model *model = &losing_model;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct refdyn_statics_result result;
    double q[3], qd[3];
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK8);
    const struct refdyn_statics_options statics = refdyn_statics_default();
    const size_t size = refdyn_workspace_size(model), more = refdyn_integrator_size(model, &options), last = refdyn_statics_size(model);
    void *memory = malloc(size), *room = malloc(more), *rest = malloc(last);
    int held[3] = {0, 1, 2};
    refdyn_workspace_init(&work, model, memory, size);
    refdyn_integrator_init(&integrator, &work, &options, room, more);
    refdyn_initial_state(&work, q, qd);
    refdyn_set_parameter(&work, "m", -2);
    report(&work, refdyn_check_parameters(&work));
    report(&work, refdyn_integrator_start(&integrator, 0, q, qd));
    report(&work, refdyn_statics(&work, &statics, held, 3, q, NULL, &result, rest, last));
    refdyn_set_parameter(&work, "m", 2);
    report(&work, refdyn_integrator_start(&integrator, 0, q, qd));
    refdyn_set_parameter(&work, "b", -1);
    report(&work, refdyn_integrator_refresh(&integrator));
    refdyn_set_parameter(&work, "b", 0); /* 1/b is infinite, too */
    report(&work, refdyn_integrator_refresh(&integrator));
    refdyn_set_parameter(&work, "b", 1);
    report(&work, refdyn_integrator_refresh(&integrator));
    report(&work, refdyn_integrator_to(&integrator, 1));
    free(memory), free(room), free(rest);
    return 0;
}
"""


def test_callers_from_c(folder):
    refdyn("gen", "losing.lua", "-o", "emitted", cwd=folder)
    (folder / "caller.c").write_text(CALLER)
    subprocess.run(["gcc", "-std=c11", "-O0", "-ffp-contract=off", "-I", SOURCE / "runtime", "-I", folder / "emitted", folder / "caller.c", *(folder / "emitted").glob("*.c"),
                    next(BUILD.rglob("librefdyn_runtime.a")), "-lm", "-o", folder / "caller"], check=True)
    found = subprocess.run([folder / "caller"], check=True, capture_output=True, text=True).stdout.splitlines()
    bad = "-19 links[1].mass: value -2; must be positive"
    assert found == [bad, bad, bad, "0 ", "-19 links[2].bodies[1].size[2]: value -1; must be positive",
                     "-19 links[2].bodies[1].size[2]: value 0; must be positive", "0 ",
                     "-19 links[1].mass: value -0.5; must be positive"]


def test_what_is_emitted(folder):
    """Checks of the parameters that are read, and no others; none where parameters are numbers."""
    (folder / "still.lua").write_text(HEAD + """local p = rd.parameters { { "m", 1 }, { "unread", 1 } }
      return rd.model { name = "still", links = { { "a", joint = "x", mass = p.m }, { "wall", mass = p.unread } } }""")
    refdyn("gen", "still.lua", "-o", "still", cwd=folder)
    text = (folder / "still" / "still.c").read_text()
    assert text.count("must be positive") == 1 and "SET(requirement_count) 1," in text
    refdyn("gen", "still.lua", "--fold", "-o", "folded", cwd=folder)
    assert "SET(requirement_count) 0," in (folder / "folded" / "still.c").read_text()


# ---- Files that are read ----

READERS = {"sim, inputs": ["sim", "refused.lua", "--until", 1, "--inputs", "pipe.csv"], "sim, from": ["sim", "refused.lua", "--until", 1, "--from", "pipe.csv"],
           "eval": ["eval", "refused.lua", "--state", "pipe.csv"], "statics": ["statics", "refused.lua", "--state", "pipe.csv"],
           "modes": ["modes", "refused.lua", "--at", "pipe.csv"], "plot": ["plot", "pipe.csv", "-o", "a.svg"],
           "view": ["view", "pipe.csv", "--model", "refused.lua", "-o", "a.html"], "import": ["import", "pipe.csv", "-o", "new.lua"],
           "check": ["check", "pipe.csv"], "table": ["batch", "refused.lua", "--table", "pipe.csv", "--until", 1, "-o", "a.csv"]}


@pytest.mark.parametrize("reader", READERS)
def test_named_pipes(folder, reader):
    """A pipe without a writer: there is nothing to wait for."""
    said = refdyn(*READERS[reader], cwd=folder, status=1, timeout=20).stderr
    assert "pipe" in said, said


@pytest.mark.parametrize("fields", ['vary = { inputs = { "pipe.csv" } }, t_end = 1', 'vary = { m = { 1, 2 } }, t_end = 1, from = "pipe.csv"'])
def test_named_pipes_in_sweeps(folder, fields):
    assert "pipe.csv: " in sweep(folder, fields, status=1).stderr


def test_pipes_of_a_shell(folder):
    """These have a writer."""
    (folder / "samples.csv").write_text("t,x\n0,1\n")
    refdyn("sim", "refused.lua", "--until", 0.1, "-o", "run.csv", cwd=folder)
    done = subprocess.run(["bash", "-c", f"{REFDYN} plot <(cat run.csv) -o shell.svg"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def journal_of(folder):
    """A journal of many cases: the batch ends on a full disk."""
    (folder / "full.h5").unlink(missing_ok=True)
    (folder / "many.lua").write_text(HEAD + "return rd.sweep { vary = { m = rd.grid(1, 2, 64) }, t_end = 0.1 }\n")
    (folder / "full.h5").symlink_to(FULL)
    refdyn("batch", "refused.lua", "many.lua", "-o", "full.h5", cwd=folder, status=1)
    (folder / "full.h5").unlink()
    return folder / "full.h5.journal"


@pytest.mark.parametrize("damage", ["a value", "a length", "two places", "the first record", "the last record", "zeros"])
def test_damaged_journals(folder, damage):
    """Damage is reported and computed again; all good records remain."""
    journal = journal_of(folder)
    content = bytearray(journal.read_bytes())
    record = (len(content) - 400) // 64
    places = {"a value": [len(content) // 2], "a length": [content.find((1).to_bytes(8, "little") + b"", len(content) // 2)],
              "two places": [len(content) // 3, 2 * len(content) // 3], "the first record": [len(content) - 64 * record + 60],
              "the last record": [len(content) - 20], "zeros": range(len(content) // 2, len(content) // 2 + 3 * record)}[damage]
    for place in places:
        content[place] = 0 if damage == "zeros" else content[place] ^ 64
    journal.write_bytes(content)
    said = refdyn("batch", "refused.lua", "many.lua", "-o", "full.h5", "--resume", cwd=folder).stderr
    assert re.search(r"full\.h5\.journal: warning: \d+ bytes are damaged or incomplete; cases that were there are computed again", said), said
    again = int(re.search(r"(\d+) of them computed now", said)[1])
    assert 1 <= again <= (5 if damage == "zeros" else 2), said


# ---- Impossible sweeps ----

SWEEPS = {"vary = { m = { 1 } }, t_end = 1, every = 5": r"sweep\.lua:2: every 5: longer than the motions, which last 1 s",
          "vary = { m = { 1 } }, t_end = 1, every = 1.01, keep = { history = { 'cart_x' } }": "every 1.01: longer than",
          "vary = { m = rd.grid(1, 2, 1e8) }, t_end = 1, cases_max = 1e9": r"sweep\.lua:2: rd\.sweep: 100000000 cases take 1908 MB of memory, more than 512 MB",
          "vary = { m = rd.uniform(1, 2), c = rd.uniform(0, 1) }, draws = 4e7, t_end = 1, cases_max = 1e9": "40000000 cases take 1069 MB",
          "vary = { m = { 1, 2 } }, t_end = 1, derive = function(c) c.m = 5; return { c = 1 } end": r"sweep\.lua:2: derive: case 0: m: the function writes to the values",
          "vary = { m = { 1, 2 } }, t_end = 1, derive = function(c) c.T = 5; return { c = 1 } end": r'derive: "T" is written to the values of a case',
          "vary = { m = { 1, 2 } }, t_end = 1, derive = function(c) c.m = nil; return { c = 1 } end": "case 0: m: the function writes",
          "vary = { m = { 1, 2 } }, t_end = 1, derive = function(c) if c.m > 1 then c.m = c.m + 1 end return { c = c.m } end": "case 1: m: the function writes",
          "vary = { m = { 1, 2 } }, t_end = 1, derive = function(c) rawset(c, 'new', 1); return { c = c.m } end": "case 0: the function writes|rd.rawset|rawset"}


@pytest.mark.parametrize("fields", SWEEPS)
def test_sweeps(folder, fields):
    (folder / "runs.csv").unlink(missing_ok=True)
    said = sweep(folder, fields, status=None)
    assert said.returncode in (1, 2) and re.search(SWEEPS[fields], said.stderr), said.stderr
    assert not (folder / "runs.csv").exists()


def test_sweeps_that_are_meant(folder):
    """As long as the motions; a derive function that only reads."""
    sweep(folder, "vary = { m = { 1, 2 } }, t_end = 0.1, every = 0.1, derive = function(c) local v = c.m; v = v + 1; return { c = v } end")
    assert [row["c"] for row in rows(folder / "runs.csv")] == ["2", "3"]


# ---- Full disks ----

def test_full_disks(folder):
    """Every writer reports it, in one line, with exit status 1."""
    refdyn("sim", "refused.lua", "--until", 0.1, "-o", "run.csv", cwd=folder)
    (folder / "cases.csv").write_text("m\n1\n2\n")
    refdyn("batch", "refused.lua", "--table", "cases.csv", "--until", 0.1, "-o", "drawn.h5", cwd=folder)
    for suffix in ("svg", "png", "html", "csv", "json", "fmu"):
        (folder / f"full.{suffix}").unlink(missing_ok=True)
        (folder / f"full.{suffix}").symlink_to(FULL)
    for command in (["plot", "run.csv", "-o", "full.svg"], ["plot", "drawn.h5", "-o", "full.svg"], ["plot", "run.csv", "run.csv", "-o", "full.png"],
                    ["view", "run.csv", "--model", "refused.lua", "-o", "full.html"], ["check", "refused.lua", "--draw", "full.svg"],
                    ["sim", "refused.lua", "--until", 0.1, "-o", "full.csv"], ["sim", "refused.lua", "--until", 0.1, "-o", "run2.csv", "--summary", "full.json"],
                    ["statics", "refused.lua", "--hold", "cart_x,arm_theta,arm_psi", "-o", "full.json"], ["export", "refused.lua", "--fmu", "2.0", "-o", "full.fmu"]):
        said = refdyn(*command, cwd=folder, status=1).stderr
        assert "No space left on device" in said, (command, said)


# ---- Libraries of other projects ----

def test_shared_library_names_libm(tmp_path):
    subprocess.run(["cmake", "--install", BUILD, "--prefix", tmp_path], check=True, capture_output=True)
    config = next(tmp_path.rglob("refdyn-shared.pc")).parent
    flags = subprocess.run(["pkg-config", "--libs", "refdyn-shared"], check=True, capture_output=True, text=True, env={**os.environ, "PKG_CONFIG_PATH": str(config)}).stdout
    assert "-lrefdyn" in flags.split() and "-lm" in flags.split()


def test_serial_hdf5_is_taken(tmp_path):
    """If `hdf5` is another library, such as OpenMPI's."""
    if subprocess.run(["pkg-config", "--exists", "hdf5-serial"]).returncode:
        pytest.skip("HDF5 has one library here")
    (tmp_path / "hdf5.pc").write_text("Name: HDF5\nDescription: of OpenMPI\nVersion: 9\nCflags: -I/nowhere/openmpi\nLibs: -L/nowhere/openmpi -lhdf5\n")
    subprocess.run(["cmake", "-S", SOURCE, "-B", tmp_path / "b", "-DBUILD_TESTING=OFF"], check=True, capture_output=True,
                   env={**os.environ, "PKG_CONFIG_PATH": str(tmp_path)})
    flags = "".join(path.read_text() for name in ("link.txt", "flags.make") for path in (tmp_path / "b").rglob(name))
    assert "hdf5" in flags and "/nowhere/openmpi" not in flags
