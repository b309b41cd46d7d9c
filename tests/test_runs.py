"""Files of runs: h5py, xarray and refdyn read to the bit what was written; `refdyn merge`."""
import os
import resource
import signal
import subprocess

import h5py
import numpy as np
import pytest
import xarray

from program import BUILD, refdyn

MAKE = BUILD / "bin" / "make_runs"
TOTAL, TIMES = 40, [0, 0.1, 0.25, 0.5, 1]
PROGRAMS = ["chapter", "größer als ∂x/∂t", "", "none"]
WHICH = ["smallest", "its time", "largest", "its time, too"]
# Where the numbers of each item are among those of a case, as in make_runs.c.
ITEMS = {"final/t": 0, "final/E_x": 1, "final/course": 2, "extremes/E_x": slice(3, 7), "history/E_x": slice(7, 12),
         "history/energy": slice(12, 17)}
UNITS = {"final/t": "s", "final/E_x": "m", "extremes/E_x": "m", "history/E_x": "m", "history/energy": "J",
         "history/t": "s", "cpu_s": "s", "cases/m_E": "kg", "cases/arm_psi_d": "rad/s"}


def random_bits(index):
    mask = 2**64 - 1
    z = (index + 1) * 0x9e3779b97f4a7c15 & mask
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9 & mask
    z = (z ^ z >> 27) * 0x94d049bb133111eb & mask
    return z ^ z >> 31


def random_numbers(number, places):
    values = np.array([random_bits(number * 1000 + place) for place in places], dtype="<u8").view("<f8")
    return np.where(np.isnan(values), np.nan, values)


def status_of(number):
    return 3 if number % 7 == 3 else 1 if number % 11 == 5 else 0


def reason_of(number):
    return f"case {number}: Schrittweite zu klein, ∂φ/∂q „singulär“ 𝜑" if status_of(number) == 3 else ""


def kept_of(number):
    values = random_numbers(number, range(17))
    if status_of(number) == 3:
        values[1::2] = np.nan
    return values


def make(path, start=0, step=1, count=TOTAL, total=TOTAL, status=0, **attributes):
    attributes = {"model": "masse = größer", "sweep": "x" * 100000, **attributes}
    given = [f"{name}={text}" for name, text in attributes.items()]
    done = subprocess.run([MAKE, path, *map(str, (total, start, step, count)), *given], capture_output=True, text=True)
    assert done.returncode == status, done.stderr
    return path if status == 0 else done.stderr


def same_bits(found, expected):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape and found.dtype == expected.dtype
    assert found.tobytes() == expected.tobytes()


def compare(path, numbers):
    """Compares every value of the file, read by h5py."""
    with h5py.File(path) as file:
        kept = np.array([kept_of(k) for k in numbers]).reshape(len(numbers), 17)
        same_bits(file["case"][()], np.array(numbers, dtype="<i8"))
        same_bits(file["status"][()], np.array([status_of(k) for k in numbers], dtype="<i4"))
        same_bits(file["steps"][()], np.array([random_bits(k) >> 12 for k in numbers], dtype="<u8").astype(float).astype("<i8"))
        same_bits(file["cpu_s"][()], np.array([random_numbers(k, [200])[0] for k in numbers], dtype="<f8"))
        assert list(file["reason"].asstr()[()]) == [reason_of(k) for k in numbers]
        assert list(file["cases/program"].asstr()[()]) == [PROGRAMS[random_bits(k) % 4] for k in numbers]
        for place, name in ((100, "m_E"), (101, "arm_psi_d")):
            same_bits(file[f"cases/{name}"][()], np.array([random_numbers(k, [place])[0] for k in numbers], dtype="<f8"))
        for name, columns in ITEMS.items():
            same_bits(file[name][()], kept[:, columns])
        assert list(file["history/t"][()]) == TIMES and list(file["extremes/which"].asstr()[()]) == WHICH


def test_h5py_reads_what_was_written(tmp_path):
    path = make(tmp_path / "runs.h5")
    compare(path, range(TOTAL))
    with h5py.File(path) as file:
        units = {}
        file.visititems(lambda name, item: units.update({name: item.attrs["units"]}) if "units" in item.attrs else None)
        assert units == UNITS
        assert file.attrs["model"] == "masse = größer" and file.attrs["sweep"] == "x" * 100000
        assert file.attrs["content"] == "refdyn runs" and file.attrs["layout_version"] == 1 and file.attrs["batch_cases"] == TOTAL
        assert dict(file["cases/arm_psi_d"].attrs.items())["kind"] == "start rate" and file["cases/program"].attrs["target"] == "program"
        for name in [*ITEMS, "status", "reason", "steps", "cpu_s", "cases/m_E", "cases/program"]:
            assert file[name].dims[0][0] == file["case"], name
        assert file["history/energy"].dims[1][0] == file["history/t"]
        assert file["extremes/E_x"].dims[1][0] == file["extremes/which"]


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_what_was_written(tmp_path, engine):
    path = make(tmp_path / "runs.h5")
    kept = np.array([kept_of(k) for k in range(TOTAL)])
    with xarray.open_dataset(path, engine=engine) as runs:
        assert list(runs.case.values) == list(range(TOTAL)) and list(runs.reason.values) == [reason_of(k) for k in range(TOTAL)]
        assert runs.attrs["model"] == "masse = größer"
    with xarray.open_dataset(path, engine=engine, group="history") as history:
        assert history.E_x.dims == ("case", "t") and history.E_x.units == "m" and list(history.t.values) == TIMES
        same_bits(history.energy.values, kept[:, 12:])
    with xarray.open_dataset(path, engine=engine, group="extremes") as extremes:
        same_bits(extremes.E_x.sel(which="largest").values, kept[:, 5])
    with xarray.open_dataset(path, engine=engine, group="cases") as cases:
        assert list(cases.program.values) == [PROGRAMS[random_bits(k) % 4] for k in range(TOTAL)]


def test_equal_data_give_equal_bytes(tmp_path):
    assert make(tmp_path / "a.h5").read_bytes() == make(tmp_path / "b.h5").read_bytes()


@pytest.mark.skipif("REFDYN_SLOWNESS" in os.environ, reason="sanitizers keep memory that was given back")
def test_memory_does_not_grow_with_cases(tmp_path):
    path = tmp_path / "runs.h5"
    script = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL); "
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
    for arguments in ([path, "100000", "0", "1", "100000"], [path]):
        peak = subprocess.run(["/usr/bin/python3", "-c", script, MAKE, *arguments], capture_output=True, text=True, check=True)
        assert int(peak.stdout) < 100e3


# ---- merge ----

def parts(folder):
    """All cases in three files: the even ones in one, and the odd ones in two."""
    return [make(folder / "odd.h5", 1, 2, 10), make(folder / "even.h5", 0, 2, 20), make(folder / "more.h5", 21, 2, 10)]


def test_merge_is_the_whole(tmp_path):
    merged = tmp_path / "merged.h5"
    done = refdyn("merge", *parts(tmp_path), "-o", merged)
    assert done.stdout == done.stderr == ""
    compare(merged, range(TOTAL))
    assert "missing" not in h5py.File(merged).attrs
    refdyn("merge", merged, "-o", tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == merged.read_bytes()


def test_merge_tells_gaps(tmp_path):
    a, b, c = make(tmp_path / "a.h5", 2, 1, 3, command="a"), make(tmp_path / "b.h5", 7, 2, 2, command="b"), make(tmp_path / "c.h5", 0, 1, 0)
    done = refdyn("merge", b, a, c, "-o", tmp_path / "merged.h5")
    gaps = "0-1, 5-6, 8, 10-39"
    assert done.stderr == f"refdyn: warning: 35 of 40 cases are missing from all files: {gaps}\n"
    compare(tmp_path / "merged.h5", [2, 3, 4, 7, 9])
    with h5py.File(tmp_path / "merged.h5") as file:
        assert file.attrs["missing"] == gaps and "command" not in file.attrs
    rest = make(tmp_path / "rest.h5", 10, 1, 30)
    assert refdyn("merge", rest, tmp_path / "merged.h5", "-o", tmp_path / "more.h5").stderr.endswith(": 0-1, 5-6, 8\n")
    refdyn("merge", c, "-o", tmp_path / "none.h5")
    compare(tmp_path / "none.h5", [])


def refuse(tmp_path, *paths):
    before = {path: path.read_bytes() for path in paths if path.is_file()}
    done = refdyn("merge", *paths, "-o", tmp_path / "merged.h5", status=1)
    assert not list(tmp_path.glob("merged.h5*")) and before == {path: path.read_bytes() for path in before}
    assert done.stderr.count("\n") == 1
    return done.stderr.replace(str(tmp_path) + "/", "").strip()


def test_merge_refuses_overlaps(tmp_path):
    a, b = make(tmp_path / "a.h5", 0, 1, 20), make(tmp_path / "b.h5", 3, 5, 6)
    assert refuse(tmp_path, a, b) == "b.h5: shares cases with a.h5: 3, 8, 13, 18; merge parts without common cases"
    assert refuse(tmp_path, a, make(tmp_path / "c.h5", 15, 1, 20)) == "c.h5: shares cases with a.h5: 15-19; merge parts without common cases"
    assert refuse(tmp_path, a, a) == "a.h5: shares cases with a.h5: 0-19; merge parts without common cases"


def test_merge_refuses_another_batch(tmp_path):
    a = make(tmp_path / "a.h5", 0, 1, 20)
    other = make(tmp_path / "b.h5", 20, 1, 20, sweep="y")
    assert refuse(tmp_path, a, other) == "b.h5: belongs to another batch than a.h5: attribute 'sweep' differs"
    more = make(tmp_path / "c.h5", 20, 1, 20, lanes="4")
    assert refuse(tmp_path, a, more) == "c.h5: belongs to another batch than a.h5: attribute 'lanes' differs"
    assert refuse(tmp_path, more, a) == "a.h5: belongs to another batch than c.h5: attribute 'lanes' differs"
    longer = make(tmp_path / "d.h5", 20, 1, 20, total=50)
    assert refuse(tmp_path, a, longer) == "d.h5: belongs to another batch than a.h5: it has 50 cases, not 40"


def change(path, how):
    with h5py.File(path, "r+") as file:
        how(file)
    return path


def rename(file, name):
    file.move(name, name + "_2")


@pytest.mark.parametrize("how, fact", [
    (lambda f: rename(f, "history/energy"), "belongs to another batch than a.h5: the list of kept values differs"),
    (lambda f: rename(f, "cases/m_E"), "belongs to another batch than a.h5: the list of varied names differs"),
    (lambda f: f["history/t"].__setitem__(2, 0.3), "belongs to another batch than a.h5: an axis of the kept values differs"),
    (lambda f: f["case"].__setitem__(3, 1000), "/case: row 3 has number 1000; numbers must ascend and be below 40"),
    (lambda f: f["case"].__setitem__(3, 21), "/case: row 3 has number 21; numbers must ascend and be below 40"),
    (lambda f: f.attrs.__setitem__("layout_version", 7), "is a file of runs as refdyn batch writes it in layout 7, this refdyn reads layout 1"),
    (lambda f: f.attrs.__setitem__("content", "refdyn motion"), "is no file of runs as refdyn batch writes it"),
    (lambda f: f.attrs.__delitem__("content"), "is no file of runs as refdyn batch writes it"),
    (lambda f: f.attrs.__delitem__("batch_cases"), "attribute batch_cases is missing"),
    (lambda f: f["final"].create_dataset("u", data=np.zeros(3)), "/final/u: has 3 rows and not one for each of 20 cases"),
    (lambda f: f["final"].create_dataset("u", data=np.zeros((20, 2, 2))), "/final/u: does not have the form of a file of runs"),
])
def test_merge_refuses_changed_files(tmp_path, how, fact):
    a, b = make(tmp_path / "a.h5", 0, 1, 20), make(tmp_path / "b.h5", 20, 1, 20)
    assert refuse(tmp_path, a, change(b, how)) == f"b.h5: {fact}"


def test_merge_refuses_what_is_no_file_of_runs(tmp_path):
    a, b = make(tmp_path / "a.h5", 0, 1, 20), tmp_path / "b.h5"
    assert refuse(tmp_path, a, b) == "b.h5: cannot be read: No such file or directory"
    needed = "is no HDF5 file; must be a file of runs as refdyn batch writes it"
    b.write_text("t,x\n0,1\n")
    assert refuse(tmp_path, a, b) == f"b.h5: {needed}"
    b.write_bytes(b"")
    assert refuse(tmp_path, a, b) == f"b.h5: {needed}"
    b.unlink()
    b.mkdir()
    assert refuse(tmp_path, a, b) == f"b.h5: {needed}"
    b.rmdir()
    b.write_bytes(a.read_bytes()[:-100])
    assert refuse(tmp_path, a, b) == "b.h5: cannot be read: the file is cut off"
    with h5py.File(b, "w") as file:
        file["x"] = 1
    assert refuse(tmp_path, a, b) == "b.h5: is no file of runs as refdyn batch writes it"


def test_merge_spoils_no_input(tmp_path):
    a = make(tmp_path / "a.h5", 0, 1, 20)
    before = a.read_bytes()
    done = refdyn("merge", a, "-o", a, status=1)
    assert "which this command also reads or writes" in done.stderr and a.read_bytes() == before
    assert refdyn("merge", a, "-o", "/dev/null", status=1).stderr == "/dev/null: output: not a regular file; HDF5 needs one\n"


def limited(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)


@pytest.mark.parametrize("size", [0, 500, 5000, 60000, 110000])
def test_a_full_disk_is_told(tmp_path, size):
    """A limit on the size of files makes write() fail like a full disk."""
    path = tmp_path / "runs.h5"
    assert make(path, count=1000, total=1000).stat().st_size > 120000
    done = subprocess.run([MAKE, path, "1000", "0", "1", "1000"], capture_output=True, text=True, timeout=60,
                          preexec_fn=lambda: limited(size), restore_signals=False)
    what = "cannot" if size == 0 else "not all could"
    assert (done.returncode, done.stderr) == (1, f"{path}: {what} be written: File too large\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="all files may be written")
def test_a_file_that_may_not_be_written_is_told(tmp_path):
    path = make(tmp_path / "a.h5")
    path.chmod(0o400)
    assert make(path, status=1) == f"{path}: cannot be written: Permission denied\n"


def test_a_folder_that_is_missing_is_told(tmp_path):
    path = tmp_path / "none" / "a.h5"
    assert make(path, status=1) == f"{path}: cannot be written: No such file or directory\n"


def test_cases_out_of_order_are_told(tmp_path):
    assert make(tmp_path / "a.h5", 39, 1, 2, status=1) == f"{tmp_path}/a.h5: case 40 comes out of order\n"
