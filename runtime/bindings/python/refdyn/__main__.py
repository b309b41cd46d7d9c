"""Runs the program: `python -m refdyn`."""
from .launcher import main

main()
