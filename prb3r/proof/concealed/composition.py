"""What a run consists of: designs, and a request for every recording on a design that can show it."""

from collections.abc import Sequence

import numpy as np

from prb3r.proof.concealed.candidates import concealable, kinds
from prb3r.proof.concealed.designs import HISTORY, LOADING, PLAIN, POOR, Design, design_of
from prb3r.proof.concealed.drawing import label_of
from prb3r.proof.concealed.foreign import LAWS, possible
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.responses import Bench
from prb3r.proof.rig.effects import RECORDS

FULL = 1200
SHARES = {
    "clean": 400,
    "single": 420,
    "pair": 84,
    "foreign": 84,
    "deleted": 44,
    "decoy": 44,
    "confusable": 60,
    "hidden": 64,
}
"""Recordings of each class in a full run."""
KINDS = concealable()
TWINS = tuple(kind for kind, record in RECORDS.items() if record.twins is not None)
"""Kinds that are asked for, the commonest first; those that another kind may be the same as."""
MULTIPLES = (1.0, 2.0, 5.0)
HISTORY_SHARE = 0.03
"""Of clean and single recordings, those with friction along the load path."""


def flavours(cases: int) -> list[str]:
    """Of the designs of a run."""
    share = cases / FULL
    plain, special = max(4, round(24 * share)), max(1, round(4 * share))
    return [PLAIN] * plain + [LOADING] * special + [POOR] * special + [HISTORY] * (2 if cases >= 300 else 0)


def counts(cases: int) -> dict[str, int]:
    """Recordings of every class; they add up to `cases`."""
    exact = {name: cases * share / FULL for name, share in SHARES.items()}
    out = {name: int(value) for name, value in exact.items()}
    late = sorted(exact, key=lambda name: out[name] - exact[name])
    for name in late[: cases - sum(out.values())]:
        out[name] += 1
    return out


def requests(seed: int, cases: int, designs: Sequence[Design]) -> list[Request]:
    """Every recording of a run, on designs that can show it."""
    rng, shows = np.random.default_rng([seed, 0]), [kinds(design) for design in designs]
    asked: list[tuple[str, str, float]] = []
    for cls, count in counts(cases).items():
        for i in range(count):
            kind, multiple = KINDS[i % len(KINDS)], MULTIPLES[(i + i // len(KINDS)) % 3]
            if cls == "clean":
                kind = "awkward" if i % 2 else ""
            elif cls == "pair":
                kind, multiple = ("cancelling" if i % 2 else "", 5.0)
            elif cls == "foreign":
                kind = list(LAWS)[i % len(LAWS)]
            elif cls == "decoy":
                kind = "frame" if i % 4 == 3 else "weight"
            elif cls == "confusable":
                kind, multiple = (TWINS[i % len(TWINS)] if i % 5 == 4 else "", 5.0)
            elif cls == "hidden":
                kind = ("pulley_friction", "tension_offset", "", "worn_hole", "hole_offset")[i % 5]
            asked.append((cls, kind, multiple))
    load = np.zeros(len(designs))
    out = []
    for case, (cls, kind, multiple) in enumerate(asked):
        able = [k for k, design in enumerate(designs) if _able(design, shows[k], cls, kind, case)]
        able = able or [k for k, design in enumerate(designs) if design.flavour == PLAIN]
        chosen = min(able, key=lambda k: (load[k], rng.random()))
        load[chosen] += 1
        out.append(Request(case, seed, cls, chosen, kind, multiple))
    return out


def _able(design: Design, shown: set[str], cls: str, kind: str, case: int) -> bool:
    slow = case % round(1 / HISTORY_SHARE) == 0 and cls in ("clean", "single")
    flavour = {"hidden": LOADING, "confusable": POOR}.get(cls, PLAIN)
    if cls == "confusable" and kind:
        flavour = PLAIN
    if cls in ("single", "deleted") and kind not in shown:
        return False
    if cls == "foreign" and kind not in possible(design):
        return False
    return design.flavour == (HISTORY if slow else flavour) or (design.flavour == PLAIN and slow)


def labels_of(task: tuple[Design, Sequence[Request]]) -> list[Label]:
    """The labels of all requests for one design."""
    design, asked = task
    bench = Bench(design)
    loading = Bench(design, design.loading_only) if design.flavour == LOADING else None
    return [label_of(each, bench, loading) for each in asked]


def drawn_design(task: tuple[int, int, str]) -> Design:
    """A design from its seed, number and flavour."""
    return design_of(*task)
