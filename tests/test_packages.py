"""The Debian package and the source archive of the target `package`; the wheel is the subject of test_python.py."""
import os
import re
import shutil
import subprocess
import tarfile

import pytest

from program import BUILD, LONG, REFERENCE, SANITIZED, SOURCE, VERSION, read_run

pytestmark = pytest.mark.skipif(SANITIZED or not shutil.which("dpkg-deb"), reason="packages are made of the optimised build, on Debian")


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("package")
    run("cpack", "--config", BUILD / "package" / "debian.cmake", "-B", folder)
    file, = folder.glob(f"refdyn_{VERSION}_*.deb")
    return file


def test_debian_package_is_complete(package, tmp_path):
    """Unpacked anywhere, the program runs; documentation, completion, editor support, models and all licences are there."""
    run("dpkg-deb", "-x", package, tmp_path)
    program = tmp_path / "usr" / "bin" / "refdyn"
    assert run(program, "--version").startswith(f"refdyn {VERSION}\n")
    run(program, "sim", tmp_path / "usr" / "share" / "refdyn" / "models" / "manipulator.lua", "--until", 0.1, "-o", tmp_path / "run.csv")
    assert read_run(tmp_path / "run.csv")["t"][-1] == 0.1
    share = tmp_path / "usr" / "share"
    for name in ("man/man1/refdyn.1.gz", "bash-completion/completions/refdyn", "zsh/site-functions/_refdyn", "fish/vendor_completions.d/refdyn.fish",
                 "refdyn/models/editor/refdyn.lua", "refdyn/control/vibration.c", "doc/refdyn/NEWS.md.gz", "doc/refdyn/changelog.gz"):
        assert (share / name).stat().st_size > 0, name
    licences = (share / "doc" / "refdyn" / "copyright").read_text()
    assert (SOURCE / "LICENSE").read_text() in licences and "lapacke" in licences and "HDF Group" in licences


@pytest.mark.skipif(not shutil.which("lintian"), reason="lintian is not installed")
def test_lintian_finds_no_error(package):
    done = subprocess.run(["lintian", "--fail-on", "error", package], capture_output=True, text=True)
    assert done.returncode == 0 and not re.search("^E:", done.stdout, re.M), done.stdout + done.stderr


@pytest.mark.skipif(not (SOURCE / ".git").exists(), reason="not a clone")
def test_source_archive_names_the_commit(tmp_path):
    """The program of the archive knows its commit without git, and so does an archive made of the archive."""
    run(SOURCE / "runtime" / "package" / "make_source", tmp_path / "first", VERSION)
    file = tmp_path / "first" / f"refdyn-{VERSION}.tar.gz"
    with tarfile.open(file) as archive:
        archive.extractall(tmp_path)
    tree = tmp_path / f"refdyn-{VERSION}"
    commit = run("git", "-C", SOURCE, "rev-parse", "HEAD").strip()[:12]
    for source in (SOURCE, tree):
        run("cmake", f"-DSOURCE={source}", f"-DOUTPUT={tmp_path / 'commit.c'}", "-P", SOURCE / "runtime" / "tool" / "commit.cmake")
        assert re.search(rf'"{commit}\+?"', (tmp_path / "commit.c").read_text())
    assert f'"{commit}"' in (tmp_path / "commit.c").read_text()
    run(tree / "runtime" / "package" / "make_source", tmp_path / "second", VERSION)
    with tarfile.open(file) as first, tarfile.open(tmp_path / "second" / file.name) as second:
        assert {name.rstrip("/") for name in second.getnames()} == {name.rstrip("/") for name in first.getnames()} - {"pax_global_header"}


@pytest.mark.skipif(not LONG or os.getuid() != 0 or not shutil.which("debootstrap"), reason="tests/long, as root and with debootstrap: installs a bare Debian")
def test_debian_package_in_a_bare_debian(package, tmp_path):
    """apt installs it with what it needs, and the model compiles with what it recommends."""
    root = tmp_path / "root"
    run("debootstrap", "--variant=minbase", "--include=gcc,libc6-dev", "bookworm", root, timeout=1500)
    shutil.copy(package, root / "refdyn.deb")
    shutil.copy(REFERENCE, root)
    shutil.copy("/etc/resolv.conf", root / "etc" / "resolv.conf")
    if os.path.exists("/etc/apt/sources.list.d"):
        shutil.copytree("/etc/apt", root / "etc" / "apt", dirs_exist_ok=True)
    run("chroot", root, "sh", "-ec", "apt-get -q update && apt-get -q install -y --no-install-recommends /refdyn.deb", timeout=1500)
    commands = "refdyn --version && refdyn sim /manipulator.lua --until 0.1 -o /run.csv && tail -n 1 /run.csv"
    said = run("unshare", "--pid", "--fork", f"--mount-proc={root}/proc", "chroot", root, "sh", "-ec", commands)
    assert said.startswith(f"refdyn {VERSION}\n") and "\n0.1," in said
