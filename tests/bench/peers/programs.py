"""The other programs: their environment, C by CasADi, and the comparison of all values before anything is timed."""
import json
import os
import pathlib
import subprocess
import sys
import sysconfig
import time

import chain
import emitted

# Of these versions, since interfaces of C++ headers change. Packages with `cmeel` have the headers and libraries of C++ projects.
PACKAGES = ["pin==4.1.0", "cmeel-eigen==3.4.1", "casadi==3.8.2", "mujoco==4.0.0", "numpy", "mpmath"]
SETTINGS = ["-DNDEBUG", "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
            "-DBOOST_FUSION_INVOKE_MAX_ARITY=12"]  # of the Boost headers, as Pinocchio was compiled
LARGEST_JACOBIAN = 4  # elements: beyond, CasADi's derivatives take too long to compile
EQUATIONS = [emitted.HERE / name for name in ("chain.py", "dynamics.py")]
WORST = 1e-6  # relative deviation above which a program does not compute the same


def enter(work):
    """Starts this program again with the Python of the environment in the working folder, which is made when it is not there."""
    folder = work / "venv"
    python = folder / "bin" / "python"
    if sys.prefix == str(folder):
        return
    installed = folder / "packages.json"
    if not installed.exists() or json.loads(installed.read_text()) != PACKAGES:
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES], check=True)
        installed.write_text(json.dumps(PACKAGES))
    sys.stdout.flush()
    os.execv(python, [str(python), *sys.argv])


def compile_program(work, compiler, name, *options, level=""):
    """Compiles a program of this folder into the working folder, unless it is newer than its sources."""
    source, program = next(emitted.HERE.glob(name + ".c*")), work / (name + level)
    newest = max(path.stat().st_mtime for path in [source, *emitted.HERE.glob("*.h*")])
    if not program.exists() or program.stat().st_mtime < newest:
        print(f"compiling {source.name} {level}", flush=True)
        subprocess.run([compiler, "-I", emitted.HERE, source, "-o", program, *options], check=True)


def pinocchio_options():
    headers = f"{sysconfig.get_path('purelib')}/cmeel.prefix/include"
    return ["-std=c++17", "-w", *SETTINGS, "-isystem", headers, "-isystem", f"{headers}/eigen3"]


def compile_pinocchio(work):
    for level, options in emitted.LEVELS.items():
        compile_program(work, "g++", "time_pinocchio", *options, f'-DLEVEL="{level}"', *pinocchio_options(), level=f"_{level}")


def compile_all(work):
    site = sysconfig.get_path("purelib")
    compile_pinocchio(work)
    library = str(next((pathlib.Path(site) / "mujoco").glob("libmujoco.so*")))
    compile_program(work, "gcc", "time_mujoco", "-O3", "-march=native", "-I", f"{site}/mujoco/include", library, f"-Wl,-rpath,{site}/mujoco")
    compile_program(work, "gcc", "time_casadi", "-O2", "-ldl")
    compile_program(work, "g++", "generate_casadi", "-O1", "-march=native", *pinocchio_options(), "-isystem", f"{site}/casadi/include", f"-L{site}/casadi", "-lcasadi",
                    f"-Wl,-rpath,{site}/casadi")


def expressions(quantity, n_rfe):
    """Inputs and outputs of one quantity as expressions of CasADi."""
    import casadi
    import dynamics
    links, n = chain.links(n_rfe), 3 * n_rfe + 1
    kind = dynamics.Kind(casadi.SX, casadi.sin, casadi.cos)
    q, qd, last = (casadi.SX.sym(name, n) for name in ("q", "qd", "last"))
    rows = [casadi.vertsplit(vector) for vector in (q, qd, last)]
    if quantity == "mass":
        found = dynamics.Chain(links, kind, rows[0])
        outputs = [found.mass_matrix(), found.inverse(rows[1], [0] * n, 0)]
    else:
        outputs = [(dynamics.inverse if quantity.endswith("inverse") else dynamics.forward)(links, kind, *rows)]
    outputs = [casadi.densify(casadi.vertcat(*output)) for output in outputs]
    if quantity.startswith("d_"):
        by = [q, qd, last] if quantity == "d_inverse" else [q, qd]
        outputs = [casadi.densify(casadi.jacobian(outputs[0], each)) for each in by]
    return [q, qd, last], outputs


def generate(work, quantity, n_rfe):
    """casadi/own_QUANTITY_N.c from the recursions of this folder: a record of what that took."""
    import casadi
    begin = time.process_time()
    function = casadi.Function("f", *expressions(quantity, n_rfe))
    generator = casadi.CodeGenerator(f"own_{quantity}_{n_rfe}.c")
    generator.add(function)
    generator.generate(f"{work}/casadi/")
    return {"quantity": quantity, "variant": "own", "n_rfe": n_rfe, "seconds": time.process_time() - begin}


def build_casadi(work, n_rfe):
    """Generates and compiles all of CasADi's C for one n_rfe: records like those of emitted.build."""
    done = subprocess.run([work / "generate_casadi", str(n_rfe)], cwd=work, check=True, stdout=subprocess.PIPE, text=True)
    made = [json.loads(line) for line in done.stdout.splitlines()]
    made += [generate(work, quantity, n_rfe) for quantity in emitted.QUANTITIES
             if not quantity.endswith("rows") and (n_rfe <= LARGEST_JACOBIAN or not quantity.startswith("d_"))]
    records = []
    for record in made:
        source = work / "casadi" / f"{record['variant']}_{record['quantity']}_{n_rfe}.c"
        for level in emitted.LEVELS:
            library, variant = source.with_suffix(f".{level}.so"), f"{record['variant']}-{level}"
            taken = emitted.compile_c([source], level, library)
            records.append({"program": "casadi", "quantity": record["quantity"], "variant": variant, "level": level, "n_rfe": n_rfe,
                            "seconds": None if taken is None else record["seconds"] + taken, "KiB": round(source.stat().st_size / 1024, 1),
                            "command": None if taken is None else ["time_casadi", n_rfe, str(library), record["quantity"], variant]})
    return records


def build(work, n_rfe):
    """All records for one n_rfe, from files if nothing has changed."""
    print(f"generating and compiling C, n_rfe = {n_rfe}", flush=True)
    (work / "casadi").mkdir(exist_ok=True)
    casadi = [work / "generate_casadi", *EQUATIONS]
    return [*emitted.kept(work / "refdyn" / f"records{n_rfe}.json", emitted.SOURCES, lambda: emitted.build(work, n_rfe)),
            *emitted.kept(work / "casadi" / f"records{n_rfe}.json", casadi, lambda: build_casadi(work, n_rfe))]


def commands(records, sizes):
    """What measures everything: the timing programs with their arguments."""
    return [record["command"] for record in records if record["command"]] + [[name, n_rfe] for n_rfe in sizes for name in ("time_pinocchio_O3n", "time_mujoco")]


def build_derivatives(work, n_rfe):
    """Refdyn's records of derivatives for one n_rfe."""
    return emitted.kept(work / "refdyn" / f"derivatives{n_rfe}.json", emitted.SOURCES, lambda: emitted.build(work, n_rfe, emitted.DERIVATIVES))


def derivative_commands(records, sizes):
    return [record["command"] for record in records if record["command"]] + [
        [f"time_pinocchio_{level}", n_rfe, "derivatives"] for n_rfe in sizes for level in emitted.LEVELS]


def vectors(path, program, quantity, n, directions):
    """The values of one file as vectors, matrices times `directions`; CasADi and Pinocchio write columns, and one triangle of M."""
    import numpy
    values = numpy.fromfile(path)
    matrices = {"accelerations": 0, "rows": 0, "mass": 1, "d_accelerations": 2, "d_rows": 2, "inverse": 0, "d_inverse": 3}[quantity]
    if program == "casadi" and quantity == "mass":
        triangle = numpy.zeros((n, n))
        triangle.T[numpy.tril_indices(n)] = values[:-n]
        values = numpy.concatenate([triangle.T.ravel(), values[-n:]])
    found = list(values[:matrices * n * n].reshape(matrices, n, n))
    if program in ("casadi", "pinocchio"):
        found = [matrix.T for matrix in found]
        if quantity == "mass" or (quantity == "d_inverse" and program == "pinocchio"):
            found[-1] = numpy.triu(found[-1]) + numpy.triu(found[-1], 1).T
    rest = [values[matrices * n * n:]] if quantity in ("accelerations", "rows", "mass", "inverse") else []
    if program == "refdyn" and quantity == "mass":
        rest = [-rest[0]]  # h is minus the bias forces
    return [matrix @ directions for matrix in found] + rest


def compare(work, sizes):
    """{(program, quantity, variant, n_rfe): relative deviation from the values of 60 digits}, in the norm of each vector."""
    import dynamics
    import numpy
    errors = {}
    for n_rfe in sizes:
        reference = emitted.kept(work / "models" / f"reference{n_rfe}.json", EQUATIONS, lambda n_rfe=n_rfe: dynamics.reference(n_rfe))
        directions = numpy.array(dynamics.directions(n_rfe))
        for path in sorted((work / "values").glob(f"*-{n_rfe}")):
            program, quantity, variant = path.name.removesuffix(f"-{n_rfe}").split("-", 2)
            found = vectors(path, program, quantity, 3 * n_rfe + 1, directions)
            errors[program, quantity, variant, n_rfe] = max(float(numpy.linalg.norm(one - right) / numpy.linalg.norm(right))
                                                            for one, right in zip(found, map(numpy.array, reference[quantity]), strict=True))
    return errors


def state_deviations(errors):
    """Prints the largest deviation of the variant of each program that comes closest; stops where one does not compute the same."""
    for quantity in emitted.QUANTITIES:
        best = {}
        for (program, found, _, n_rfe), error in errors.items():
            if found == quantity:
                best[program, n_rfe] = min(error, best.get((program, n_rfe), float("inf")))
        if not best:
            continue
        (program, n_rfe), largest = max(best.items(), key=lambda item: item[1])
        print(f"{quantity}: all programs agree with 60 digits, largest relative deviation {largest:.1g} ({program}, n_rfe = {n_rfe})", flush=True)
        if not largest <= WORST:
            raise SystemExit(f"{program}: {quantity} with n_rfe = {n_rfe} deviates by {largest:.1g}, above {WORST:g}")
