"""The public functions of `prb3r` in Python; each takes files or objects and returns a result that can be plotted,
shown in a notebook and written to files."""
