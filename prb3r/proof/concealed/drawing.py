"""Labels drawn from a seed: how every class of recordings is made on a given design."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from prb3r.proof.concealed.camera import read, truth
from prb3r.proof.concealed.designs import Design
from prb3r.proof.concealed.foreign import LAWS, followed_foreign, knocks, possible
from prb3r.proof.concealed.labels import AWKWARD, FAR_OUTSIDE, Label, Request
from prb3r.proof.concealed.responses import APART, NORM, SAME, Bench, nearest
from prb3r.proof.concealed.sizing import Found, drawn, places_of, rivals_of

MISLED = 0.01, 0.05
"""Changes of ln E and ln mu from which on calibration counts as misled."""
TRIES = 5


def label_of(request: Request, bench: Bench, loading: Bench | None) -> Label:
    """Draw the label of a request; one that its design cannot show is met by another kind, or is clean."""
    rng = np.random.default_rng([request.seed, 2, request.case])
    label = DRAWN[request.cls](request, bench, loading, rng)
    if label is None and request.kind:
        label = DRAWN[request.cls](replace(request, kind=""), bench, loading, rng)
    if label is None:
        label = Label(request.case, "clean", request.design, 0, note=f"no {request.cls} {request.kind} on this design")
    return _with_constants(label, bench, rng)


def _with_constants(label: Label, bench: Bench, rng: np.random.Generator) -> Label:
    """Constants, frame and noise, such that the rig keeps its equilibria."""
    measurement = bench.design.measurement
    rotation, shift = measurement["frame_rotation_sd_rad"], measurement.get("frame_position_sd_m", 0.0)
    edge = "frame" in label.awkward
    frame = rng.choice([-2, 2], 3) if edge else np.clip(rng.standard_normal(3), -2, 2)
    label = replace(
        label,
        noise_seed=int(rng.integers(2**62)),
        frame=(float(rotation * frame[0]), float(shift * frame[1]), float(shift * frame[2])),
    )
    for narrowing in (1.0, 0.7, 0.4, 0.2, 0.0):
        scale = np.array([0.08, 0.2 if bench.design.friction > 0 else 0.0]) * narrowing
        constants = tuple((scale * np.clip(rng.standard_normal(2), -2, 2)).tolist())
        if label.foreign is not None:
            plain = truth(bench.design, (), *constants)
            if followed_foreign(bench.design, plain, bench.design.program, *label.foreign) is None:
                continue
        elif bench.readings(label.effects, constants) is None:
            continue
        return replace(label, constants=constants)
    return replace(label, note="constants are the nominal ones")


def _labelled(request: Request, bench: Bench, one: Found, near: Mapping[str, float], **more: Any) -> Label:
    return Label(
        request.case,
        request.cls,
        request.design,
        0,
        effects=(one.effect,),
        sizes=(one.size,),
        multiple=request.multiple,
        norm=float(np.sqrt(bench.refitted(one.change, None))),
        nearest=near,
        places=places_of(bench, one),
        **more,
    )


def _clean(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label:
    awkward = ()
    if request.kind == "awkward":
        awkward = tuple(rng.choice(AWKWARD, 1 + int(rng.random() < 0.3), replace=False).tolist())
    return Label(request.case, "clean", request.design, 0, awkward=awkward)


def _single(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    best: tuple[float, Found] | None = None
    for _ in range(TRIES):
        one = drawn(bench, request.kind, request.multiple, rng)
        if one is None:
            continue
        far = min(rivals_of(bench, one, near=0.0).values(), default=np.inf)
        if best is None or far > best[0]:
            best = far, one
        if best[0] >= 1.2 * APART or request.multiple < 2 or not one.candidate.sized:
            break
    return None if best is None else _labelled(request, bench, best[1], rivals_of(bench, best[1]))


def _deleted(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    best: Label | None = None
    for multiple in (5.0, 5.0, 8.0, 8.0, 12.0, 12.0, 20.0, 20.0):
        one = drawn(bench, request.kind, multiple, rng)
        if one is None:
            continue
        label = _labelled(replace(request, multiple=multiple), bench, one, rivals_of(bench, one, near=np.inf))
        if best is None or label.distance > best.distance:
            others = [each for each in bench.responses if each.kind not in label.kinds]
            best = replace(label, without=label.kinds, pair_distance=bench.to_pairs(one.change, others))
        if best.distance >= FAR_OUTSIDE:
            break
    return best


def _pair(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    best: tuple[float, list[Found], dict[str, float]] | None = None
    for _ in range(2 * TRIES):
        both = [drawn(bench, "", request.multiple, rng) for _ in range(2)]
        chosen = [each for each in both if each is not None and each.candidate.sized]
        if len(chosen) < 2 or chosen[0].candidate.kind == chosen[1].candidate.kind:
            continue
        a, b = (bench.free(each.change) for each in chosen)
        cos = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
        alone = NORM * request.multiple * np.sqrt(1 - cos**2)
        if alone < 2 * NORM or bench.readings([each.effect for each in chosen]) is None:
            continue
        near = _pair_rivals(bench, chosen)
        rank = (min(near.values()) >= APART) * (-cos if request.kind == "cancelling" else 1.0)
        if best is None or rank > best[0]:
            best = rank, chosen, near
        if best[0] >= (0.4 if request.kind == "cancelling" else 1.0):
            break
    if best is None:
        return None
    _, chosen, near = best
    change = bench.response([each.effect for each in chosen])
    return Label(
        request.case,
        "pair",
        request.design,
        0,
        effects=tuple(each.effect for each in chosen),
        sizes=tuple(each.size for each in chosen),
        multiple=request.multiple,
        norm=bench.norm(change) if change is not None else 0.0,
        nearest=near,
        note=request.kind,
    )


def _pair_rivals(bench: Bench, chosen: Sequence[Found]) -> dict[str, float]:
    """Of each effect of a pair, the squared distance to the nearest rival of a third kind, the other one refitted."""
    out: dict[str, float] = {}
    kinds = [each.candidate.kind for each in chosen]
    for one, other in (chosen, chosen[::-1]):
        unit = bench.free(other.change)
        unit = unit / np.linalg.norm(unit)
        a = bench.free(one.change)
        a = a - unit * (unit @ a)
        for rival in bench.responses:
            if rival.kind in kinds:
                continue
            b = bench.free(rival.columns)
            b = b - np.outer(unit, unit @ b)
            left = a - b[:, 0] if not rival.group[0].sized else a - b @ np.linalg.lstsq(b, a, rcond=None)[0]
            out[rival.kind] = min(out.get(rival.kind, np.inf), round(float(left @ left), 3))
    return out


def _foreign(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    names = possible(bench.design)
    if not names:
        return None
    law = request.kind if request.kind in names else names[int(rng.integers(len(names)))]
    sign = -1.0 if law in ("drift", "gradient", "one_way", "yielding", "frame_moves") and rng.random() < 0.5 else 1.0
    target, share = FAR_OUTSIDE * rng.uniform(1.2, 4.0), 0.03
    if law == "dead_zone":  # comes in jumps
        share = rng.uniform(0.25, 0.6)
    best: Label | None = None
    for _ in range(6):
        label = _outside(request, bench, law, sign * share * LAWS[law][1])
        if label is None:
            break
        if best is None or _outsideness(label, target) < _outsideness(best, target):
            best = label
        if 1 <= label.distance / target <= 6:
            break
        share = float(np.clip(share * np.clip(np.sqrt(2 * target / max(label.distance, 1e-3)), 0.4, 4), 0, 1))
    return best


def _outsideness(label: Label, target: float) -> float:
    """How far a label is from the distance asked for, too near being the worse."""
    ratio = float(np.log(max(label.distance, 1e-9) / target))
    return ratio if ratio >= 0 else -100 * ratio


def _outside(request: Request, bench: Bench, law: str, size: float) -> Label | None:
    change = _foreign_change(bench.design, bench, law, size)
    if change is None:
        return None
    return Label(
        request.case,
        "foreign",
        request.design,
        0,
        foreign=(law, size),
        sizes=(size,),
        norm=float(np.sqrt(bench.refitted(change, None))),
        nearest={
            **nearest(bench, change, bench.responses, [], near=np.inf),
            "wrong weight": bench.without_a_step(change),
        },
        pair_distance=bench.to_pairs(change, bench.responses),
    )


def _foreign_change(design: Design, bench: Bench, law: str, size: float) -> np.ndarray | None:
    found = followed_foreign(design, design.manipulator, design.program, law, size)
    if found is None:
        return None
    readings = read(design, design.manipulator, found, knocks(design, law, size))
    return bench.whiten(readings - bench.nominal)


def _decoy(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    label = Label(request.case, "decoy", request.design, 0, note=request.kind)
    if request.kind == "frame":
        return replace(label, awkward=("frame",))
    program = bench.design.program
    for _ in range(5 * TRIES):
        q = int(rng.integers(len(program)))
        k = int(rng.integers(len(program[q])))
        name = bench.design.cables[int(rng.integers(len(bench.design.cables)))]
        noted, factor = program[q][k][f"cable_{name}_n"], float(rng.choice([0.5, 0.75, 1.25, 1.5]))
        if noted == 0:
            continue
        changed = [list(steps) for steps in program]
        changed[q][k] = {**program[q][k], f"cable_{name}_n": noted * factor}
        readings = bench.readings(program=[tuple(steps) for steps in changed])
        if readings is None:
            continue
        change = bench.whiten(readings - bench.nominal)
        if bench.norm(change) >= 3 * NORM:
            return replace(label, wrong_weight=(q, k, name, factor), norm=bench.norm(change))
    return None


def _confusable(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    for _ in range(4 * TRIES):
        one = drawn(bench, request.kind, request.multiple, rng)
        if one is None or not one.candidate.sized:
            continue
        if min(rivals_of(bench, one, near=0.0).values(), default=np.inf) < 4 * SAME:
            near = rivals_of(bench, one)
            if min(near.values()) < SAME:
                return _labelled(request, bench, one, near)
    return None


def _hidden(request: Request, bench: Bench, loading: Bench | None, rng: np.random.Generator) -> Label | None:
    if loading is None:
        return None
    fits_well = 1.6 * np.sqrt(2 * loading.nominal.size)
    for attempt in range(6 * TRIES):
        multiple = (5.0, 3.0, 2.0)[attempt % 3]
        kind = request.kind if attempt < 3 * TRIES else ""
        one = drawn(bench, kind, multiple, rng)
        if one is None or not one.candidate.sized:
            continue
        part = loading.response([one.effect])
        if part is None or loading.norm(part) ** 2 > fits_well:
            continue
        false = np.abs(np.linalg.lstsq(loading.calibration, part, rcond=None)[0])
        if false[0] < MISLED[0] and not (bench.design.friction > 0 and false[1] > MISLED[1]):
            continue
        near = rivals_of(bench, one)
        if min(near.values()) >= APART:
            label = _labelled(replace(request, multiple=multiple), bench, one, near)
            return replace(label, hidden_norm=loading.norm(part))
    return None


Drawing = Callable[[Request, Bench, Bench | None, np.random.Generator], Label | None]
DRAWN: dict[str, Drawing] = {
    "clean": _clean,
    "single": _single,
    "pair": _pair,
    "foreign": _foreign,
    "deleted": _deleted,
    "decoy": _decoy,
    "confusable": _confusable,
    "hidden": _hidden,
}
