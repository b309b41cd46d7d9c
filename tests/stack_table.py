"""Prints a table that compares, over all models, the stack that functions use with their bounds.

    REFDYN=../build/release/bin/refdyn /usr/bin/python3 stack_table.py [TARGET...]

It takes half an hour. TARGET is a key of TARGETS in stack.py; without any, the table has all of them.
"""
import concurrent.futures
import pathlib
import statistics
import sys
import tempfile

from program import all_models, models_of_tests
from stack import LEVELS, TARGETS, compare, emit

LARGE = 500  # bytes; the bounds of smaller functions consist mostly of the bytes that every bound includes


def measure(target, model):
    real, words = TARGETS[target]
    with tempfile.TemporaryDirectory() as folder:
        emit(model, pathlib.Path(folder), real)
        return compare(pathlib.Path(folder), words)


def row(*cells):
    print("|", " | ".join(map(str, cells)), "|", flush=True)


if __name__ == "__main__":
    models = all_models() + models_of_tests()
    columns = ["", "functions", *(f"{level}: most of the bound" for level in LEVELS), "above the bound", "bound over the use, at most", "median"]
    row(*columns)
    print("|" + "---|" * len(columns))
    for target in sys.argv[1:] or TARGETS:
        with concurrent.futures.ThreadPoolExecutor() as workers:
            found = [function for functions in workers.map(lambda model: measure(target, model), models) for function in functions]
        ratios = [bound / max(used) for _, bound, used in found if max(used) > LARGE]
        row(target, len(found), *(f"{max(used[i] / bound for _, bound, used in found):.3f}" for i in range(len(LEVELS))),
            sum(max(used) > bound for _, bound, used in found), f"{max(ratios):.2f}", f"{statistics.median(ratios):.2f}")
