#!/usr/bin/python3
"""How many times faster than each peer. usage: ratios.py (WORKDIR | TIMES.csv) [--csv FILE]

WORKDIR is the peers' folder with out/results.jsonl, agree.jsonl, ca_gen.log, ca_compile.log and refdyn_build.jsonl. Of each program
the fastest variant counts that is accurate to 1e-9. Prints the table; writes what it is made of into FILE.
"""
import argparse
import csv
import json
import pathlib
import re
import sys

ACCURATE = 1e-9
ACCELERATIONS, ROWS, MASS, BUILD = "accelerations", "accelerations with two rows", "M and h", "generate and compile"
LEVELS = {"O2": "-O2", "O3n": "-O3 -march=native"}
KINDS = {  # what each program calls the variants of a quantity
    ACCELERATIONS: {"refdyn": r"qdd_free/", "casadi": r"(ca_fd|ca_ldl|pinca_fd)_", "pinocchio": r"fd_aba(_world)?/", "mujoco": r"fd_lean",
                    "exudyn": r"rhs_from", "pydy": r"fd_"},
    ROWS: {"refdyn": r"qdd/", "pinocchio": r"fd_constrained_3d"},
    MASS: {"refdyn": r"M_and_h", "casadi": r"(ca_mh|ca_lag|pinca_mh)_", "pinocchio": r"M_and_h", "mujoco": r"M_and_h", "pydy": r"M_and_h"},
}
TITLES = {"refdyn": "Refdyn", "casadi": "CasADi, C", "pinocchio": "Pinocchio", "mujoco": "MuJoCo", "exudyn": "Exudyn", "pydy": "PyDy",
          "best": "best of CasADi, Pinocchio, MuJoCo"}
TARGETS = {
    (ACCELERATIONS, "casadi"): {13: 2.2, 49: 2.7, 193: 3}, (ACCELERATIONS, "pinocchio"): {13: 10, 49: 7, 193: 15},
    (ACCELERATIONS, "mujoco"): {13: 7, 49: 12, 193: 75}, (ROWS, "pinocchio"): {13: 7, 49: 5, 193: 12},
    (MASS, "best"): {13: 1.5, 49: 2, 193: 2},
    **{(f"{BUILD}, {level}", "casadi"): {13: 1, 49: 5, 193: 50} for level in LEVELS.values()},
}
COLUMNS = ["quantity", "program", "variant", "n_rfe", "n", "us", "error", "adds", "muls", "divs", "funcs", "KiB"]


def read_lines(path):
    return [json.loads(line) for line in path.read_text().splitlines() if line.startswith("{")] if path.exists() else []


def error_key(program, what):
    """The name under which the accelerations of a variant were compared with the reference."""
    if program == "casadi":
        return "-".join(what.rsplit("_", 1))
    if program == "pinocchio":
        return "pinocchio_zyx" if "ZYX" in what else "pinocchio"
    if program == "refdyn":
        return what.replace("qdd_free/", "refdyn-")
    return program


def variants(quantity, program, results, errors):
    """Every variant's shortest time over the repeats, with its error where that was found."""
    found = {}
    for line in results:
        if line.get("peer") == program and "us" in line and re.match(KINDS[quantity][program], line["what"]):
            key = line["n_rfe"], line["what"]
            error = errors.get((error_key(program, line["what"]), line["n_rfe"])) if quantity != MASS else None
            if key not in found or line["us"] < found[key]["us"]:
                found[key] = {"quantity": quantity, "program": program, "variant": line["what"], "n_rfe": line["n_rfe"], "n": line["n"],
                              "us": line["us"], "error": error}
    return list(found.values())


def is_accurate(row):
    return row["error"] is None or row["error"] <= ACCURATE


def fastest(rows):
    """For each n the fastest accurate row, or the fastest where none is accurate."""
    best = {}
    for row in rows:
        known = best.get(row["n"])
        if known is None or (not is_accurate(row), row["us"]) < (not is_accurate(known), known["us"]):
            best[row["n"]] = row
    return [best[n] for n in sorted(best)]


def builds(level, refdyn, generated, compiled):
    """Generating and compiling the accelerations at one level of optimisation: the shortest of each program."""
    quantity = f"{BUILD}, {LEVELS[level]}"
    made = {(line["what"], line["n_rfe"]): line for line in generated}
    rows = []
    for line in refdyn:
        if re.match(rf"qdd_free/{level}(_fold)?$", line["what"]) and line["cc_s"] is not None:
            rows.append({"program": "refdyn", "variant": line["what"], "n_rfe": line["n_rfe"], "us": 1e6 * (line["gen_s"] + line["cc_s"]),
                         "KiB": line["C_KiB"]})
    for line in compiled:
        name = re.match(rf"compile_((?:pin)?ca_fd)_{level}$", line["what"])
        if name and line["ok"] and ("gen_" + name[1], line["n_rfe"]) in made:
            seconds = made["gen_" + name[1], line["n_rfe"]]["gen_s"] + line["cpu_s"]
            rows.append({"program": "casadi", "variant": name[1], "n_rfe": line["n_rfe"], "us": 1e6 * seconds, "KiB": line["C_KiB"]})
    rows = [{"quantity": quantity, "n": 3 * row["n_rfe"] + 1, "error": None, **row} for row in rows]
    return [row for program in ("refdyn", "casadi") for row in fastest([row for row in rows if row["program"] == program])]


def collect(work):
    """The rows of the CSV from the files of a working folder."""
    out = pathlib.Path(work) / "out"
    results, built = read_lines(out / "results.jsonl"), read_lines(out / "refdyn_build.jsonl")
    errors = {(line["agree"], line["n_rfe"]): float(line["norm"]) for line in read_lines(out / "agree.jsonl")}
    counts = {(line["what"], line["n_rfe"]): line for line in built}
    rows = [row for quantity, programs in KINDS.items() for program in programs
            for row in fastest(variants(quantity, program, results, errors))]
    for row in rows:
        if row["program"] == "refdyn":
            row.update({key: counts.get((row["variant"], row["n_rfe"]), {}).get(key) for key in ("adds", "muls", "divs", "funcs")})
    generated, compiled = read_lines(out / "ca_gen.log"), read_lines(out / "ca_compile.log")
    return rows + [row for level in LEVELS for row in builds(level, built, generated, compiled)]


def write_csv(rows, path):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows({**row, "us": f"{row['us']:.6g}"} for row in rows)


def read_csv(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        row.update({key: int(row[key]) for key in ("n_rfe", "n")}, us=float(row["us"]), error=float(row["error"]) if row["error"] else None)
    return rows


def by_program(rows):
    """{quantity: {program: {n: row}}} in the order of the rows, with the best of the peers for M and h."""
    table = {}
    for row in rows:
        table.setdefault(row["quantity"], {}).setdefault(row["program"], {})[row["n"]] = row
    peers = [table.get(MASS, {}).get(program, {}) for program in ("casadi", "pinocchio", "mujoco")]
    best = {n: min((peer[n] for peer in peers if n in peer), key=lambda row: row["us"]) for n in sorted(set().union(*peers))}
    if best:
        table[MASS]["best"] = best
    return table


def time_text(us):
    return f"{us:.3g} us" if us < 1e4 else f"{us / 1e6:.3g} s"


def ratio_cell(own, peer, target):
    if own is None or peer is None:
        return "-"
    doubt = "" if is_accurate(peer) else f", error {peer['error']:.0e}"
    ratio = peer["us"] / own["us"]
    aim = "" if target is None else f" {'>=' if ratio >= target else '<'} {target:g}"
    return f"{ratio:.2f}{aim} ({time_text(peer['us'])}{doubt})"


def own_cell(row):
    if row is None:
        return "-"
    return time_text(row["us"]) + ("" if row["error"] is None else f", error {row['error']:.0e}")


def ratio_table(rows):
    """Markdown: Refdyn's times, then for each peer how many times faster Refdyn is, the target after it, and the peer's time."""
    table, sizes = by_program(rows), sorted({row["n"] for row in rows})
    lines = ["| quantity | program | " + " | ".join(f"n = {n}" for n in sizes) + " |", "|---" * (len(sizes) + 2) + "|"]
    for quantity, programs in table.items():
        own = programs.get("refdyn", {})
        lines.append(f"| {quantity} | Refdyn | " + " | ".join(own_cell(own.get(n)) for n in sizes) + " |")
        for program, found in programs.items():
            if program != "refdyn":
                cells = [ratio_cell(own.get(n), found.get(n), TARGETS.get((quantity, program), {}).get(n)) for n in sizes]
                lines.append(f"| | {TITLES[program]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=pathlib.Path, help="the peers' working folder, or a CSV that --csv wrote")
    parser.add_argument("--csv", type=pathlib.Path, help="write the fastest variants there")
    given = parser.parse_args()
    if not given.source.exists():
        parser.error(f"no such file or folder: {given.source}")
    rows = collect(given.source) if given.source.is_dir() else read_csv(given.source)
    if given.csv:
        write_csv(rows, given.csv)
    print(ratio_table(rows))


if __name__ == "__main__":
    sys.exit(main())
