"""`python -m prb3r`."""

from prb3r.cli import main

main(prog_name="prb3r")
