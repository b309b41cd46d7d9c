"""`python -m refdyn`: the program."""
from .program import main

main()
