"""Writes one recording of a run anew: `python -m prb3r.proof.again SEED CASES CASE FOLDER [CLASS...]`.

SEED, CASES and CLASSES are those of the run (no class: all).  The label, with what was concealed, is written to
`<FOLDER>.truth.json`, beside the folder.
"""

import json
from collections.abc import Collection
from pathlib import Path

from prb3r.proof.arguments import of_a_run
from prb3r.proof.concealed.composition import drawn_design, flavours, labels_of, requests
from prb3r.proof.concealed.folder import write_real_recording
from prb3r.proof.concealed.recordings import recording_of
from prb3r.proof.settings import SETTINGS
from prb3r.recording.writing import write_again


def write_case(seed: int, cases: int, case: int, folder: Path, classes: Collection[str] = ()) -> None:
    """Write the folder of recording `case` of a run of `cases` recordings of some classes (empty: all), and its label
    beside it.

    Raises
    ------
    ValueError
        Where the run has no such recording, or the rig has no equilibrium at some step.
    RuntimeError
        Where no rig with equilibria is found.
    """
    if not 0 <= case < cases:
        raise ValueError(f"there is no recording {case}: a run of {cases} has 0 to {cases - 1}")
    designs = [drawn_design((seed, k, flavour)) for k, flavour in enumerate(flavours(cases, classes))]
    request = next(candidate for candidate in requests(seed, cases, designs, classes) if candidate.case == case)
    design = designs[request.design]
    (label,) = labels_of((design, [request]))
    if design.flavour.is_real:
        write_real_recording(design, label, folder)
    else:
        write_again(recording_of(design, label), folder)
    truth = folder.with_name(folder.name + ".truth.json")
    truth.write_text(json.dumps(label.plain(), indent=1, default=float))


if __name__ == "__main__":
    asked = of_a_run(str(__doc__), SETTINGS.population.shares, case=True)
    write_case(asked.seed, asked.cases, asked.case, Path(asked.folder), asked.classes)
