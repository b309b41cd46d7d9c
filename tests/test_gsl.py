"""Motions by GSL's integrators: reference motions, breaks, and the installed library. test_python.py tries a program without GSL."""
import os
import subprocess

import numpy
import pytest

from program import BUILD, CORE_FILES, REFERENCE, SCALE, SOURCE, TESTS, check, close, motion, oracle, read_run, refdyn
from test_motions import JUMP, deviations, start_file

# Case, its reference, arguments; then for each method the tolerance and the allowed error of the end-effector [m].
MOTIONS = {
    "rigid": ("traj_seed_rigid", ["--set", "n_rfe=1"], {"msbdf": 1e-11, "bsimp": 1e-8}),
    "flexible": ("traj_seed_flexible_4", ["--set", "n_rfe=4", "--from", "statics"], {"msbdf": 1e-8, "bsimp": 1e-8}),
    "flexible, damped": ("traj_seed_flexible_4_damped", ["--set", "n_rfe=4", "--set", "eta=1.3e-3", "--from", "statics"],
                         {"msbdf": 1e-9, "bsimp": 1e-8}),
}


@pytest.mark.parametrize("method", ["msbdf", "bsimp"])
@pytest.mark.parametrize("which", MOTIONS)
def test_reference_motion(which, method, capsys):
    name, arguments, tolerances = MOTIONS[which]
    reference = oracle(name)
    run, said, summary = motion(REFERENCE, *arguments, "--method", method, "--tol", tolerances[method], "--every", "0.5",
                                "--until", "10")
    of_r, of_q = deviations(run, reference, reference["coordinates"], True)
    with capsys.disabled():
        print(f"\n{which}, {method}: r_E within {of_r:.1e} m, q within {of_q:.1e}; {summary['steps']} steps, {summary['cpu_s']:.2g} s")
    assert of_r <= 1e-6 * SCALE and of_q <= 1e-6 * SCALE
    assert summary["method"] == method and f"method       {method}, tolerance" in said
    assert ("baumgarte" if method == "msbdf" else "project") in said
    # Outputs of bsimp are on the programme; outputs of msbdf are as close as its gains keep them.
    assert summary["phi_max"] < (1e-12 if method == "bsimp" else 1e-6)


@pytest.mark.parametrize("method, tolerance", [("msbdf", 1e-8), ("bsimp", 1e-8)])
def test_flexible_pendulum(tmp_path, method, tolerance):
    """Undamped, with torsion at 2e4 rad/s."""
    reference = oracle("traj_pendulum_4")
    first = reference["samples"][0]
    start = start_file(tmp_path, {"q": first["q"], "qd": first["qd"]})
    run, _, summary = motion(TESTS / "models" / "pendulum_flexible.lua", "--from", start, "--method", method, "--tol", tolerance,
                             "--every", "0.1", "--until", "3")
    _, of_q = deviations(run, reference, reference["coordinates"], False)
    assert of_q <= (1e-5 if method == "msbdf" else 1e-6) * SCALE, f"q differs by {of_q:.1e}"
    assert summary["energy_error"] <= 1e-4


@pytest.mark.parametrize("method, tolerance", [("msbdf", 1e-9), ("bsimp", 1e-9)])
@pytest.mark.quick
def test_breaks_end_a_step(tmp_path, method, tolerance):
    """A force that jumps and a force with a kink: the method restarts after them and never evaluates across them."""
    model, at = tmp_path / "jump.lua", 0.333
    model.write_text(JUMP.replace("TIME", str(at)))
    run, _, summary = motion(model, "--until", "1", "--every", "0.25", "--method", method, "--tol", tolerance)
    late, ramp = 1 - at, 1 - 0.777
    x = 0.75 * at**2 + 1.5 * at * late - 1.25 * late**2 + ramp**3 / 12
    v = 1.5 * at - 2.5 * late + ramp**2 / 4
    bound = 1e-12 if method == "bsimp" else 2e-8
    check([f"{name}: {run[name][-1]!r}, not {value!r}" for name, value in {"cart_x": x, "cart_x_d": v}.items()
           if abs(run[name][-1] - value) > bound * SCALE])
    numpy.testing.assert_array_equal(run["t"], [0, 0.25, 0.5, 0.75, 1])
    assert summary["rejected"] <= 20 and summary["steps"] < 300


def test_same_bytes(tmp_path):
    for method in ("msbdf", "bsimp"):
        for name in ("one", "two"):
            refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--method", method, "--until", "1", "-o", tmp_path / name)
        assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


@pytest.mark.parametrize("method, tolerance", [("msbdf", 1e-5), ("bsimp", 1e-7)])
def test_through_a_singular_state(method, tolerance):
    """Stretched and folded arm, compared with the same motion under rows that keep their rank."""
    arm = TESTS / "models" / "arm_through.lua"
    for arguments in (["--until", 1.6], ["--until", 1.5, "--set", "rate=2.5"]):
        expected, _, _ = motion(arm, *arguments, "--set", "rows=angles", "--tol", "1e-12")
        run, _, summary = motion(arm, *arguments, "--singular", "pass", "--method", method, "--tol", "1e-7")
        assert summary["passed"]["count"] == 1
        check([close(name, run[name], expected[name], tolerance, 1) for name in ("cart_x", "upper_psi", "lower_psi")])


def test_usage():
    for arguments, said in ((["--step", "1e-3"], "--step: msbdf chooses its steps; use --tol"),
                            (["--stabilise", "project"], "--stabilise: project would make msbdf start again")):
        done = refdyn("sim", REFERENCE, "--until", "1", "--method", "msbdf", *arguments, status=2)
        assert said in done.stderr


def run_command(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=400, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The prefix, moved after the installation, and the emitted rigid manipulator with its tangent."""
    folder = tmp_path_factory.mktemp("install")
    run_command("cmake", "--install", BUILD, "--prefix", folder / "first")
    (folder / "first").rename(folder / "prefix")
    refdyn("gen", REFERENCE, "--set", "name=manipulator_rigid", "--set", "n_rfe=1", "--emit", "all,tangent", "-o", folder / "emitted")
    refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--method", "rk54", "--tol", "1e-11", "--until", "0.5", "--every", "0.5",
           "-o", folder / "run.csv")
    return folder


def check_program(folder, program):
    expected = read_run(folder / "run.csv")
    lines = [line.split() for line in run_command(program).splitlines()]
    assert [line[0] for line in lines[:2]] == ["bsimp", "msbdf"]
    for method, q, qd in lines[:2]:
        off = max(abs(float(q) - expected["base_z"][-1]), abs(float(qd) - expected["base_z_d"][-1]))
        assert off <= 1e-6 * SCALE, f"{method}: {off:.1e}"


def test_find_package(installed):
    build = installed / "cmake"
    run_command("cmake", "-S", TESTS / "install", "-B", build, f"-DCMAKE_PREFIX_PATH={installed / 'prefix'}",
                f"-DEMITTED={installed / 'emitted'}", "-DCMAKE_BUILD_TYPE=Release")
    run_command("cmake", "--build", build)
    check_program(installed, build / "user_gsl")
    assert "gsl" not in run_command("ldd", build / "user")


def test_pkg_config(installed):
    packages = next((installed / "prefix").rglob("refdyn-gsl.pc")).parent
    flags = run_command("pkg-config", "--cflags", "--libs", "refdyn-gsl",
                        env={**os.environ, "PKG_CONFIG_PATH": str(packages)}).split()
    program = installed / "user_gsl"
    run_command("cc", "-O2", "-I", installed / "emitted", TESTS / "install" / "user_gsl.c", *(installed / "emitted").glob("*.c"),
                *flags, "-lm", "-o", program)
    check_program(installed, program)


def test_core_is_free_of_gsl(installed):
    library = next((installed / "prefix").rglob("librefdyn_runtime.a"))
    assert "gsl_" not in run_command("nm", library)
    assert "gsl" not in next((installed / "prefix").rglob("refdyn.pc")).read_text()
    users = [path for path in [*(SOURCE / "gen").rglob("*.[ch]"), *(SOURCE / "generated").glob("*.[ch]"), *CORE_FILES]
             if "gsl" in path.read_text()]
    assert not users
