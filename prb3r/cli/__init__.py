"""The command line: only this package and `progress.py` write to a terminal.

Commands print one closing summary to stdout; progress and remarks go to stderr.
A command imports what it needs when it runs, so that `prb3r --help` loads no libraries but click.
"""

import click

from prb3r import __version__
from prb3r.cli.diagnoses import diagnose_command, predict_command
from prb3r.cli.formats import check_command, schema_command
from prb3r.cli.group import Commands
from prb3r.cli.manipulators import reach_command, solve_command
from prb3r.cli.measurements import bench_command, prove_command
from prb3r.cli.studies import compare_command, report_command, run_command
from prb3r.runs.threads import one_thread_unless_asked


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Design studies for cable-driven continuum manipulators."""
    one_thread_unless_asked()


for _command in (
    run_command,
    solve_command,
    reach_command,
    compare_command,
    report_command,
    diagnose_command,
    predict_command,
    check_command,
    schema_command,
    bench_command,
    prove_command,
):
    main.add_command(_command)
