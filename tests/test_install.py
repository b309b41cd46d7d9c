"""Installs into a temporary prefix and builds a user's program against it, with CMake and with pkg-config."""
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree

import pytest

from program import BUILD, REFERENCE, SOURCE, TESTS, VERSION, read_run, refdyn, some


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The prefix, moved after the installation: no file in it may contain its first location."""
    folder = tmp_path_factory.mktemp("install")
    run("cmake", "--install", BUILD, "--prefix", folder / "first")
    (folder / "first").rename(folder / "prefix")
    refdyn("gen", REFERENCE, "--set", "name=manipulator_rigid", "--set", "n_rfe=1", "-o", folder / "emitted")
    refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--method", "rk4", "--step", "1e-3", "--until", "0.1", "--every", "0.1",
           "-o", folder / "run.csv")
    return folder


def check_program(folder, program):
    """The program computes what `refdyn sim` computes, and needs only libc and libm."""
    t, base_z = map(float, run(program).split())
    expected = read_run(folder / "run.csv")
    assert t == 0.1 and abs(base_z - expected["base_z"][-1]) <= 1e-12 and base_z != 0
    libraries = {line.split()[0].split("/")[-1].split(".")[0] for line in run("ldd", program).splitlines()}
    assert libraries <= {"linux-vdso", "libc", "libm", "ld-linux-x86-64", "ld-linux-aarch64"}, libraries


def test_installed_program(installed):
    program = installed / "prefix" / "bin" / "refdyn"
    assert run(program, "--version").startswith(f"refdyn {VERSION}\n")
    assert "arm_psi" in run(program, "check", REFERENCE)


def test_find_package(installed):
    build = installed / "cmake"
    run("cmake", "-S", TESTS / "install", "-B", build, f"-DCMAKE_PREFIX_PATH={installed / 'prefix'}",
        f"-DEMITTED={installed / 'emitted'}", f"-DVERSION={VERSION}", "-DCMAKE_BUILD_TYPE=Release")
    run("cmake", "--build", build)
    check_program(installed, build / "user")


@pytest.mark.parametrize("user", ["user", "user_batch"])
def test_pkg_config(user, installed):
    packages = next((installed / "prefix").rglob("refdyn.pc")).parent
    env = {**os.environ, "PKG_CONFIG_PATH": str(packages)}
    for package in some(packages.glob("refdyn*.pc")):
        assert run("pkg-config", "--modversion", package.stem, env=env).strip() == VERSION
    flags = run("pkg-config", "--cflags", "refdyn", env=env).split()
    libraries = run("pkg-config", "--libs", "--static", "refdyn", env=env).split()
    program = installed / user
    run("cc", "-O2", *flags, "-I", installed / "emitted", TESTS / "install" / f"{user}.c", *(installed / "emitted").glob("*.c"),
        *libraries, "-o", program)
    check_program(installed, program)


def test_version_in_c(installed):
    """The numbers, the text and the function agree; the changes begin with this version."""
    (installed / "version.c").write_text("""#include <refdyn.h>
#include <stdio.h>
int main(void) {
    printf("%d.%d.%d\\n%s\\n%s\\n", REFDYN_VERSION_MAJOR, REFDYN_VERSION_MINOR, REFDYN_VERSION_PATCH, REFDYN_VERSION, refdyn_version());
    return 0;
}
""")
    env = {**os.environ, "PKG_CONFIG_PATH": str(next((installed / "prefix").rglob("refdyn.pc")).parent)}
    flags = run("pkg-config", "--cflags", "--libs", "--static", "refdyn", env=env).split()
    run("cc", installed / "version.c", *flags, "-o", installed / "version")
    assert run(installed / "version").split() == [VERSION] * 3
    assert re.search(r"^## (\S+)", (SOURCE / "CHANGELOG.md").read_text(), re.M).group(1) == VERSION


@pytest.mark.parametrize("library", ["lib", "/elsewhere/lib"])
@pytest.mark.parametrize("include", ["include", "/elsewhere/include"])
def test_pkg_config_where_folders_begin_at_the_root(library, include, tmp_path):
    run("cmake", "-S", SOURCE, "-B", tmp_path / "build", "-DBUILD_TESTING=OFF", "-DCMAKE_INSTALL_PREFIX=/first",
        f"-DCMAKE_INSTALL_LIBDIR={library}", f"-DCMAKE_INSTALL_INCLUDEDIR={include}")
    packages = tmp_path / "first" / "lib" / "pkgconfig"
    packages.mkdir(parents=True)
    shutil.copy(tmp_path / "build" / "refdyn.pc", packages)
    prefix = "/first" if library != "lib" else f"{tmp_path}/first"
    env = {**os.environ, "PKG_CONFIG_PATH": str(packages)}
    found = {name: os.path.normpath(run("pkg-config", f"--variable={name}", "refdyn", env=env).strip()) for name in ("libdir", "includedir")}
    assert found == {"libdir": os.path.join(prefix, library), "includedir": os.path.join(prefix, include, "refdyn")}


def test_emitted_code_needs_one_small_header(installed):
    """The emitted files and refdyn_model.h, in a separate folder, are all that a user needs to call them."""
    folder = installed / "alone"
    shutil.copytree(installed / "emitted", folder)
    header = next((installed / "prefix").rglob("refdyn_model.h"))
    if not (folder / header.name).exists():
        shutil.copy(header, folder)
    for source in some(folder.glob("*.c")):
        run("cc", "-std=c11", "-c", source.name, cwd=folder)


@pytest.mark.skipif(not shutil.which("doxygen"), reason="doxygen is not installed")
def test_reference_of_the_headers(tmp_path):
    """Every symbol of the public headers is documented; one that is not stops the target `reference`."""
    run("cmake", "--build", BUILD, "--target", "reference")
    symbols = [symbol for page in some((BUILD / "reference" / "xml").glob("*.xml"))
               for symbol in xml.etree.ElementTree.parse(page).iter() if symbol.tag in ("memberdef", "enumvalue")]
    texts = {symbol.find("name").text: "".join(symbol.find("briefdescription").itertext()).strip() for symbol in symbols}
    assert {"refdyn_statics", "REFDYN_RODAS5P", "tangent_vectors", "refdyn_gsl_to", "refdyn_batch_run"} <= set(texts)
    assert not [name for name, text in texts.items() if not text]
    settings = (BUILD / "Doxyfile.reference").read_text() + f"\nINPUT = {tmp_path / 'bare.h'}\nOUTPUT_DIRECTORY = {tmp_path}\n"
    (tmp_path / "settings").write_text(settings)
    (tmp_path / "bare.h").write_text("/** @file */\nint bare(int a);\n")
    assert subprocess.run(["doxygen", tmp_path / "settings"], capture_output=True).returncode != 0
