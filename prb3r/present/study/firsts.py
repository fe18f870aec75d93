"""States of manipulators, packed into few numbers, by which a page draws the case or design that a reader points at."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.inverse.target import COORDINATES
from prb3r.model.manipulator import Manipulator
from prb3r.present import style
from prb3r.present.spots import LAST
from prb3r.present.study.shapes import straight
from prb3r.runs.provenance import read_manifest
from prb3r.runs.store import read_some

PackedState = tuple[list[int], str]
"""x, y (0.1 mm) and angle (mrad) of every disk in turn, and the tensions in words."""


def designs_standing(
    firsts: Mapping[str, tuple[Path, int]], designs: Sequence[str]
) -> tuple[dict[str, PackedState], float]:
    """The last state of each design's first case, by `number:-1`, for studies that keep the states of all disks.

    Parameters
    ----------
    firsts : folder and number of the first case, by the design's name.
    designs : names of the designs, in the order of their numbers.

    Returns
    -------
    The states, and half the height of a disk, mm, the largest of all studies.
    """
    states: dict[str, PackedState] = {}
    half = 0.0
    for folder in dict.fromkeys(folder for folder, _ in firsts.values()):
        manifest = read_manifest(folder) or {}
        study, path = manifest.get("study", {}), folder / "states.parquet"
        if not path.exists() or study.get("cloud") or study.get("state_disks") is not None:
            continue
        half = max(half, disk_half(Manipulator.model_validate(manifest["manipulator"])))
        numbers = {case: k for k, name in enumerate(designs) for at, case in [firsts[name]] if at == folder}
        kept = read_some(path, "case_id", numbers).to_pandas()
        stood = dict(stored_states(kept, {(case, LAST) for case in numbers}))
        states |= {f"{k}:{LAST}": stood[key] for case, k in numbers.items() if (key := f"{case}:{LAST}") in stood}
    return states, round(half, 2)


def disk_half(manipulator: Manipulator) -> float:
    """Half the height of a disk as it is drawn, mm."""
    return 1e3 * float(np.ptp(straight(manipulator).disks[0, :, 1])) / 2


def stored_states(states: pd.DataFrame, wanted: Iterable[tuple[int, int]]) -> Iterator[tuple[str, PackedState]]:
    """`case:step` and state of each `wanted` pair (case, step), as far as the table `states` has an equilibrium there.

    The table holds all disks; `LAST` stands for the last step of a case and stays in the name.
    """
    last = states.groupby("case_id")["step"].max()
    asked: dict[tuple[int, int], list[int]] = {}
    for case, step in wanted:
        asked.setdefault((case, last.get(case, LAST) if step == LAST else step), []).append(step)
    keys = list(zip(states["case_id"], states["step"], strict=True))
    some = states[[key in asked for key in keys]]
    cables = [name for name in states if name.startswith("cable_")]
    for (case, step), state in some.sort_values("disk").groupby(["case_id", "step"]):
        places = state[list(COORDINATES)].to_numpy(float)
        if np.isfinite(places).all():
            named = {name.removeprefix("cable_").removesuffix("_n"): float(state[name].iloc[0]) for name in cables}
            for name in asked[case, step]:
                yield f"{case}:{name}", (packed_state(places), tensions_in_words(named))


def packed_state(places: np.ndarray) -> list[int]:
    """Disks (n + 1, 3), m and rad, as whole numbers in one list: x, y (0.1 mm) and angle (mrad) of each in turn."""
    return (places * [1e4, 1e4, 1e3]).round().astype(int).ravel().tolist()


def tensions_in_words(pulls: Mapping[str, float]) -> str:
    """A sentence on the cables that are pulled, with tensions to 0.1 N; `pulls` are tensions by cable, N."""
    pulled = [f"{name}: {style.with_unit(round(pull, 1), 'N')}" for name, pull in pulls.items() if pull > 0.05]
    return f"Pulled: cable {', cable '.join(pulled)}." if pulled else "No cable is pulled."
