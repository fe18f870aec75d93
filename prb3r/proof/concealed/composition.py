"""Composition of a run: its designs, and a request for every recording, on a design on which it can be made."""

from collections.abc import Collection, Sequence

import numpy as np

from prb3r.proof.concealed.candidates import concealable, kinds
from prb3r.proof.concealed.design import Design, Flavour
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.drawing import label_of
from prb3r.proof.concealed.foreign import LAWS, possible
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.real import REAL_CLASSES, real_label
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS

BENCH_CLASSES = tuple(name for name in SETTINGS.population.shares if name not in REAL_CLASSES)
"""Classes of recordings of bench rigs, which have no imperfections."""


def flavours(cases: int, classes: Collection[str] = ()) -> list[Flavour]:
    """Flavours of the designs of a run of `cases` recordings of some classes (empty: all), those of bench rigs first.

    Several recordings of bench rigs share a design; every recording of a real rig has a design of its own.
    """
    asked = counts(cases, classes)
    bench = sum(asked.get(cls, 0) for cls in BENCH_CLASSES)
    real = [_real_flavour(cls, i) for cls in REAL_CLASSES for i in range(asked.get(cls, 0))]
    return (_bench_flavours(bench) if bench else []) + real


def _real_flavour(cls: str, i: int) -> Flavour:
    """Flavour of the design of recording `i` of a class of real rigs."""
    chosen = SETTINGS.real
    if cls == "rare" and _last(i, chosen.nitinol_every):
        return Flavour.REAL_NITINOL
    if _last(i, chosen.bare_every):
        return Flavour.REAL_BARE
    if _last(i + 1, chosen.history_every):
        untold = cls == "several" and _last(i // chosen.history_every, chosen.untold_every)
        slow = cls == "several" or _last(i // chosen.history_every, chosen.single_history_every)
        return Flavour.REAL_UNTOLD if untold else Flavour.REAL_HISTORY if slow else Flavour.REAL
    return Flavour.REAL


def _bench_flavours(cases: int) -> list[Flavour]:
    """Flavours of the designs of bench rigs in a run with `cases` recordings of such rigs."""
    chosen = SETTINGS.population
    share = cases / chosen.bench
    plain = max(chosen.fewest_plain, round(chosen.plain_designs * share))
    special = max(chosen.fewest_special, round(chosen.special_designs * share))
    history = chosen.history_designs if cases >= chosen.history_from else 0
    return (
        [Flavour.PLAIN] * plain + [Flavour.LOADING] * special + [Flavour.POOR] * special + [Flavour.HISTORY] * history
    )


def counts(cases: int, classes: Collection[str] = ()) -> dict[str, int]:
    """Number of recordings of every class, or of some, by largest remainders so that they add up to `cases`."""
    shares = {name: share for name, share in SETTINGS.population.shares.items() if not classes or name in classes}
    exact = {name: cases * share / sum(shares.values()) for name, share in shares.items()}
    out = {name: int(value) for name, value in exact.items()}
    late = sorted(exact, key=lambda name: out[name] - exact[name])
    for name in late[: cases - sum(out.values())]:
        out[name] += 1
    return out


def requests(seed: int, cases: int, designs: Sequence[Design], classes: Collection[str] = ()) -> list[Request]:
    """The requests for all recordings of a run.

    Those of bench rigs are spread evenly over the designs on which they can be made; those of real rigs take the
    remaining designs one by one, in the order of `flavours`.
    """
    bench = [design for design in designs if not design.flavour.is_real]
    rng, shows = np.random.default_rng([seed, 0]), [kinds(design) for design in bench]
    asked = [(cls, *_asked(cls, i)) for cls, count in counts(cases, classes).items() for i in range(count)]
    load, real = np.zeros(len(bench)), len(bench)
    out = []
    for case, (cls, kind, multiple) in enumerate(asked):
        if cls in REAL_CLASSES:
            out.append(Request(case, seed, cls, real, kind, multiple))
            real += 1
            continue
        able = [k for k, design in enumerate(bench) if _able(design, shows[k], cls, kind, case)]
        able = able or [k for k, design in enumerate(bench) if design.flavour == Flavour.PLAIN]
        chosen = min(able, key=lambda k: (load[k], rng.random()))
        load[chosen] += 1
        out.append(Request(case, seed, cls, chosen, kind, multiple))
    return out


def _asked(cls: str, i: int) -> tuple[str, float]:
    """Kind (of effect, law, decoy or awkwardness) and size, in smallest detectable ones, that recording `i` of a class
    asks for; an empty kind means any, a size of 0 none in particular."""
    chosen, library = SETTINGS.population, concealable()
    in_turn = chosen.multiples[(i + i // len(library)) % len(chosen.multiples)]
    match cls:
        case "several" | "imperfect-clean" | "rare":
            return "", 0.0
        case "imperfect-single":
            return library[i % len(library)], SETTINGS.real.single_multiple
        case "blunder":
            return ("several" if _last(i, SETTINGS.real.blunder_effects_every) else ""), 0.0
        case "clean":
            return ("awkward" if _last(i, chosen.awkward_every) else ""), in_turn
        case "pair":
            return ("cancelling" if _last(i, chosen.cancelling_every) else ""), chosen.pair_multiple
        case "foreign":
            return list(LAWS)[i % len(LAWS)], in_turn
        case "decoy":
            return ("frame" if _last(i, chosen.frame_decoy_every) else "weight"), in_turn
        case "confusable":
            twinned = [kind for kind, record in RECORDS.items() if record.twins is not None]
            return (twinned[i % len(twinned)] if _last(i, chosen.twin_every) else ""), chosen.pair_multiple
        case "hidden":
            return chosen.hidden_kinds[i % len(chosen.hidden_kinds)], in_turn
        case _:
            return library[i % len(library)], in_turn


def _last(i: int, every: int) -> bool:
    """Whether `i` is the last of its group when counting is in groups of `every`."""
    return i % every == every - 1


def _able(design: Design, shown: set[str], cls: str, kind: str, case: int) -> bool:
    """Whether recording `case` of a class can be made on a design of a bench rig.

    The design must have the flavour that the class needs and, where the class needs one, be able to have the effect
    (`shown`: kinds of the design) or foreign law `kind`.
    """
    history = case % round(1 / SETTINGS.population.history_share) == 0 and cls in ("clean", "single")
    flavour = {"hidden": Flavour.LOADING, "confusable": Flavour.POOR}.get(cls, Flavour.PLAIN)
    if cls == "confusable" and kind:
        flavour = Flavour.PLAIN
    if cls in ("single", "deleted") and kind not in shown:
        return False
    if cls == "foreign" and kind not in possible(design):
        return False
    if history:
        return design.flavour in (Flavour.HISTORY, Flavour.PLAIN)
    return design.flavour == flavour


def labels_of(task: tuple[Design, Sequence[Request]]) -> list[Label]:
    """The labels of all requests on one design."""
    design, asked = task
    if design.flavour.is_real:
        return [real_label(request, design) for request in asked]
    responses = Responses(design)
    loading = Responses(design, design.loading_only) if design.flavour == Flavour.LOADING else None
    return [label_of(request, responses, loading) for request in asked]


def drawn_design(task: tuple[int, int, Flavour]) -> Design:
    """The design of a given seed, number and flavour."""
    return design_of(*task)
