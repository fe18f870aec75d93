"""What a diagnosis predicts for a design: the manipulator file with all that carries over, and positions with 95 %
bands.

A band holds the uncertainty that the recording leaves on the model and its parameters, and that of the making: on the
recorded rig, its parts as the readings tell them; on another rig, the tolerances of the recording.  What the diagnosis
could not explain widens the band (`discrepancy.py`).
"""

import json
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import ValidationError

from prb3r.diagnosis.confidence import TAIL
from prb3r.diagnosis.result.as_made import as_made
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.discrepancy import share_moved
from prb3r.diagnosis.result.largest_bending import bending_of
from prb3r.diagnosis.result.learnt_design import LearntDesign, made_as, on_benches, said_of_benches, said_of_making
from prb3r.diagnosis.result.posterior import Drawn, Posterior, averaged
from prb3r.diagnosis.result.projection import MENDED
from prb3r.diagnosis.result.workshop import common_stiffness_sd, within_tolerances
from prb3r.diagnosis.settings import Settings
from prb3r.errors import Problem, SpecError
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.effects.base import Effect
from prb3r.model.files.cells import written_out
from prb3r.model.files.table import read_table
from prb3r.model.files.toml import toml_text
from prb3r.model.given import Given, manipulator_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import SolvedBlocks, solve_in_blocks
from prb3r.model.step_checks import TIME

PREDICTED = ("x_m", "y_m", "angle_rad")
"""Coordinates that are predicted for every disk."""
STANDING = (Outcome.CONVERGED, Outcome.DETOUR)
"""Outcomes of a solve that are equilibria at which an arm stays."""
UNEXPLAINED = "the recording is unexplained: what carries over may stand in for something else"
"""What is said of predictions that rest on such a recording."""
UNMENDED = (
    "is the file of the recorded rig with the blunder that the diagnosis found in it; give the mended one, "
    f"{MENDED}/manipulator.toml in the folder of the diagnosis"
)
"""What is said of a design that is the recorded rig as it was noted wrongly."""
_RECORDED = (
    "the design's file is that of the recorded rig, which is taken to be this one{}: say --another-copy where it is "
    "another rig of one drawing"
)
"""What is said where a design has the geometry of the recorded rig, with what is known of its parts."""
_OF_WHAT_STAYS = (
    "of what stays with the recorded rig the prediction has what the design's file states, and its bands nothing"
)
_AS_GIVEN = "loads are taken as they are given here; those of the recording were mended, since it looks as if {}"
"""What is said of loads where the diagnosis found blunders in those of the recording."""
_TOO_FAR = (
    "constants alone are taken: what carries over would move this design by {:.0f} % of its way from the straight "
    "manipulator, where it moves the recorded rig by {:.0f} %, so that it may stand in for what acts otherwise here"
)
"""What is said where effects of an unexplained recording do not carry over."""
WHAT_TO_GIVE = "give the folder that prb3r diagnose wrote, or its diagnosis.json"
"""What messages ask for in the place of a diagnosis."""


@dataclass(frozen=True, eq=False)
class DesignPrediction:
    """What a diagnosis predicts for a design."""

    manipulator: Manipulator
    """The design with the constants and effects that carry over."""
    left_behind: tuple[str, ...]
    """Effects and constants that do not carry over, each with its reason."""
    remarks: tuple[str, ...]
    """Suppositions that are made, what the bands leave out, and draws without an equilibrium."""
    positions: pd.DataFrame | None
    """`sequence, step, disk` and for x_m, y_m and angle_rad the mean over the surviving models, by their probability,
    with the ends of its band; NaN without an equilibrium.  None where no steps were given."""

    def to_toml(self) -> str:
        """The text of the design's manipulator file, with what was left behind, and the remarks, as comments."""
        comments = ["prb3r predict: what a diagnosis teaches, on this design"]
        comments += [*(f"left behind: {reason}" for reason in self.left_behind), *self.remarks]
        plain = self.manipulator.model_dump(exclude_none=True)
        lines = [f"# {comment}\n" for comment in comments]
        return "".join(lines) + toml_text({key: value for key, value in plain.items() if value != []})


def predict_design(
    diagnosis: str | Path | Diagnosis,
    manipulator: Given,
    steps: pd.DataFrame | Mapping[str, Any] | str | Path | None = None,
    *,
    same_bench: bool | None = None,
    another_copy: bool = False,
    draws: int = Settings.band_draws,
    seed: int = 0,
) -> DesignPrediction:
    """What a diagnosis predicts for another design, or for the recorded one under other loads.

    Parameters and errors as of `prb3r.predict`.
    """
    if draws < 1 / TAIL:
        raise SpecError(Problem("draws", f"a 95 % band needs at least {1 / TAIL:.0f}, not {draws}"))
    (known, verdict), given = read_posterior(diagnosis), manipulator_of(manipulator)
    if known.is_unmended(given):
        raise SpecError(Problem(str(manipulator) if isinstance(manipulator, str | Path) else given.name, UNMENDED))
    columns = read_table(steps) if isinstance(steps, str | Path) else steps
    timed = columns is None or TIME in columns
    learnt = LearntDesign(known, given, same_bench is not False, another_copy, timed=timed)
    predicted = _predicted_design(learnt, steps, verdict, same_bench, draws, seed)
    moved = learnt.posterior.models[0].moved if known.alone is not None and not learnt.recorded else None
    if moved is None or predicted.positions is None:
        return predicted
    sober = replace(learnt, known=known.without_effects())
    alone = _predicted_design(sober, steps, verdict, same_bench, draws, seed)
    assert alone.positions is not None
    chain, places = alone.manipulator.chain(), (_places(each, given.plates) for each in (predicted, alone))
    share = share_moved(chain, *places)
    if share <= Settings.moved_elsewhere * moved or not np.isfinite(share):  # infinite: nothing bends the design
        return predicted
    return replace(alone, remarks=(*alone.remarks, _TOO_FAR.format(100 * share, 100 * moved)))


def _predicted_design(
    learnt: LearntDesign,
    steps: pd.DataFrame | Mapping[str, Any] | str | Path | None,
    verdict: str,
    same_bench: bool | None,
    draws: int,
    seed: int,
) -> DesignPrediction:
    """What is predicted for a design by the model, or the models, that its posterior rests on."""
    known, benches = learnt.known, on_benches(learnt, same_bench)
    designs = made_as(benches)
    design = designs[0]
    posterior, (central, left), remarks = design.posterior, design.named, design.remarks
    if design.recorded:
        parts = any(model.parts for model in posterior.models)
        remarks.append(_RECORDED.format(", with its parts as the readings tell them" if parts else ""))
    if verdict == "unexplained":
        remarks.append(UNEXPLAINED)
    half = "" if steps is None else "half of the draws behind the bands are"
    remarks += [*said_of_benches(benches, half), *said_of_making(designs, half)]
    if steps is None:
        return DesignPrediction(central, left, tuple(remarks), None)
    if left:
        remarks.append(_OF_WHAT_STAYS)
    if known.mended_loads:
        remarks.append(_AS_GIVEN.format("; and as if ".join(known.mended_loads)))
    recorded, rng = design.recorded, np.random.default_rng([seed, 1])
    common = common_stiffness_sd(posterior.manipulator, design.given, posterior.tolerance, posterior.tells_thickness)
    # loads depend on cables, plates and the worth of a kilogram, which are the design's: the same for every rig
    blocks = solve_in_blocks(central, steps)
    remarks += design.at_pace(blocks.table.pace_s)

    def predicted(rig: Drawn, made: bool, where: LearntDesign = design) -> np.ndarray:
        learnt = where.of(rig).manipulator
        if recorded and rig.parts:
            chain = as_made(learnt, rig.parts)
        else:
            chain = within_tolerances(learnt, posterior.tolerance, rng, common) if made else learnt.chain()
        return _positions(replace(blocks, manipulator=learnt, chain=chain))

    centre = averaged([(share, predicted(centre, made=False)) for share, centre in posterior.centres])
    if posterior.bending is not None:
        angle = centre[:, PREDICTED.index("angle_rad")].reshape(-1, central.plates + 1)
        bending, seen = bending_of(central, angle, blocks.table.begins), posterior.bending
        remarks += filter(None, [bending.beyond(seen, Settings.bent_beyond), bending.back(seen)])
    rigs = posterior.draws(draws, seed)
    spread = np.stack([predicted(rig, made=True, where=where) for rig, where in zip(rigs, cycle(designs))])
    if (discrepancy := posterior.discrepancy) is not None:
        spread = spread + discrepancy.errors(central.chain(), centre, draws, rng)
        remarks.append(discrepancy.statement)
    remarks += _what_widens(posterior, rigs, spread)
    lost = np.isnan(spread).any(2).mean(0)
    if lost.max(initial=0.0) > 0:
        told = "bands are of the others"
        if (few := lost > Settings.most_lost_draws).any():
            spread[:, few], told = (
                np.nan,
                f"{told}, and there are none where more than {100 * Settings.most_lost_draws:.0f} % are lost",
            )
        share = written_out(100 * lost.max(), ".2g")
        remarks.append(f"at some step {share} % of the draws have no equilibrium; {told}")
    return DesignPrediction(central, left, tuple(remarks), _banded(blocks.whole(), centre, spread))


def _places(prediction: DesignPrediction, plates: int) -> np.ndarray:
    """(2, s, n + 1) predicted x and y of all disks, m."""
    assert prediction.positions is not None
    return prediction.positions[["x_m", "y_m"]].to_numpy().T.reshape(2, -1, plates + 1)


def read_posterior(diagnosis: str | Path | Diagnosis) -> tuple[Posterior, str]:
    """The posterior and the verdict of a diagnosis, given as itself, its folder or its diagnosis.json.

    Raises
    ------
    SpecError
        If there is no such file, or if it is not a diagnosis that holds its posterior.
    """
    if isinstance(diagnosis, Diagnosis):
        return diagnosis.posterior, "unexplained" if diagnosis.why else diagnosis.verdict
    path = Path(diagnosis)
    path = path / "diagnosis.json" if path.is_dir() else path
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        partial = any(effect.get("partial") for effect in record["effects"])  # of a recording with a blunder mended too
        return Posterior.model_validate(record["posterior"]), "unexplained" if partial else record["verdict"]
    except FileNotFoundError:
        several = sorted(each.parent.name for each in path.parent.glob("*/diagnosis.json"))
        if several:
            reason = f"no such file, but folders of several diagnoses: give that of one, {' or '.join(several)}"
            raise SpecError(Problem(str(path), reason)) from None
        reason = f"no such file; {WHAT_TO_GIVE}"
    except OSError as error:
        reason = f"cannot be read: {str(error.strerror).lower()}"
    except UnicodeDecodeError:
        reason = "is not UTF-8 text"
    except json.JSONDecodeError as error:
        reason = f"line {error.lineno}: not valid JSON: {error.msg}; {WHAT_TO_GIVE}"
    except (KeyError, TypeError):
        reason = "holds no posterior: diagnose the recording again with this version"
    except ValidationError as error:
        first = error.errors()[0]
        reason = f"posterior.{'.'.join(map(str, first['loc']))}: {first['msg']}"
    raise SpecError(Problem(str(path), reason))


def _positions(blocks: SolvedBlocks) -> np.ndarray:
    """(rows, 3) solved `PREDICTED` of every disk of every step; NaN where no equilibrium stands."""
    solved = [columns for _, columns in blocks.columns()]
    outcome, *read = (np.concatenate([columns[name] for columns in solved]) for name in ("outcome", *PREDICTED))
    return np.where(np.isin(outcome, STANDING)[:, None], np.stack(read, 1), np.nan)


def _what_widens(posterior: Posterior, rigs: Sequence[Drawn], spread: np.ndarray) -> list[str]:
    """A sentence for each kind of effect that is not named but probable enough to make the widest band of a position
    more than `Settings.wider_bands` times as wide as it is without.

    Parameters
    ----------
    spread : (d, rows, 3) coordinates of each of the draws `rigs` (d,).
    """
    named = _kinds(posterior.named.effects)
    of_rigs = [_kinds(rig.effects) - named for rig in rigs]
    whole, remarks = _ends(spread[..., :2]), []
    if not np.isfinite(whole).any():
        return []
    row, axis = np.unravel_index(np.nanargmax(whole[1] - whole[0]), whole.shape[1:])
    for kind in sorted(set().union(*of_rigs)):
        without = spread[[kind not in kinds for kinds in of_rigs], row, axis, None]
        if np.isfinite(without).sum() < 1 / TAIL:
            continue
        low, high = _ends(without)
        times = float(np.ptp(whole[:, row, axis]) / max(float(high[0] - low[0]), np.finfo(float).tiny))
        if times > Settings.wider_bands:
            probability = sum(model.probability for model in posterior.models if kind in _kinds(model.effects))
            remarks.append(
                f"bands are up to {written_out(times, '.2g')} times as wide as without {kind}, of which the "
                f"recording leaves a probability of {probability:.2f}: a recording of loads like these would tell"
            )
    return remarks


def _kinds(effects: Iterable[Effect]) -> set[str]:
    return {effect.kind for effect in effects}


def _banded(steps: pd.DataFrame, centre: np.ndarray, spread: np.ndarray) -> pd.DataFrame:
    """The table of positions: `sequence`, `step` and `disk` of `steps`, the coordinates `centre` (rows, 3), and the
    ends of their bands from the draws `spread` (d, rows, 3)."""
    table = steps[["sequence", "step", "disk"]].copy()
    for k, name in enumerate(PREDICTED):
        stem, unit = name.rsplit("_", 1)
        ends = _ends(spread[..., k])
        table[name], table[f"{stem}_low_{unit}"], table[f"{stem}_high_{unit}"] = centre[:, k], *ends
    return table


def _ends(spread: np.ndarray) -> np.ndarray:
    """(2, ...) lower and upper end of the 95 % band of draws (d, ...); draws without an equilibrium (NaN) are left out,
    and where none has one, the ends are NaN."""
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        return np.nanquantile(spread, [TAIL, 1 - TAIL], axis=0, method="weibull")
