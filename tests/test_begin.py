"""First steps of a new user: `refdyn new`, completion, the manual page, a project of five lines, also for another machine, the shared library."""
import json
import os
import re
import shlex
import shutil
import subprocess

import pytest

from program import BUILD, LONG, MODELS, REFDYN, SOURCE, VERSION, refdyn

PAGE = (SOURCE / "docs" / "beginning.md").read_text()
SONAME = "librefdyn.so." + VERSION.rpartition(".")[0]
EDITOR = "share/refdyn/models/editor"
JOBS = str(os.cpu_count())


def run(*words, status=0, env=None, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, env={**os.environ, **(env or {})}, timeout=500, **options)
    assert status is None or done.returncode == status, f"{words}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """An installation for /usr, below a DESTDIR, that was moved: no file in it may contain its first location."""
    folder = tmp_path_factory.mktemp("begin")
    run("cmake", "--install", BUILD, "--prefix", "/usr", env={"DESTDIR": folder / "first"})
    (folder / "first" / "usr").rename(folder / "a prefix")
    return folder / "a prefix"


# ---- refdyn new ----

@pytest.fixture
def arm(tmp_path):
    refdyn("new", "arm", cwd=tmp_path)
    return tmp_path


def test_new_model_is_good(arm):
    """All commands in its comments run; the load keeps its height, the motor its rate."""
    text = (arm / "arm.lua").read_text()
    proposed = [words.split() for words in re.findall(r"^--   .*:  +refdyn (.*)$", text, re.M)]
    assert [words[0] for words in proposed] == ["check", "statics", "modes", "sim", "plot", "view", "view", "gen"]
    for words in proposed:
        done = refdyn(*words, cwd=arm)
        assert "warning" not in done.stderr, done.stderr
    rows = [list(map(float, line.split(","))) for line in (arm / "arm.csv").read_text().splitlines()[1:]]
    header = (arm / "arm.csv").read_text().splitlines()[0].split(",")
    height, rate = header.index("tip_z"), header.index("upper_psi_d")
    assert all(abs(row[height] - rows[0][height]) < 1e-9 for row in rows)
    assert abs(rows[-1][rate] - 0.4) < 1e-9
    (arm / "push.csv").write_text("t,push\n0,0\n0.5,5\n1,0\n")
    refdyn("sim", "arm.lua", "--set", "elements=2", "--set", "m_load=0.5", "--inputs", "push.csv", "--until", 1, "-o", "push-run.csv", cwd=arm)
    assert max(map(len, text.splitlines())) <= 120


def test_new_settings_lead_to_the_editor_file(arm, prefix, tmp_path_factory):
    folder = tmp_path_factory.mktemp("installed")
    run(prefix / "bin" / "refdyn", "new", "crane", cwd=folder)
    for where, expected in ((arm, BUILD / EDITOR), (folder, prefix / EDITOR)):
        settings = json.loads((where / ".luarc.json").read_text())
        assert settings == {"runtime.version": "Lua 5.4", "workspace.library": [str(expected)]}
        assert (expected / "refdyn.lua").read_text() == (MODELS / "editor" / "refdyn.lua").read_text()


@pytest.mark.quick
def test_new_overwrites_nothing(arm):
    (arm / ".luarc.json").write_text("mine")
    (arm / "dangling.lua").symlink_to("nowhere")
    before = (arm / "arm.lua").read_text()
    for name in ("arm", "dangling"):
        done = refdyn("new", name, cwd=arm, status=1)
        assert (done.stdout, done.stderr) == ("", f"{name}.lua: output: it is there already, and stays as it is\n")
    done = refdyn("new", "second", cwd=arm)
    assert done.stdout == ("second.lua: a small arm with a flexible link, its comments say what to try\n"
                           ".luarc.json: it was there, and stays as it is\n")
    assert (arm / "arm.lua").read_text() == before and (arm / ".luarc.json").read_text() == "mine"
    assert not (arm / "nowhere").exists()
    assert refdyn("check", "second.lua", cwd=arm).stdout.startswith("second: ")


IDENTIFIER = "not an identifier of C; use a letter, then letters, digits and _"
BAD_NAMES = {
    "my arm": f'model "my arm": {IDENTIFIER}', "3dof": f'model "3dof": {IDENTIFIER}', "a\tb": f'model "a\\x09b": {IDENTIFIER}',
    "int": "model int: a reserved word of C or C++; choose another name",
    "math": "model math: math.h is a header of the system; choose another name",
    "folder/arm": "'folder/arm' is a path; give only the model's name, whose file goes into this folder",
    "arm.lua": "'arm.lua' is the name of a file; give the name of the model, without .lua",
    "": "NAME is an empty text",
}


@pytest.mark.parametrize("name", BAD_NAMES)
def test_new_refuses_names(name, tmp_path):
    done = refdyn("new", name, cwd=tmp_path, status=2)
    assert done.stderr.splitlines() == [f"refdyn new: {BAD_NAMES[name]}", "usage: refdyn new NAME"]
    assert not list(tmp_path.iterdir())


def test_new_takes_one_name(tmp_path):
    for words, fault in ((["a", "b"], "unexpected operand 'b'; give only NAME"), ([], "NAME is missing")):
        assert refdyn("new", *words, cwd=tmp_path, status=2).stderr.startswith(f"refdyn new: {fault}\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_new_in_a_folder_that_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    assert refdyn("new", "arm", cwd=tmp_path, status=1).stderr == "arm.lua: output: cannot be made: Permission denied\n"


# ---- completion and the manual page ----

def help_of(command):
    """Names and arguments of its options."""
    return re.findall(r"^  (?:-o, )?--(\S+) ?(\S*)", refdyn(command, "--help").stdout, re.M)


COMMANDS = re.findall(r"^  (\w+) ", refdyn("--help").stdout, re.M)


def completions(folder, *lines):
    """Completions by bash's function for command lines, each a list of words whose last word is completed."""
    asked = "".join("COMP_WORDS=({}); COMP_CWORD={}; _refdyn; printf '%s\\n' \"${{COMPREPLY[@]}}\"; echo =\n".format(
        " ".join(f"'{word}'" for word in line), len(line) - 1) for line in lines)
    script = f'set -u; source <("{REFDYN}" completion bash)\n{asked}'
    answers = run("bash", "--norc", "-c", script, cwd=folder).split("=\n")[:-1]
    return [sorted(filter(None, answer.splitlines())) for answer in answers]


@pytest.mark.quick
def test_bash_completes_commands_and_options(tmp_path):
    lines = [["refdyn", ""], *(["refdyn", command, "--"] for command in COMMANDS)]
    commands, *options = completions(tmp_path, *lines)
    assert commands == sorted([*COMMANDS, "--help", "--version"])
    for command, found in zip(COMMANDS, options):
        assert found == sorted(f"--{name}" for name, _ in help_of(command)), command


def test_bash_completes_words_and_files(tmp_path):
    for name in ("arm.lua", "long name.lua", "run.csv", "runs.h5", "state.json", "robot.urdf", "rule.d"):
        (tmp_path / name).touch()
    (tmp_path / "folder").mkdir()
    cases = {
        ("sim", "arm.lua", "--method", "ra"): ["radau9"],
        ("sim", "arm.lua", "--method", "=", "rod"): ["rodas5p", "rodas6p"],
        ("sim", "arm.lua", "--stabilise", "="): ["baumgarte", "baumgarte-auto", "none", "project"],
        ("gen", "arm.lua", "--emit", "M,qdd_"): ["M,qdd_free"],
        ("gen", "arm.lua", "--emit", "M,st"): ["M,start", "M,step", "M,step.p"],
        ("gen", "--explain", "s"): ["sums"],
        ("export", "arm.lua", "--fmu", ""): ["2.0", "3.0"],
        ("export", "arm.lua", "--platform", "linux64,"): ["linux64,linux64", "linux64,win64"],
        ("plot", "run.csv", "--panel", "energy,tor"): ["energy,torques", "energy,torsion"],
        ("statics", "arm.lua", "--way", ""): ["downhill", "load", "path"],
        ("completion", ""): ["bash", "fish", "man", "zsh"],
        ("sim", ""): ["arm.lua", "folder", "long name.lua"],
        ("sim", "lo"): ["long name.lua"],
        ("sim", "arm.lua", "--from", ""): ["folder", "initial", "state.json", "statics"],
        ("plot", ""): ["folder", "run.csv", "runs.h5"],
        ("merge", "r"): ["runs.h5"],
        ("import", "r"): ["robot.urdf"],
        ("gen", "arm.lua", "-o", ""): ["folder"],
        ("gen", "arm.lua", "--depfile", "r"): ["rule.d"],
        ("check", "-o", "r"): [],
        ("new", ""): [],
        ("sim", "arm.lua", "--until", ""): [],
        ("nothing", ""): [],
    }
    found = completions(tmp_path, *(["refdyn", *words] for words in cases))
    assert dict(zip(cases, found)) == cases


TAKEN = {"method": "sim", "stabilise": "sim", "start": "sim", "singular": "sim", "way": "sim", "accelerations": "gen", "loops": "gen",
         "fmu": "export", "platform": "export"}


@pytest.mark.parametrize("option", TAKEN)
def test_words_are_those_that_are_taken(option, tmp_path):
    command = TAKEN[option]
    words, = completions(tmp_path, ["refdyn", command, f"--{option}", ""])
    extra = {"way": ["--from", "statics"], "platform": ["--fmu", "2.0"]}.get(option, []) + (["--until", "1"] if command == "sim" else [])
    said = refdyn(command, MODELS / "pendulum.lua", "-o", tmp_path / "out.csv", *extra, f"--{option}", "nothing", status=2).stderr.splitlines()[0]
    assert said.startswith(f"refdyn {command}: --{option}: 'nothing' is not one of ")
    taken = set(said.split(" is not one of ")[1].split(", "))
    assert taken <= set(words) and set(words) - taken <= {"msbdf", "bsimp"}


def test_quantities_are_those_that_are_taken(tmp_path):
    words, = completions(tmp_path, ["refdyn", "gen", "arm.lua", "--emit", ""])
    assert {"all", "implicit", "step", "step.p", "M", "qdd"} <= set(words)
    refdyn("gen", MODELS / "planar.lua", "--set", "n_rfe=2", "--emit", ",".join(sorted(set(words) - {"all", "step"})), "-o", tmp_path / "out")


@pytest.mark.skipif(not shutil.which("fish"), reason="fish is not installed")
def test_fish_completes(tmp_path):
    for name in ("arm.lua", "long name.lua", "run.csv"):
        (tmp_path / name).touch()
    (tmp_path / "a folder").mkdir()
    (tmp_path / "a folder" / "crane.lua").touch()
    cases = {
        "refdyn sim ": ["a folder/", "arm.lua", "long name.lua"],
        "refdyn sim a\\ folder/": ["a folder/crane.lua"],
        "refdyn sim arm.lua --from=st": ["--from=statics"],
        "refdyn view run.csv --model=a": ["--model=a folder/", "--model=arm.lua"],
        "refdyn view ": ["a folder/", "run.csv"],
        "refdyn gen --emit M,qdd_": ["M,qdd_free"],
        "refdyn export --fmu ": ["2.0", "3.0"],
        "refdyn new ": [],
    }
    refdyn("completion", "fish", "-o", tmp_path / "refdyn.fish")
    asked = "".join(f"complete -C {shlex.quote(line)}; echo =\n" for line in cases)
    script = f"source refdyn.fish\n{asked}"
    answers = run("fish", "--no-config", "-c", script, cwd=tmp_path, env={"HOME": str(tmp_path)}).split("=\n")[:-1]
    found = [[line.split("\t")[0] for line in answer.splitlines()] for answer in answers]
    assert dict(zip(cases, found)) == cases


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_syntax_of_other_shells(shell, tmp_path):
    script = refdyn("completion", shell).stdout
    for command in COMMANDS:
        for name, argument in help_of(command):
            written = f"-l {name} " if shell == "fish" else f"--{name}{'=' if argument else ''}"
            assert written in script, f"{command} --{name}"
    assert not re.search(r"\*\.\(\w+\)", script), "zsh takes brackets around one ending for qualifiers"
    if shutil.which(shell):
        (tmp_path / "script").write_text(script)
        assert run(shell, "-n", tmp_path / "script") == ""


def test_manual_page(tmp_path):
    page = tmp_path / "refdyn.1"
    refdyn("completion", "man", "-o", page, env={"SOURCE_DATE_EPOCH": "86400"})
    text = page.read_text()
    assert ".TH REFDYN 1 1970-01-02 " in text
    for command in COMMANDS:
        section = text.split(f"\n.SS {command}\n")[1].split("\n.SS ")[0].replace("\\-", "-")
        for name, argument in help_of(command):
            assert re.search(rf"^\.TP\n\\fB(-o, )?--{name}\\fR{' ' if argument else '$'}", section, re.M), f"{command} --{name}"
    if shutil.which("mandoc"):
        assert run("mandoc", "-T", "lint", page) == ""
    if shutil.which("man"):
        done = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, env={**os.environ, "MANWIDTH": "100", "LC_ALL": "C.UTF-8"})
        assert done.returncode == 0 and done.stderr == "" and "refdyn sim MODEL.lua --until T [options]" in done.stdout


def test_completion_refuses_other_forms():
    done = refdyn("completion", "csh", status=2)
    assert done.stderr.splitlines()[0] == "refdyn completion: 'csh' is not one of bash|zsh|fish|man"


def test_installed_files(prefix):
    share = prefix / "share"
    for form, file in (("bash", "bash-completion/completions/refdyn"), ("zsh", "zsh/site-functions/_refdyn"),
                       ("fish", "fish/vendor_completions.d/refdyn.fish")):
        assert (share / file).read_text() == refdyn("completion", form).stdout
    assert (share / "man/man1/refdyn.1").read_text().startswith(".\\\"")
    installed = {path.name for path in (share / "refdyn" / "models").rglob("*.lua")}
    assert installed == {path.name for path in MODELS.rglob("*.lua")}
    assert run(prefix / "bin" / "refdyn", "check", share / "refdyn" / "models" / "fourbar.lua").startswith("fourbar: ")


# ---- a rule of make ----

def test_depfile(tmp_path):
    (tmp_path / "a b").mkdir()
    (tmp_path / "a b" / "parts.lua").write_text('return { { "cart", joint = "x", mass = 2, spring = { x = 3 } } }\n')
    model = tmp_path / "a b" / "model.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "cart", links = require "parts" }\n')
    refdyn("gen", model, "-o", tmp_path / "out", "--depfile", tmp_path / "cart.d")
    escaped = str(tmp_path / "a b").replace(" ", "\\ ")
    assert (tmp_path / "cart.d").read_text() == f"{tmp_path}/out/cart.h {tmp_path}/out/cart.c: {escaped}/model.lua {escaped}/parts.lua\n"
    done = refdyn("gen", model, "-o", tmp_path / "out", "--depfile", model, status=1)
    assert done.stderr.startswith(f"{model}: output: ")
    assert "rd.model" in model.read_text()
    assert "leave out --depfile" in refdyn("gen", model, "--explain", "sums", "--depfile", tmp_path / "x.d", status=2).stderr


# ---- a user's own project ----

def block(language):
    return re.search(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S).group(1)


@pytest.fixture
def project(arm):
    (arm / "CMakeLists.txt").write_text(block("cmake"))
    (arm / "main.c").write_text(block("c"))
    return arm


def configure(project, prefix, *words, **options):
    return run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}", *words, **options)


def build(project, **options):
    return run("cmake", "--build", project / "build", "--parallel", JOBS, **options)


def test_project_of_the_page(project, prefix):
    """It builds, follows changes of the model, and reports errors in it."""
    configure(project, prefix)
    build(project)
    coordinates, energy = re.match(r"(\d+) coordinates, potential energy (\S+) J: done", run(project / "build" / "mine")).groups()
    expected = json.loads(refdyn("eval", "arm.lua", "--set", "m_load=0.3", cwd=project).stdout)
    assert int(coordinates) == len(expected["coordinates"])
    assert abs(float(energy) - expected["energy"]["potential"]) < 1e-8
    assert "Building" not in build(project)
    model = project / "arm.lua"
    good = model.read_text()
    model.write_text(good.replace('"elements", 4', '"elements", 7'))
    build(project)
    assert run(project / "build" / "mine").startswith("8 coordinates")
    model.write_text(good.replace("links = {", "link = {"))
    said = build(project, status=None)
    assert f'{project}/arm.lua:{good[:good.index("links = {")].count(chr(10)) + 1}: link: unknown field; did you mean "links"?' in said
    model.write_text(good)
    build(project)
    assert run(project / "build" / "mine").startswith("5 coordinates")


def test_project_with_options(project, prefix):
    """Several models, also in one target, options of gen, a required file, lanes, a shared library; changed comments leave the objects
    unchanged."""
    (project / "links.lua").write_text('return { { "cart", joint = "x", mass = 2, spring = { x = 3 } } }\n')
    (project / "cart.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "cart", links = require "links" }\n')
    twin = project / "twin" / "arm.lua"
    twin.parent.mkdir()
    twin.write_text((project / "arm.lua").read_text().replace('name = "arm"', 'name = "twin"'))
    (project / "CMakeLists.txt").write_text("""cmake_minimum_required(VERSION 3.25)
project(mine LANGUAGES C)
find_package(refdyn REQUIRED)
refdyn_generate(flexible arm.lua SET elements=3 m_load=1.25 programme=false EMIT M h Q LANES ACCELERATIONS dense)
add_executable(mine main.c)
target_link_libraries(mine flexible refdyn::shared)
refdyn_generate(mine cart.lua EMIT M FOLD LOOPS never)
refdyn_generate(mine twin/arm.lua SET elements=2 LANES)
refdyn_generate(mine arm.lua SET elements=6 EMIT M NAME long_arm)
""")
    (project / "main.c").write_text("""#include "arm.h"
#include "arm_lanes.h"
#include "cart.h"
#include "long_arm.h"
#include "twin.h"
#include "twin_lanes.h"
#include <refdyn_batch.h>
#include <stdio.h>
int main(void) {
    struct arm_parameters p;
    arm_defaults(&p);
    printf("%d %g %d %d %d %d %d\\n", arm_n, p.m_load, cart_n, twin_n, long_arm_model.n, arm_model.qdd == NULL,
           refdyn_batch_widest() > 0 && arm_lanes_2.width == 2 && twin_lanes_8.width == 8);
    return 0;
}
""")
    configure(project, prefix, "-DBUILD_SHARED_LIBS=ON", "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror")
    build(project)
    assert run(project / "build" / "mine") == "4 1.25 1 3 7 1 1\n"
    assert {path.name for path in (project / "build").glob("lib*.so")} == {"libflexible.so"}
    links = project / "links.lua"
    links.write_text("-- as before\n" + links.read_text())
    said = build(project)
    assert "Configuring done" in said and "Building" not in said
    links.write_text(links.read_text().replace('joint = "x"', 'joint = "x, y"'))
    build(project)
    assert run(project / "build" / "mine") == "4 1.25 2 3 7 1 1\n"
    twin.write_text(twin.read_text().replace('name = "twin"', 'name = "cart"'))
    said = re.sub(r"\s+", " ", build(project, status=None))
    assert "refdyn_generate(mine): two models of one name write cart.h; each model of a target needs its own name, for instance by NAME" in said


def test_project_in_single_precision(project, prefix):
    """Nothing of the runtime is linked, as on a microcontroller."""
    (project / "CMakeLists.txt").write_text("""cmake_minimum_required(VERSION 3.25)
project(mine LANGUAGES C)
find_package(refdyn REQUIRED)
refdyn_generate(mine arm.lua REAL float EMIT energy SET m_load=1.25)
get_target_property(linked mine LINK_LIBRARIES)
message(STATUS "links ${linked}")
add_executable(user main.c)
target_link_libraries(user mine m)
""")
    (project / "main.c").write_text("""#include "arm.h"
#include <stdio.h>
int main(void) {
    struct arm_parameters p;
    arm_defaults(&p);
    printf("%g %zu\\n", p.m_load, sizeof p.m_load);
    return 0;
}
""")
    assert "links linked-NOTFOUND" in configure(project, prefix)
    build(project)
    assert run(project / "build" / "user") == "1.25 4\n"


# ---- a project for another machine ----

ARM_FILES = SOURCE / "tests" / "arm"
needs_arm = pytest.mark.skipif(not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")), reason="Arm's compiler and QEMU are not installed")
PRINTS_ENERGY = """#include "arm.h"
#include <stdio.h>
int main(void) {
    REAL state[2 * arm_n], energy[2];
    struct arm_parameters p;
    struct arm_inputs x = {0};
    arm_defaults(&p);
    arm_start(&p, &x, 0, NULL, NULL, state);
    arm_energy(&p, &x, 0, state, state + arm_n, energy);
    printf("%d %.9g %d\\n", arm_n, (double)energy[1], (int)sizeof p.m_load);
    return 0;
}
"""


def cross_project(project, lines, program):
    project.mkdir(exist_ok=True)
    (project / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(mine LANGUAGES C)\n" + lines)
    (project / "main.c").write_text(program)


def cross_configure(project, *words, **options):
    return run("cmake", "-S", project, "-B", project / "build", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_TOOLCHAIN_FILE={ARM_FILES / 'cortex_m4.cmake'}", *words,
               **options)


def emulate(program):
    return run("qemu-system-arm", "-M", "mps2-an386", "-nographic", "-semihosting", "-kernel", program)


@needs_arm
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("where", ["installed", "sources"])
def test_project_for_a_microcontroller(where, real, project, prefix):
    """The installed libraries are for this machine; the emitted C is for the other one. The sources compile no program."""
    if (where, real) == ("sources", "double") and not LONG:
        pytest.skip("compiles the core")
    find = "find_package(refdyn REQUIRED)" if where == "installed" else f"add_subdirectory({SOURCE} refdyn)"
    cross_project(project, f"{find}\nadd_executable(mine main.c)\nrefdyn_generate(mine arm.lua REAL {real} EMIT energy start)\ntarget_link_libraries(mine m)\n",
                  PRINTS_ENERGY.replace("REAL", real))
    said = cross_configure(project, f"-DCMAKE_PREFIX_PATH={prefix}" if where == "installed" else f"-DREFDYN_PROGRAM={REFDYN}")
    assert ("refdyn: the libraries are for " in said) == (where == "installed"), said
    build(project)
    coordinates, energy, size = emulate(project / "build" / "mine").split()
    expected = json.loads(refdyn("eval", "arm.lua", cwd=project).stdout)
    assert (int(coordinates), int(size)) == (len(expected["coordinates"]), {"float": 4, "double": 8}[real])
    assert abs(float(energy) / expected["energy"]["potential"] - 1) < {"float": 1e-5, "double": 1e-8}[real]


@needs_arm
def test_libraries_for_another_machine_are_refused(project, prefix):
    for lines, message in (("target_link_libraries(mine refdyn::runtime)", "but the target was not found"),
                           ("refdyn_generate(mine arm.lua LANES)", "LANES: needs refdyn::batch, which does not exist for Generic cortex-m4; leave out LANES")):
        cross_project(project, f"find_package(refdyn REQUIRED)\nadd_executable(mine main.c)\n{lines}\n", PRINTS_ENERGY)
        assert message in re.sub(r"\s+", " ", cross_configure(project, f"-DCMAKE_PREFIX_PATH={prefix}", status=1))


PRINTS_MOTION = """#include "arm.h"
#include <refdyn.h>
#include <stdio.h>
#include <stdlib.h>
int main(void) {
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    const size_t work_size = refdyn_workspace_size(&arm_model), integrator_size = refdyn_integrator_size(&arm_model, &options);
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double q[arm_n], qd[arm_n];
    if (refdyn_workspace_init(&work, &arm_model, malloc(work_size), work_size) ||
        refdyn_integrator_init(&integrator, &work, &options, malloc(integrator_size), integrator_size))
        return 1;
    refdyn_initial_state(&work, q, qd);
    refdyn_anchor(&work, 0, q, qd, NULL);
    if (refdyn_integrator_start(&integrator, 0, q, qd) || refdyn_integrator_to(&integrator, 0.05))
        return 1;
    for (int i = 0; i < arm_n; i++)
        printf("%.16g\\n", integrator.q[i]);
    return 0;
}
"""


@needs_arm
@pytest.mark.skipif(not LONG, reason="compiles the core")
def test_a_motion_on_a_microcontroller(project):
    """Motions of the core, compiled from the sources for a Cortex-M4 and for this machine, agree to rounding."""
    cross_project(project, f"add_subdirectory({SOURCE} refdyn)\nadd_executable(mine main.c)\nrefdyn_generate(mine arm.lua)\ntarget_link_libraries(mine m)\n",
                  PRINTS_MOTION)
    cross_configure(project, f"-DREFDYN_PROGRAM={REFDYN}")
    build(project)
    run("cmake", "-S", project, "-B", project / "host", "-DCMAKE_BUILD_TYPE=Release", f"-DREFDYN_PROGRAM={REFDYN}")
    run("cmake", "--build", project / "host", "--parallel", JOBS)
    states = [[float(line) for line in said.split()] for said in (emulate(project / "build" / "mine"), run(project / "host" / "mine"))]
    assert len(states[0]) == 5 and max(map(abs, states[0])) > 0.1
    assert all(abs(a - b) < 1e-12 for a, b in zip(*states)), states


WRONG_CALLS = {
    "arm arm.lua": "the project has to enable C: project(... LANGUAGES C ...)",
    "arm arm.lua LANE m=1": "LANE, m=1: unknown; known are SET NAME=VALUE ..., EMIT QUANTITY ..., LANES, FOLD, ACCELERATIONS HOW, LOOPS WHEN, REAL TYPE, NAME NAME",
    "arm arm.lua SET": "SET: the value is missing",
    "arm arm.lua FOLD REAL": "REAL: the value is missing",
    "arm arm.lua REAL ${nothing} FOLD": "REAL: the value is missing",
    'arm arm.lua REAL "${nothing}"': "argument 4 is an empty text; does a variable have no value?",
    'arm ""': "argument 2 is an empty text; does a variable have no value?",
}


@pytest.mark.parametrize("words", WRONG_CALLS)
def test_wrong_calls(words, tmp_path):
    (tmp_path / "call.cmake").write_text(f'include("{SOURCE}/runtime/generate.cmake")\nrefdyn_generate({words})\n')
    said = re.sub(r"\s+", " ", run("cmake", "-P", tmp_path / "call.cmake", status=1))
    assert f"refdyn_generate(arm): {WRONG_CALLS[words]}" in said


@pytest.mark.skipif(not LONG, reason="builds the program")
def test_project_with_the_sources(project):
    text = (project / "CMakeLists.txt").read_text().replace("find_package(refdyn REQUIRED)", f"add_subdirectory({SOURCE} refdyn)")
    (project / "CMakeLists.txt").write_text(text)
    run("cmake", "-S", project, "-B", project / "build")
    build(project)
    assert run(project / "build" / "mine").startswith("5 coordinates")
    assert not list((project / "build" / "refdyn").glob("librefdyn.so*")), "what nothing links is not built"


# ---- the shared library ----

def declared():
    """Functions of the public headers."""
    text = "".join((SOURCE / "runtime" / name).read_text() for name in ("refdyn.h", "batch/refdyn_batch.h"))
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    return set(re.findall(r"^(?!typedef)[a-z][\w *]*?\b(refdyn_\w+)\((?!\*)", text, re.M))


def test_shared_library_shows_what_is_declared(prefix):
    library = prefix / "lib" / "librefdyn.so"
    listing = run("nm", "-D", "--defined-only", library)
    shown = {line.split()[2] for line in listing.splitlines()}
    assert shown == declared() and len(shown) > 50
    assert f"{SONAME}]" in run("readelf", "-d", library)
    assert os.readlink(library) == SONAME and os.readlink(prefix / "lib" / SONAME) == f"librefdyn.so.{VERSION}"


def test_shared_library_by_pkg_config(prefix, tmp_path):
    (tmp_path / "user.c").write_text('#include <refdyn_batch.h>\n#include <stdio.h>\nint main(void) { puts(refdyn_method_name(REFDYN_RK8)); return refdyn_batch_widest() < 1; }\n')
    env = {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig"), "LD_LIBRARY_PATH": str(prefix / "lib")}
    flags = shlex.split(run("pkg-config", "--cflags", "--libs", "refdyn-shared", env=env))
    run("cc", "user.c", *flags, "-o", "user", cwd=tmp_path)
    assert run(tmp_path / "user", env=env) == "rk8\n"
    assert f"{SONAME} " in run("ldd", tmp_path / "user", env=env)
