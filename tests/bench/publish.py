#!/usr/bin/python3
"""Draws generated/times.csv and puts its table into generated/README.md. usage: publish.py [FOLDER]

Reads FOLDER/times.csv (FOLDER is generated/ unless given), writes FOLDER/times.svg and what stands between the two comments
"times" of FOLDER/README.md. Equal numbers give equal files, byte for byte. Needs gnuplot.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys

import ratios

GENERATED = pathlib.Path(__file__).resolve().parent.parent.parent / "generated"
TIMES = GENERATED / "times.csv"
PANELS = [ratios.ACCELERATIONS, ratios.MASS, ratios.ROWS]
COLOURS = {"refdyn": "#c02020", "casadi": "#2060c0", "pinocchio": "#208040", "mujoco": "#c08000", "exudyn": "#7050a0", "pydy": "#707070"}
MARKS = re.compile(r"(<!-- times -->\n).*?(<!-- end of times -->\n)", re.S)


def shown(value, digits=3):
    """A number with its leading digits, large ones in full."""
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text else text


def cells(found, sizes, text):
    return " | ".join(text(found[n]) if n in found else "" for n in sizes)


def time_cell(row):
    doubt = "" if ratios.is_accurate(row) else " *"
    return shown(row["us"]) + doubt


def build_cell(row):
    return f"{shown(row['us'] / 1e6, 2)} s, {shown(float(row['KiB']))} KiB"


def operations(row):
    return " ".join(row[key] for key in ("adds", "muls", "divs", "funcs"))


def table(rows):
    """Markdown: for each quantity Refdyn's operations, then the time of each program."""
    sizes = sorted({row["n"] for row in rows})
    lines = ["| | n_rfe = " + " | ".join(str((n - 1) // 3) for n in sizes) + " |", "|---" * (len(sizes) + 1) + "|",
             "| | n = " + " | ".join(map(str, sizes)) + " |"]
    for quantity, programs in ratios.by_program(rows).items():
        is_build = quantity.startswith(ratios.BUILD)
        lines.append(f"| **{quantity}** |" + " |" * len(sizes))
        if not is_build:
            lines.append(f"| operations of Refdyn | {cells(programs['refdyn'], sizes, operations)} |")
        for program, found in programs.items():
            if program != "best":
                lines.append(f"| {ratios.TITLES[program]} | {cells(found, sizes, build_cell if is_build else time_cell)} |")
    return "\n".join(lines) + "\n"


def plot_lines(quantity, programs, first):
    """gnuplot's commands for one panel: a line of points for each program."""
    blocks, curves = [], []
    for number, (program, found) in enumerate(programs.items()):
        if program != "best":
            name = f"$data_{first + number}"
            blocks.append(f"{name} << end\n" + "".join(f"{n} {row['us']:.6g}\n" for n, row in found.items()) + "end\n")
            width = 2 if program == "refdyn" else 1
            curves.append(f"{name} with linespoints title '{ratios.TITLES[program]}' lc rgb '{COLOURS[program]}' lw {width} pt 7 ps 0.4")
    return "".join(blocks) + f"set title '{quantity}'\nplot " + ", ".join(curves) + "\n"


def draw(rows, path):
    """Time against n, both logarithmic, one panel a quantity."""
    found = ratios.by_program(rows)
    script = ("set terminal svg size 1080,380 font 'sans,12' background 'white'\n"
              "set multiplot layout 1,3\nset logscale xy\nset grid lc rgb '#dddddd'\nset key top left reverse Left\n"
              "set xlabel 'coordinates n'\nset xrange [3:250]\nset yrange [0.01:2000]\nset xtics (4, 13, 25, 49, 97, 193)\n"
              "set ylabel 'time of one call [us]'\n")
    for number, quantity in enumerate(PANELS):
        script += plot_lines(quantity, found.get(quantity, {}), 10 * number)
    drawn = subprocess.run(["gnuplot"], input=script + "unset multiplot\n", check=True, capture_output=True, text=True,
                           env={**os.environ, "LC_ALL": "C"})
    path.write_text(re.sub(r"\s*<desc>.*?</desc>", "", drawn.stdout, flags=re.S))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=pathlib.Path, default=GENERATED, help="folder of times.csv and README.md (generated/)")
    folder = parser.parse_args().folder
    if not (folder / "times.csv").exists() or not (folder / "README.md").exists():
        parser.error(f"no times.csv or no README.md in {folder}")
    publish(folder)


def publish(folder):
    rows = ratios.read_csv(folder / "times.csv")
    readme = folder / "README.md"
    readme.write_text(MARKS.sub(lambda marks: marks[1] + table(rows) + marks[2], readme.read_text()))
    draw(rows, folder / "times.svg")


if __name__ == "__main__":
    sys.exit(main())
