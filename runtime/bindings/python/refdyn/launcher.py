"""Replaces this process by the program. It imports little, so that `refdyn --version` takes hardly longer than Python's start."""
import os
import sys

PROGRAM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", "refdyn")


def main() -> None:
    """Runs the command `refdyn`."""
    os.execv(PROGRAM, ["refdyn", *sys.argv[1:]])
