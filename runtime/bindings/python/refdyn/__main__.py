"""Runs the program: `python -m refdyn`."""
from .program import main

main()
