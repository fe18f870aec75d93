"""The linearised model around a joint fit: how every hypothesis moves the readings of all recordings together."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.diagnosis.evidence.linearised import Probe, moved_readings
from prb3r.diagnosis.fit.basis import basis_of, projected_out
from prb3r.diagnosis.fit.joint import JointFit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.joint import JointHypothesis
from prb3r.diagnosis.search.columns import felt_within_bounds, first_size, no_steeper
from prb3r.diagnosis.search.linear_selection import Column, LinearModel

JointProbe = tuple[JointHypothesis, np.ndarray]
"""A joint hypothesis and its free parameters."""


def joint_linear_model(
    fitted: JointFit, library: Sequence[JointHypothesis], log_odds: Mapping[JointHypothesis, float]
) -> tuple[LinearModel, frozenset[int]]:
    """The linearised model around `fitted`, and the numbers of the columns of its own effects, which come first."""
    model, constants = fitted.model, len(fitted.model.varied)
    rows = fitted.rows[-1].stop + constants
    basis = basis_of(fitted.jacobian[:rows, :constants])

    target, columns = fitted.residual[:rows].copy(), []
    for number, (hypothesis, span) in enumerate(zip(model.hypotheses, model.spans, strict=True)):
        moved, at = _of_fitted(fitted, number)
        moved = no_steeper(moved)
        columns.append(_column(hypothesis, projected_out(moved, basis), fitted.p[span], 0, log_odds[hypothesis]))
        target[: len(moved)] += moved @ at
    others = [hypothesis for hypothesis in library if hypothesis not in model.hypotheses]
    frictions = frictions_of(fitted)
    probes = [(hypothesis, start) for hypothesis in others for start in hypothesis.starts(frictions)]
    for (hypothesis, start), moved in zip(probes, moved_together(fitted, probes), strict=True):
        values = projected_out(moved, basis)
        if not felt_within_bounds(values):
            continue
        sign = int(hypothesis.one_sided(frictions))
        columns.append(_column(hypothesis, values, start, sign, log_odds[hypothesis]))
    target -= basis @ (basis.T @ target)
    return LinearModel(columns, target), frozenset(range(len(model.hypotheses)))


def _column(hypothesis: JointHypothesis, moved: np.ndarray, start: np.ndarray, sign: int, odds: float) -> Column:
    return Column(hypothesis, moved, start, sign, odds)  # type: ignore[arg-type]


def frictions_of(fitted: JointFit) -> list[float]:
    """Fitted friction coefficient of every rig, in their order."""
    pairs = zip(fitted.model.members, fitted.model.maps, strict=True)
    return [member.friction(whole @ fitted.p) for member, whole in pairs]


def moved_together(fitted: JointFit, probes: Sequence[JointProbe]) -> list[np.ndarray]:
    """(R, k) for each probe: whitened change of the readings of all recordings per prior standard deviation of each
    free parameter, or (R, 1) by the whole of an effect that does not come by degrees."""
    model, count = fitted.model, fitted.rows[-1].stop
    out = [
        np.zeros((count, len(start) if hypothesis.continuous and not hypothesis.kinked else 1))
        for hypothesis, start in probes
    ]
    for number, (hypothesis, _) in enumerate(probes):
        if hypothesis.parting is not None and hypothesis.parted is not None:
            rows = fitted.rows[hypothesis.parted]
            column = model.varied.index((hypothesis.parting.name, model.shared[hypothesis.parting.name]))
            out[number][rows, 0] = -fitted.jacobian[rows, column] * hypothesis.parting.prior_sd
    for rig, rows in enumerate(fitted.rows):
        probed = [(n, part) for n, (hypothesis, _) in enumerate(probes) if (part := hypothesis.parts[rig]) is not None]
        asked = [(part, probes[n][1][probes[n][0].places(rig)]) for n, part in probed]
        columns = _moved_once(fitted.part(rig), asked)
        whiten = model.members[rig].noise.whiten
        for (n, part), moved in zip(probed, columns, strict=True):
            hypothesis = probes[n][0]
            if hypothesis.continuous:
                places = [0] if hypothesis.kinked else hypothesis.places(rig)
                out[n][rows, places] += whiten(moved * part.deviations)
            else:
                out[n][rows] = whiten(moved)
    return out


def _moved_once(fitted: Fit, probes: Sequence[Probe]) -> list[np.ndarray]:
    """As :func:`moved_readings`, but equal probes are solved for once: an effect may be in common and one rig's own."""
    friction, first, asked = fitted.model.friction(fitted.p), dict[object, int](), list[Probe]()
    order = []
    for part, u in probes:
        key = (part, u.tobytes()) if part.continuous else part.effect(u, friction).model_dump_json()
        if key not in first:
            first[key] = len(asked)
            asked.append((part, u))
        order.append(first[key])
    columns = moved_readings(fitted, asked)
    return [columns[k] for k in order]


def _of_fitted(fitted: JointFit, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns (R, k) of the fitted effect `number` and their coefficients (k,) in the fit, as in :mod:`columns`."""
    hypothesis, span = fitted.model.hypotheses[number], fitted.model.spans[number]
    count, deviations = fitted.rows[-1].stop, hypothesis.deviations
    tangent = -fitted.jacobian[:count, span] * deviations
    if hypothesis.continuous:
        return tangent, fitted.p[span] / deviations
    whole = np.zeros((count, 1))
    for rig in hypothesis.rigs:
        part, rows = fitted.part(rig), fitted.rows[rig]
        place = part.model.hypotheses.index(hypothesis.parts[rig])  # type: ignore[arg-type]
        less = part.model.without(place)
        without = less.solve(part.model.without_share(part.p, place))
        whole[rows, 0] = part.model.noise.whiten(part.model.readings(part.solved) - less.readings(without))
    return np.hstack([whole, tangent]), np.concatenate([[1.0], np.zeros(len(deviations))])


def joint_beginning(
    fitted: JointFit, linear: LinearModel, chosen: Sequence[int]
) -> tuple[tuple[JointHypothesis, ...], np.ndarray]:
    """The hypotheses of the `chosen` columns, and the joint parameters (P,) that a full fit of them begins from."""
    model, frictions = fitted.model, frictions_of(fitted)
    parts, hypotheses = [fitted.p[: len(model.varied)]], list[JointHypothesis]()
    for k, coefficient in zip(chosen, linear.coefficients(chosen), strict=True):
        column = linear.columns[k]
        hypothesis: JointHypothesis = column.hypothesis  # type: ignore[assignment]
        hypotheses.append(hypothesis)
        if hypothesis in model.hypotheses or not hypothesis.continuous:
            parts.append(column.start)
        else:
            friction = frictions[hypothesis.rigs[0]]
            parts.append(first_size(hypothesis, column.start, coefficient, friction))  # type: ignore[arg-type]
    return tuple(hypotheses), np.concatenate(parts)
