"""`refdyn sim -o RUN.h5`: the numbers of the CSV to the bit, in groups, with all inputs of the motion."""
import json
import resource
import subprocess

import h5py
import numpy as np
import pytest
import xarray

from program import MODELS, REFDYN, TESTS, refdyn

MANIPULATOR = [MODELS / "manipulator.lua", "--set", "n_rfe=2", "--until", "0.2"]


def both(folder, *arguments, status=0):
    """The open HDF5 file, the columns of the CSV, and the summary."""
    name = {0: "", 3: ".part"}[status]
    refdyn("sim", *arguments, "-o", folder / "run.h5", status=status)
    summary = [] if status else ["--summary", folder / "run.json"]
    refdyn("sim", *arguments, "-o", folder / "run.csv", *summary, status=status)
    with open(folder / f"run.csv{name}") as file:
        names = file.readline().strip().split(",")
        values = np.array([[float(text) for text in line.split(",")] for line in file])
    units = None if status else json.loads((folder / "run.json").read_text())["units"]
    return h5py.File(folder / f"run.h5{name}"), dict(zip(names, values.T)), units


def datasets(file):
    found = {}
    file.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
    return found


def columns(file):
    """Columns named as in the CSV, with their units."""
    for name, dataset in datasets(file).items():
        if dataset.attrs.get("CLASS") == b"DIMENSION_SCALE" and name != "t":
            continue
        last = name.split("/")[-1]
        if dataset.ndim == 1:
            labels = [last]
        else:
            along = dataset.dims[1][0].asstr()[()]
            lead, end = {"qd": ("", "_d"), "qdd": ("", "_dd"), "force": ("force_", ""), "r": ("E_", ""), "rd": ("E_", "d"), "rdd": ("E_", "dd")}.get(last, ("", ""))
            labels = [lead + label + end for label in along]
        units = dataset.attrs.get("column_units", [dataset.attrs.get("units")] * len(labels))
        for k, label in enumerate(labels):
            yield label, dataset[()].reshape(len(dataset), -1)[:, k], units[k]


def compare(file, csv, units):
    found = {name: (values, unit) for name, values, unit in columns(file)}
    assert found.keys() == csv.keys()
    for name, (values, unit) in found.items():
        assert values.tobytes() == csv[name].tobytes(), name
        assert units is None or unit == units.get(name), name


@pytest.mark.parametrize("more", [[], ["--set", "drive=input"], ["--set", "program=none"], ["--accuracy", "1e-5"], ["--verify"],
                                  ["--stop", "E_z<1.9"], ["--every", "1e-4"]])
def test_numbers_are_those_of_the_csv(tmp_path, more):
    file, csv, units = both(tmp_path, *MANIPULATOR, *more)
    compare(file, csv, units)
    for name, dataset in datasets(file).items():
        if dataset.attrs.get("CLASS") != b"DIMENSION_SCALE":
            assert dataset.dims[0][0] == file["t"], name


@pytest.mark.quick
def test_it_tells_what_it_was_made_from(tmp_path):
    file, _, _ = both(tmp_path, *MANIPULATOR, "--set", "m_E=3", "--tol", "1e-7")
    assert file["parameters"].attrs["m_E"] == 3 and file["parameters"].attrs["E"] == 2.1e11
    assert file["options"].attrs["n_rfe"] == "2" and file["options"].attrs["drive"] == "course"
    assert file.attrs["tol"] == 1e-7 and file.attrs["model"] == "manipulator" and file.attrs["until"] == 0.2
    assert file["model_files"].attrs[file.attrs["model_file"]] == (MODELS / "manipulator.lua").read_text()
    assert (file.attrs["content"], file.attrs["layout_version"]) == ("refdyn motion", 1)


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_it(tmp_path, engine):
    _, csv, _ = both(tmp_path, *MANIPULATOR)
    with xarray.open_dataset(tmp_path / "run.h5", engine=engine) as run:
        assert run.q.dims == ("t", "coordinate") and run.t.units == "s"
        assert run.q.sel(coordinate="arm_psi").values.tobytes() == csv["arm_psi"].tobytes()
    with xarray.open_dataset(tmp_path / "run.h5", engine=engine, group="points/E") as point:
        assert point.r.dims == ("t", "axis") and point.rd.units == "m/s"


def test_equal_motions_are_equal_bytes(tmp_path):
    for name in "ab":
        refdyn("sim", *MANIPULATOR, "-o", tmp_path / f"{name}.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_what_a_failed_motion_computed_is_kept(tmp_path):
    model = tmp_path / "model.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "m", gravity = { 0, 0, 0 }, links = { { "b", joint = { "x" }, '
                     'mass = 1, start = { x = 1 } } }, forces = function(s) return { b_x = 1 / (0.5 - s.t) } end }\n')
    file, csv, _ = both(tmp_path, model, "--until", "1", status=3)
    compare(file, csv, None)
    assert 0 < len(file["t"]) < 200 and not (tmp_path / "run.h5").exists()


@pytest.mark.quick
def test_plot_draws_it_as_the_csv(tmp_path):
    both(tmp_path, *MANIPULATOR)
    (tmp_path / "csv").mkdir()
    (tmp_path / "run.csv").rename(tmp_path / "csv" / "run.h5.csv")
    refdyn("plot", tmp_path / "run.h5", "-o", tmp_path / "h5.svg")
    refdyn("plot", tmp_path / "csv" / "run.h5.csv", "-o", tmp_path / "csv.svg")
    assert (tmp_path / "h5.svg").read_text() == (tmp_path / "csv.svg").read_text().replace("run.h5.csv", "run.h5")
    refdyn("plot", tmp_path / "run.h5", tmp_path / "csv" / "run.h5.csv", "-o", tmp_path / "over.svg", "--panel", "height")


@pytest.mark.parametrize("how, fact", [
    (lambda f: f["q"].resize(10, 0), "/q: does not have the form of a motion as refdyn sim writes it"),
    (lambda f: f["q"].attrs.__setitem__("columns", ["a"]), "/q: does not have the form of a motion as refdyn sim writes it"),
    (lambda f: f.attrs.__setitem__("layout_version", 2), "is a motion as refdyn sim writes it in layout 2, this refdyn reads layout 1"),
    (lambda f: [f[name].resize(0, 0) for name in datasets(f) if f[name].maxshape[0] is None], "there are no rows in it"),
])
def test_plot_refuses_spoiled_files(tmp_path, how, fact):
    path = tmp_path / "run.h5"
    refdyn("sim", *MANIPULATOR, "-o", path)
    with h5py.File(path, "r+") as file:
        how(file)
    done = refdyn("plot", path, "-o", tmp_path / "out.svg", status=1)
    assert done.stderr == f"{path}: {fact}\n"


def test_what_is_no_file_is_refused():
    done = refdyn("sim", *MANIPULATOR, "-o", "/dev/shm/none/run.h5", status=1)
    assert "cannot be written: No such file or directory" in done.stderr


def test_a_full_disk_is_told(tmp_path):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (60000, 60000))
    path = tmp_path / "run.h5"
    refdyn("sim", *MANIPULATOR, "-o", tmp_path / "first.h5")  # compiled
    done = subprocess.run(["/bin/sh", "-c", 'trap "" XFSZ; exec "$@"', "sh", REFDYN, "sim", *map(str, MANIPULATOR), "-o", path],
                          capture_output=True, text=True, preexec_fn=limit, timeout=60)
    assert done.returncode == 1, done
    assert f"{path}.part: not all could be written: File too large\n" in done.stderr
    assert "what was computed" not in done.stderr and not list(tmp_path.glob("run.h5*"))


def test_inputs_that_events_set_are_no_samples(tmp_path):
    """As from a CSV: the motion's column of such an input is refused."""
    run = tmp_path / "run.h5"
    refdyn("sim", TESTS / "models" / "events" / "relay.lua", "--until", 1, "-o", run)
    done = refdyn("sim", TESTS / "models" / "events" / "relay.lua", "--until", 1, "--inputs", run, "-o", tmp_path / "again.csv", status=1)
    assert done.stderr == f"{run}: inputs: column push: events of the model set this input; samples must not\n"
