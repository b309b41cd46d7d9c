"""Prints the suite as a table: error and cost of each case at one tolerance.

    REFDYN=../build/release/bin/refdyn /usr/bin/python3 suite_table.py [TOL [METHOD...]]
"""
import sys

from suite import CASES, METHODS, measure

if __name__ == "__main__":
    tol = float(sys.argv[1]) if len(sys.argv) > 1 else 1e-6
    methods = sys.argv[2:] or METHODS
    print(f"| case | what is extreme | method | error at tol {tol:.0e} | steps | CPU ms |\n|---|---|---|---|---|---|")
    for case in CASES:
        for method in methods:
            error, summary = measure(case, method, tol)
            print(f"| {case.name} | {case.extreme} | `{method}` | {error:.0e} | {summary['steps']:,} | "
                  f"{1e3 * summary['cpu_s']:.2g} |", flush=True)
