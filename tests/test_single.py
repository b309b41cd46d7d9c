"""`gen --real float`: values and steps compared with double precision, constants, warnings, and code for Arm Cortex-M."""
import ctypes
import re
import shutil
import subprocess

import numpy
import pytest

from program import CORE_SOURCES, LONG, MODELS, REFERENCE, SOURCE, TESTS, all_models, check, close, models_of_tests, refdyn, settings
from random_scenes import damped_scene
from single import ARM, CORES, STRICT, Single, emit_single, error, pointer, real

FUNCTIONS = TESTS / "models" / "functions.lua"
ARM_FILES = TESTS / "arm"
# Rows, inputs, splines, loops over elements, every function of libm.
SCENES = [(REFERENCE, settings({"n_rfe": 2, "drive": "input"})), (MODELS / "puma.lua", []), (FUNCTIONS, []), (TESTS / "models" / "hanging_chain.lua", [])]
DERIVATIVES = "d_qdd,d_qdd_free,d_force,d_rows,tangent,tangent_vectors"
# Multiples of the rounding of floats. Accelerations lose digits with the condition of M and of the rows.
TOLERANCES = {"qdd": 2e-4, "qdd_free": 2e-4, "k": 1e-4, "phi": 1e-4, "psi": 1e-4, "v": 1e-4}
# A pivot of its six rows, of which five are independent, is 5e-5 of its diagonal term.
NEARLY_DEPENDENT = {"bricard": {"qdd": 2e-3}}
needs_qemu = pytest.mark.skipif(not shutil.which("qemu-system-arm"), reason="qemu-system-arm is not installed")
needs_arm = pytest.mark.skipif(not shutil.which(ARM[0]), reason=f"{ARM[0]} is not installed")


def name_of(scene):
    return scene[0].stem


def scenes():
    return SCENES + ([(path, []) for path in all_models()] if LONG else [])


@pytest.mark.parametrize("scene", scenes(), ids=name_of)
def test_values(scene, tmp_path):
    model = Single(scene[0], tmp_path, *scene[1], "--emit", "all,inverse")
    lines, seen = [], 0
    for seed in range(3):
        state = model.state(seed)
        moved = {**state, "qd": numpy.concatenate([state["qd"], numpy.cos(numpy.arange(model.double.n))])}
        for quantity in ("inverse", "M", "h", "Q", "u", "v", "phi", "psi", "k", "r", "rd", "C", "d", "energy", "qdd_free", "qdd"):
            at = moved if quantity == "inverse" else state
            found, exact = model(quantity, at), model.double(quantity, at)
            assert (found is None) == (exact is None), quantity
            if found is None:
                continue
            scale = max(abs(exact).max(), 1e-2)  # residuals are differences of numbers near 1
            lines.append(close(f"{quantity} at state {seed}", found, exact, {**TOLERANCES, **NEARLY_DEPENDENT.get(scene[0].stem, {})}.get(quantity, 2e-5), scale))
            seen += bool((found != exact).any())
    assert seen > 9, "the numbers are doubles"
    check(lines)


def test_steps(tmp_path):
    """With inputs and rows; gauss with its derivatives, where steps of rk4 fail."""
    model = Single(REFERENCE, tmp_path / "rows", *settings({"n_rfe": 1, "drive": "input"}), "--emit", "step,start,M")
    for method in ("rk4", "gauss"):
        assert error(*model.steps(model.double.start, 1e-3, 500, method)) < 1e-4
    stiff = Single(MODELS / "pendulum.lua", tmp_path / "stiff", "--emit", "step,start,M")
    assert stiff.steps(stiff.double.start, 5e-3, 400) == [None, None]
    n, start = stiff.double.n, real(stiff.double.start)
    work, out, derivatives = (real(numpy.full(count, numpy.nan)) for count in (
        int(re.search(r"_step_gauss_derivatives_work = (\d+)", stiff.header)[1]) + 1, 2 * n, 2 * n * (2 * n + 2)))
    work[-1] = 12.5
    assert not stiff.library.pendulum_step_gauss(pointer(stiff.p), pointer(stiff.x), ctypes.c_float(0), ctypes.c_float(5e-3), 20, pointer(start[:n]),
                                                 pointer(start[n:]), pointer(out), pointer(derivatives), pointer(work))
    assert work[-1] == 12.5 and numpy.isfinite(derivatives).all() and abs(out).max() < 20
    d, size = derivatives[:4 * n * n].reshape(2 * n, 2 * n), 1e-2
    moved = [real(numpy.zeros(2 * n)) for _ in range(2)]
    for end, sign in zip(moved, (1, -1)):
        from_state = real(start + sign * size * (numpy.arange(2 * n) == 0))
        assert not stiff.library.pendulum_step_gauss(pointer(stiff.p), pointer(stiff.x), ctypes.c_float(0), ctypes.c_float(5e-3), 20,
                                                     pointer(from_state[:n]), pointer(from_state[n:]), pointer(end), None, pointer(work))
    check([close("gauss by q[0]", (moved[0] - moved[1]) / (2 * size), d[:, 0], 2e-2)])


@pytest.mark.parametrize("seed", [1, 2, 7, 8] + ([4, 5, 10, 11, 13, 14] if LONG else []))
def test_energy_of_short_steps(seed, tmp_path):
    """Without damping, gauss loses no more digits than rk4. If a step added h^2 A to q separately, the energy would drift by 1e-5 to 1e-4."""
    text, parameters = damped_scene(seed)
    (tmp_path / "damped.lua").write_text(text)
    undamped = settings({name: 0 for name in parameters if name[0] == "d" or name == "eta"})
    model, h = Single(tmp_path / "damped.lua", tmp_path, *undamped, "--emit", "step,start,energy"), 1e-4
    start = numpy.concatenate([model.state(seed, 0.5)[part] for part in ("q", "qd")])
    energy = lambda state: sum(model.double("energy", {"t": 0, "q": state[:model.double.n], "qd": state[model.double.n:]}))
    ends = {method: model.steps(start, h, round(1 / h), method) for method in ("rk4", "gauss")}
    lines = [close(f"energy after {method}", energy(end), energy(start), 1e-5) for method, (end, _) in ends.items()]
    check([*lines, close("state after gauss", *ends["gauss"], 3 * error(*ends["rk4"]) + 3e-6)])


def test_short_steps_of_a_spring(tmp_path):
    """Both methods keep the energy of one mass on a spring at all lengths of steps."""
    (tmp_path / "spring.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "spring", links = {\n'
                                         '{ "mass", joint = "x", mass = 1.3, spring = { x = 117 }, start = { x = 0.9 } } } }\n')
    model = Single(tmp_path / "spring.lua", tmp_path, "--emit", "step,start")
    energy = lambda state: 117 * float(state[0])**2 / 2 + 1.3 * float(state[1])**2 / 2
    check([close(f"{method}, h = {h}", energy(model.steps(model.double.start, h, round(1 / h), method)[0]), energy(model.double.start), 1e-5)
           for h in (1e-3, 1e-4, 1e-5) for method in ("rk4", "gauss")])


def numbers(text):
    """Constants of the C that are not integers."""
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    return re.findall(r"(?<![\w.])(\d+(?:\.\d*(?:e[-+]?\d+)?|e[-+]?\d+))(f?)\b", code)


@pytest.mark.parametrize("scene", [(MODELS / "writer.lua", ["--fold"]), (MODELS / "puma.lua", ["--fold"])], ids=name_of)
def test_constants_are_rounded_once(scene, tmp_path):
    """Each constant is the float next to the double, and no double is left."""
    refdyn("gen", scene[0], *scene[1], "--emit", "h,step", "-o", tmp_path / "double")
    name, _ = emit_single(scene[0], tmp_path / "float", *scene[1], "--emit", "h,step")
    code = lambda folder: re.sub(r"/\*.*?\*/", "", (tmp_path / folder / f"{name}.c").read_text(), flags=re.S)
    for path in (tmp_path / "float").iterdir():
        text = path.read_text()
        assert "double" not in text and all(suffix for _, suffix in numbers(text)), path
    function = lambda text: re.search(rf"^void {name}_h\(.*?^\}}", text, re.M | re.S)[0]
    found, exact = numbers(function(code("float"))), numbers(function(code("double")))
    assert {numpy.float32(value) for value, _ in found} == {numpy.float32(float(value)) for value, _ in exact} and len(found) > 5


@pytest.mark.parametrize("compiler", (["gcc", "-std=c11", "-Wfloat-conversion"], ["clang", "-std=c11"], ["g++", "-std=c++17", "-x", "c++"],
                                      ["clang++", "-std=c++17", "-x", "c++"]), ids=lambda words: words[0])
def test_no_compiler_finds_a_promotion(compiler, tmp_path):
    models = [path for path in models_of_tests() + all_models()] if LONG else [scene[0] for scene in SCENES]
    for path in models:
        folder = tmp_path / path.stem
        folder.mkdir()
        if refdyn("gen", path, "--real", "float", "--emit", f"all,step.p,{DERIVATIVES}", "-o", folder, status=None).returncode:
            refdyn("gen", path, "--real", "float", "-o", folder)
        for file in folder.glob("*.c"):
            subprocess.run([*compiler, "-fsyntax-only", *STRICT, file], check=True)


def test_what_is_left_out(tmp_path):
    """Nothing for the runtime, which computes with doubles: its header is not included."""
    done = refdyn("gen", MODELS / "crane.lua", "--real", "float", "-o", tmp_path)
    lacks = "no double precision, which the runtime needs"
    assert f"breaks switches pace: {lacks};" in done.stdout and f"; required: {lacks}\n" in done.stdout, done.stdout
    header = (tmp_path / "crane.h").read_text()
    assert "refdyn" not in re.sub(r"/\*.*?\*/", "", header, flags=re.S) and "_model" not in header
    assert "All numbers are floats." in header and "crane_parameter_bytes = " in header
    size = int(re.search(r"crane_parameter_bytes = (\d+)", header)[1])
    (tmp_path / "size.c").write_text(f'#include "crane.h"\n_Static_assert(sizeof(struct crane_parameters) == {size}, "");\n')
    subprocess.run(["gcc", "-fsyntax-only", tmp_path / "size.c"], check=True)


def test_names_of_the_model_stay(tmp_path):
    (tmp_path / "words.lua").write_text('local rd = require "refdyn"\nlocal p = rd.parameters { { "doubles", 2, "kg" }, { "exp", 0.1, "N s/m" } }\n'
                                        'return rd.model { name = "words", links = { { "slider", joint = { "x" }, mass = p.doubles, damper = { x = p.exp } } } }\n')
    _, files = emit_single(tmp_path / "words.lua", tmp_path / "c", "--emit", "qdd")
    text = (tmp_path / "c" / "words.h").read_text() + files[0].read_text()
    assert "float doubles; /* [kg] */" in text and "p->exp = 0.1f;" in text and "expf" not in text


def test_doubles_are_the_default(tmp_path):
    for folder, option in (("a", []), ("b", ["--real", "double"])):
        refdyn("gen", FUNCTIONS, *option, "-o", tmp_path / folder)
    assert all((tmp_path / "b" / path.name).read_text() == path.read_text() for path in (tmp_path / "a").iterdir())


def test_messages(tmp_path):
    def said(*arguments, status=2):
        return refdyn("gen", *arguments, "-o", tmp_path, status=status).stderr

    for option in ("--for-lanes", "--for-casadi"):
        assert said(REFERENCE, "--real", "float", option).splitlines()[0] == (
            f"refdyn gen: --real float: is for NAME.c and its steps only; leave out {option}")
    assert "--real: 'single' is not one of double, float" in said(REFERENCE, "--real", "single")
    assert not (tmp_path / "manipulator.c").exists()
    model = tmp_path / "outside.lua"
    for value in ("1e39", "1e-39"):
        model.write_text(f'local rd = require "refdyn"\nlocal p = rd.parameters {{ {{ "mass", {value}, "kg" }} }}\nreturn rd.model {{ name = "outside", '
                         'links = { { "slider", joint = { "x" }, mass = p.mass, damper = { x = 1 } } } }\n')
        assert said(model, "--real", "float", status=1) == (
            f"{model}:3: --real float: the C has the constant {float(value):g}, and floats range from 1.2e-38 to 3.4e+38; choose other units\n")


# ---- Arm Cortex-M ----

def arm(folder, core, *words):
    subprocess.run([*ARM, *CORES[core], *words], cwd=folder, check=True)


@needs_arm
@pytest.mark.parametrize("core", CORES)
def test_no_helpers_for_doubles(core, tmp_path):
    """Undefined symbols are functions of libm for floats, and of memory."""
    for model, options in SCENES if LONG else SCENES[2:]:
        folder = tmp_path / model.stem
        name, files = emit_single(model, folder, *options, "--emit", "all,step")
        for file in files:
            arm(folder, core, "-O2", *STRICT, "-Wfloat-conversion", "-c", file.name, "-o", "x.o")
            symbols = subprocess.run(["arm-none-eabi-nm", "-u", "x.o"], cwd=folder, capture_output=True, text=True, check=True).stdout.split()
            others = {symbol for symbol in symbols if symbol != "U" and not symbol.startswith(f"{name}_")}
            libm = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt pow fabs fmin fmax".split()
            assert others <= {f"{function}f" for function in libm} | {"memcpy", "memset"}, (core, file.name, others)


def states_of(printed):
    """The states that the controller prints as the bits of floats."""
    return numpy.array([[int(word, 16) for word in line.split()] for line in printed.splitlines()[:5]], dtype=numpy.uint32).view(numpy.float32)


@needs_arm
def test_no_warnings_in_the_core(tmp_path):
    """The runtime core compiles without warnings for a Cortex-M7, where enumerations are as short as their values."""
    for path in CORE_SOURCES:
        arm(tmp_path, "m7", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", SOURCE, "-I", SOURCE / "runtime", path)


@needs_arm
@needs_qemu
def test_the_commands_of_the_page(tmp_path):
    """The block marked `arm` of the page for callers from C, which test_readme.py leaves out, and the processors in the table after it."""
    page = (SOURCE / "runtime" / "README.md").read_text()
    commands = re.search(r"^```arm\n(.*?)^```", page, re.M | re.S)[1]
    emit_single(REFERENCE, tmp_path / "emitted_float", *settings({"n_rfe": 1, "drive": "input"}), "--emit", "qdd,step")
    (tmp_path / "tests").symlink_to(SOURCE / "tests")
    of_m4, printed = "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16", []
    flags = re.findall(r"^\| Cortex-M.*? \| `(-mcpu=\S+ -mfpu=\S+)`", page, re.M)
    assert len(flags) == 3 and of_m4 in commands and of_m4 in flags
    for processor in flags:
        of_processor = commands.replace(of_m4, processor).replace("mps2-an386", "mps2-an386" if processor == of_m4 else "mps2-an500")
        done = subprocess.run(["bash", "-e", "-c", of_processor], cwd=tmp_path, check=True, capture_output=True, text=True, timeout=100)
        printed.append(states_of(done.stdout))
    assert printed[0].shape == (5, 8)
    check([close(f"states by {processor}", states, printed[0], 1e-5) for processor, states in zip(flags, printed)])


@needs_arm
@needs_qemu
@pytest.mark.skipif(not LONG, reason="in tests/long")
def test_a_controller_on_a_cortex_m4(tmp_path):
    """The floats of the host, to a few units in the last place of the largest: only sinf and cosf differ. The stack is within its bound."""
    emit_single(REFERENCE, tmp_path, *settings({"n_rfe": 1, "drive": "input"}), "--emit", "step")
    emitted = ["manipulator.c", "manipulator_step.c"]
    subprocess.run(["gcc", "-std=c11", "-O2", "-ffp-contract=off", *STRICT[:-1], "-I.", ARM_FILES / "cortex_controller.c", *emitted, "-lm", "-o", "host"], cwd=tmp_path,
                   check=True)
    arm(tmp_path, "m4", "-std=gnu11", "-O2", "-ffp-contract=off", "-ffunction-sections", "-fdata-sections", "-DPAINTED", "--specs=rdimon.specs",
        "-nostartfiles", "-Wl,--gc-sections", "-T", ARM_FILES / "cortex_memory.ld", "-I.", *ARM_FILES.glob("*.c"), *emitted, "-lm", "-o", "m4.elf")
    host = subprocess.run([tmp_path / "host"], capture_output=True, text=True, check=True).stdout
    target = subprocess.run(["qemu-system-arm", "-M", "mps2-an386", "-cpu", "cortex-m4", "-semihosting", "-nographic", "-kernel", "m4.elf"], cwd=tmp_path,
                            capture_output=True, text=True, check=True, timeout=120).stdout
    rows = [states_of(host), states_of(target)]
    assert rows[0].shape == (5, 8) and abs(rows[0]).max() > 0.1
    check([close("states", rows[1], rows[0], 16 * numpy.finfo(numpy.float32).eps)])
    used, header = int(target.split()[-1]), (tmp_path / "manipulator_step.h").read_text()
    assert 0 < used <= int(re.search(r"at most (\d+) bytes\. \*/\nint manipulator_step_rk4_state", header)[1])
    names = subprocess.run(["arm-none-eabi-nm", "m4.elf"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "manipulator_qdd" in names and "manipulator_d_qdd" not in names
