"""Prints the suite as a table: error and cost of each case at one tolerance.

    REFDYN=../build/release/bin/refdyn /usr/bin/python3 suite_table.py [TOL [METHOD...]]
"""
import sys

from suite import CASES, METHODS, measure


def row(*cells):
    print("|", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    tol = float(sys.argv[1]) if len(sys.argv) > 1 else 1e-6
    methods = sys.argv[2:] or METHODS
    is_one = len(methods) == 1
    columns = ["case", "what is extreme", *([] if is_one else ["method"]), f"error at tol {tol:.0e}", "steps", "CPU ms"]
    row(*columns)
    print("|" + "---|" * len(columns))
    for case in CASES:
        for method in methods:
            error, summary = measure(case, method, tol)
            row(case.name, case.extreme, *([] if is_one else [f"`{method}`"]), f"{error:.0e}", f"{summary['steps']:,}",
                f"{1e3 * summary['cpu_s']:.2g}")
