"""Writes one recording of a real rig anew: `python -m prb3r.proof.again SEED CASES CASE FOLDER [CLASS...]`.

SEED, CASES and CLASSES are those of the run.  The label, with what was concealed, is written to `<FOLDER>.truth.json`,
beside the folder.
"""

import json
import sys
from collections.abc import Collection
from pathlib import Path

from prb3r.proof.concealed.composition import drawn_design, flavours, requests
from prb3r.proof.concealed.folder import write_real_recording
from prb3r.proof.concealed.real import REAL_CLASSES, real_label


def write_case(seed: int, cases: int, case: int, folder: Path, classes: Collection[str] = REAL_CLASSES) -> None:
    """Write the folder of recording `case` of a run of `cases` recordings of some classes, and its label beside it."""
    kinds = flavours(cases, classes)
    designs = [drawn_design((seed, k, flavour)) for k, flavour in enumerate(kinds)]
    request = next(candidate for candidate in requests(seed, cases, designs, classes) if candidate.case == case)
    label = real_label(request, designs[request.design])
    write_real_recording(designs[request.design], label, folder)
    truth = folder.with_name(folder.name + ".truth.json")
    truth.write_text(json.dumps(label.plain(), indent=1, default=float))


if __name__ == "__main__":
    seed, cases, case = map(int, sys.argv[1:4])
    write_case(seed, cases, case, Path(sys.argv[4]), sys.argv[5:] or REAL_CLASSES)
