"""What run measured, as rows: as CSV, as tables and as a figure. The pages' tables and the figure follow from generated/times.csv."""
import csv
import os
import pathlib
import re
import subprocess

SOURCE = pathlib.Path(__file__).resolve().parents[3]
GENERATED, BENCHMARKS = SOURCE / "generated", SOURCE / "docs" / "benchmarks.md"
ACCURATE = 1e-9  # relative deviation from 60 digits, up to which the fastest variant of a program counts
ACCELERATIONS, ROWS, MASS, BUILD, BATCH = "accelerations", "accelerations, tip held", "M and h", "generate and compile", "motions in a batch"
QUANTITIES = {"accelerations": ACCELERATIONS, "rows": ROWS, "mass": MASS, "d_accelerations": "derivatives of accelerations", "d_rows": "derivatives of accelerations, tip held",
              "inverse": "inverse dynamics", "d_inverse": "derivatives of inverse dynamics"}
PROGRAMS = {"refdyn": "Refdyn", "casadi": "CasADi, C", "pinocchio": "Pinocchio", "mujoco": "MuJoCo", "best": "best of CasADi, Pinocchio, MuJoCo"}
LEVELS = {"O2": "-O2", "O3n": "-O3 -march=native"}
TARGETS = {  # how many times faster Refdyn should be
    (ACCELERATIONS, "casadi"): {13: 2.2, 49: 2.7, 193: 3}, (ACCELERATIONS, "pinocchio"): {13: 10, 49: 7, 193: 15},
    (ACCELERATIONS, "mujoco"): {13: 7, 49: 12, 193: 75}, (ROWS, "pinocchio"): {13: 7, 49: 5, 193: 12},
    (MASS, "best"): {13: 1.5, 49: 2, 193: 2},
    **{(f"{BUILD}, {level}", "casadi"): {13: 1, 49: 5, 193: 50} for level in LEVELS.values()},
}
KEYS = ["program", "quantity", "variant", "n_rfe"]  # of one measurement
COUNTS = ["adds", "muls", "divs", "funcs"]
COLUMNS = ["quantity", "program", "variant", "n_rfe", "n", "us", "error", *COUNTS, "KiB"]
PANELS = [ACCELERATIONS, MASS, ROWS]
COLOURS = {"refdyn": "#c02020", "casadi": "#2060c0", "pinocchio": "#208040", "mujoco": "#c08000"}


def is_accurate(row):
    return row["error"] is None or row["error"] <= ACCURATE


def fastest(rows):
    """For each program and n the fastest accurate row, or the fastest if none is accurate."""
    best = {}
    for row in rows:
        key = row["program"], row["n"]
        known = best.get(key)
        if known is None or (not is_accurate(row), row["us"]) < (not is_accurate(known), known["us"]):
            best[key] = row
    order = list(PROGRAMS)
    return sorted(best.values(), key=lambda row: (order.index(row["program"]), row["n"]))


def call_rows(times, errors, records):
    """The rows of the quantities. times: lines of the timing programs, of which the shortest time of each variant counts."""
    counts = {(record["quantity"], record["variant"], record["n_rfe"]): record for record in records if record["program"] == "refdyn"}
    found = {}
    for line in times:
        program, quantity, variant, n_rfe = key = tuple(line[name] for name in KEYS)
        row = found.setdefault(key, {**line, "quantity": QUANTITIES[quantity], "error": errors[key]})
        row["us"] = min(row["us"], line["us"])
        if program == "refdyn":
            row.update({name: counts[quantity, variant, n_rfe][name] for name in COUNTS})
    return [row for title in QUANTITIES.values() for row in fastest([row for row in found.values() if row["quantity"] == title])]


def level_rows(times, errors, records):
    """The rows of the quantities by the level of optimisation, which is the same for all programs."""
    found = []
    for level, options in LEVELS.items():
        rows = call_rows([line for line in times if re.search(rf"(^|-){level}(_|$)", line["variant"])], errors, records)
        found += [{**row, "quantity": f"{row['quantity']}, {options}"} for row in rows]
    return found


def build_rows(records):
    """CPU time of generating and compiling the accelerations, by the level of optimisation."""
    found = []
    for level, options in LEVELS.items():
        rows = [{"quantity": f"{BUILD}, {options}", "program": record["program"], "variant": record["variant"], "n_rfe": record["n_rfe"],
                 "n": 3 * record["n_rfe"] + 1, "us": 1e6 * record["seconds"], "error": None, "KiB": record["KiB"]}
                for record in records if record["quantity"] == "accelerations" and record["level"] == level and record["seconds"] is not None]
        found += fastest(rows)
    return found


def write_csv(rows, path):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, restval="", extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows({**row, "us": f"{row['us']:.6g}", "error": "" if row["error"] is None else f"{row['error']:.1e}"} for row in rows)


def read_csv(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        row.update({key: int(row[key]) for key in ("n_rfe", "n")}, us=float(row["us"]), error=float(row["error"]) if row["error"] else None)
    return rows


def by_program(rows):
    """{quantity: {program: {n: row}}} in the order of the rows, with the best of the other programs for M and h; without batches."""
    table = {}
    for row in rows:
        if row["quantity"].startswith(BATCH):
            continue
        table.setdefault(row["quantity"], {}).setdefault(row["program"], {})[row["n"]] = row
    peers = [table.get(MASS, {}).get(program, {}) for program in ("casadi", "pinocchio", "mujoco")]
    best = {n: min((peer[n] for peer in peers if n in peer), key=lambda row: row["us"]) for n in sorted(set().union(*peers))}
    if best:
        table[MASS]["best"] = best
    return table


def time_text(us):
    return f"{us:.3g} us" if us < 1e4 else f"{us / 1e6:.3g} s"


def own_cell(row):
    if row is None:
        return "-"
    return time_text(row["us"]) + ("" if row["error"] is None else f", error {row['error']:.0e}")


def ratio_cell(own, peer, target):
    if own is None or peer is None:
        return "-"
    ratio = peer["us"] / own["us"]
    aim = "" if target is None else f" {'>=' if ratio >= target else '<'} {target:g}"
    doubt = "" if is_accurate(peer) else f", error {peer['error']:.0e}"
    return f"{ratio:.2f}{aim} ({time_text(peer['us'])}{doubt})"


def ratio_table(rows, targets=TARGETS):
    """Markdown: Refdyn's times, then for each other program how many times faster Refdyn is, the target, and the time of the other."""
    table = by_program(rows)
    sizes = sorted({n for programs in table.values() for found in programs.values() for n in found})
    lines = ["| quantity | program | " + " | ".join(f"n = {n}" for n in sizes) + " |", "|---" * (len(sizes) + 2) + "|"]
    for quantity, programs in table.items():
        own = programs.get("refdyn", {})
        lines.append(f"| {quantity} | Refdyn | " + " | ".join(own_cell(own.get(n)) for n in sizes) + " |")
        for program, found in programs.items():
            if program != "refdyn":
                cells = [ratio_cell(own.get(n), found.get(n), targets.get((quantity, program), {}).get(n)) for n in sizes]
                lines.append(f"| | {PROGRAMS[program]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def batch_table(rows):
    """Markdown: motions a second at the quickest setting of each program."""
    lines = ["| motions | program | setting | error m | motions a second | times faster |", "|---|---|---|---|---|---|"]
    found = {}
    for row in rows:
        if row["quantity"].startswith(BATCH):
            found.setdefault(row["quantity"].removeprefix(BATCH + ", "), {})[row["program"]] = row
    for scene, programs in found.items():
        for program, row in programs.items():
            faster = f"{row['us'] / programs['refdyn']['us']:.3g}" if program != "refdyn" else ""
            lines.append(f"| {scene} | {PROGRAMS[program]} | {row['variant']} | {row['error']:.1e} | {shown(1e6 / row['us'])} | {faster} |")
    return "\n".join(lines)


def shown(value, digits=3):
    """A number with its leading digits, large ones in full."""
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text else text


def cells(found, sizes, text):
    return " | ".join(text(found[n]) if n in found else "" for n in sizes)


def time_cell(row):
    doubt = "" if is_accurate(row) else " *"
    return shown(row["us"]) + doubt


def build_cell(row):
    return f"{shown(row['us'] / 1e6, 2)} s, {shown(float(row['KiB']))} KiB"


def operations(row):
    return " ".join(row[key] for key in ("adds", "muls", "divs", "funcs"))


def time_table(rows):
    """Markdown: for each quantity Refdyn's operations, then the time of each program."""
    found = by_program(rows)
    sizes = sorted({n for programs in found.values() for by_size in programs.values() for n in by_size})
    lines = ["| | n_rfe = " + " | ".join(str((n - 1) // 3) for n in sizes) + " |", "|---" * (len(sizes) + 1) + "|",
             "| | n = " + " | ".join(map(str, sizes)) + " |"]
    for quantity, programs in found.items():
        is_build = quantity.startswith(BUILD)
        lines.append(f"| **{quantity}** |" + " |" * len(sizes))
        if not is_build:
            lines.append(f"| operations of Refdyn | {cells(programs['refdyn'], sizes, operations)} |")
        for program, by_size in programs.items():
            if program != "best":
                lines.append(f"| {PROGRAMS[program]} | {cells(by_size, sizes, build_cell if is_build else time_cell)} |")
    return "\n".join(lines)


def plot_lines(quantity, programs, first):
    """gnuplot's commands for one panel: a line of points for each program."""
    blocks, curves = [], []
    for number, (program, found) in enumerate(programs.items()):
        if program != "best":
            name = f"$data_{first + number}"
            blocks.append(f"{name} << end\n" + "".join(f"{n} {row['us']:.6g}\n" for n, row in found.items()) + "end\n")
            width = 2 if program == "refdyn" else 1
            curves.append(f"{name} with linespoints title '{PROGRAMS[program]}' lc rgb '{COLOURS[program]}' lw {width} pt 7 ps 0.4")
    return "".join(blocks) + f"set title '{quantity}'\nplot " + ", ".join(curves) + "\n"


def draw(rows, path):
    """Time against n, both logarithmic, one panel a quantity."""
    found = by_program(rows)
    script = ("set terminal svg size 1080,380 font 'sans,12' background 'white'\n"
              "set multiplot layout 1,3\nset logscale xy\nset grid lc rgb '#dddddd'\nset key top left reverse Left\n"
              "set xlabel 'coordinates n'\nset xrange [3:250]\nset yrange [0.01:2000]\nset xtics (4, 13, 25, 49, 97, 193)\n"
              "set ylabel 'time of one call [us]'\n")
    for number, quantity in enumerate(PANELS):
        script += plot_lines(quantity, found.get(quantity, {}), 10 * number)
    drawn = subprocess.run(["gnuplot"], input=script + "unset multiplot\n", check=True, capture_output=True, text=True,
                           env={**os.environ, "LC_ALL": "C"})
    path.write_text(re.sub(r"\s*<desc>.*?</desc>", "", drawn.stdout, flags=re.S))


def between(mark, page, text):
    """Replaces what stands between the comments `mark` and `end of mark` of a page."""
    marks = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- end of {mark} -->\n)", re.S)
    page.write_text(marks.sub(lambda found: found[1] + text + "\n" + found[2], page.read_text()))


def publish(folder=GENERATED, benchmarks=BENCHMARKS):
    """Writes the tables and the figure that FOLDER/times.csv gives: equal numbers give equal files, byte for byte. Needs gnuplot."""
    rows = read_csv(folder / "times.csv")
    between("times", folder / "README.md", time_table(rows))
    draw(rows, folder / "times.svg")
    between("ratios", benchmarks, ratio_table(rows, {}) + "\n\n" + batch_table(rows))
