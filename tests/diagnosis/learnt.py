"""What was learnt from the rig with a weak plate, in a folder with designs and loads to predict, and the command."""

import pandas as pd
from click.testing import CliRunner
from diagnosis.simulated import PROGRAM, diagnosed, manipulator, steps_of

from prb3r.cli import main
from prb3r.diagnosis.result.files import write_record
from prb3r.model.files.toml import toml_text

STEPS = pd.DataFrame([row for name in PROGRAM for row in steps_of(name)])


def write_learnt(folder):
    """The folder with the record of the diagnosis, the same rig, one of more plates, and steps."""
    write_record(diagnosed(), folder)
    (folder / "same.toml").write_text(toml_text(manipulator()))
    longer = manipulator()
    longer["segment"] = [segment | {"plates": 4} for segment in longer["segment"]]
    (folder / "longer.toml").write_text(toml_text(longer))
    STEPS.to_csv(folder / "steps.csv", index=False)
    return folder


def run(*arguments):
    """The command `predict`."""
    return CliRunner().invoke(main, ["predict", *map(str, arguments)])
