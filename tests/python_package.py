"""The Python package of the sources, for tests that need no wheel."""
import importlib
import shutil
import subprocess
import sys
import sysconfig

import numpy
import pytest

from program import BUILD, SOURCE

PYTHON_FOLDER = SOURCE / "runtime" / "bindings" / "python"


def build(folder):
    """Puts the package into a folder: the extension by one call of the compiler with the libraries of the build, the package's
    files, and the program of the build."""
    package = folder / "refdyn"
    shutil.copytree(PYTHON_FOLDER / "refdyn", package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "bin").mkdir()
    (package / "bin" / "refdyn").symlink_to(BUILD / "bin" / "refdyn")
    (package / "include").mkdir()
    (package / "include" / "refdyn").symlink_to(SOURCE / "runtime")
    (folder / "refdyn-0.dist-info").mkdir()
    (folder / "refdyn-0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: refdyn\nVersion: 0\n")
    libraries = [BUILD / f"librefdyn_{name}.a" for name in ("record", "batch", "runtime")]
    done = subprocess.run(["cc", "-std=gnu11", "-O0", "-fPIC", "-shared", "-I", SOURCE, "-I", BUILD / "include", "-I", sysconfig.get_path("include"),
                           *PYTHON_FOLDER.glob("*.c"), "-o", package / ("core" + sysconfig.get_config_var("EXT_SUFFIX")), *libraries, "-lm", "-lpthread", "-ldl"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The package in this process."""
    folder = tmp_path_factory.mktemp("package")
    build(folder)
    sys.path.insert(0, str(folder))
    yield importlib.import_module("refdyn")
    sys.path.remove(str(folder))


def same(found, expected):
    """Equal to the bit; missing values are NaN."""
    return numpy.array_equal(numpy.asarray(found, float), numpy.array(expected, float), equal_nan=True)
