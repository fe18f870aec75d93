"""Finding blunders of the set-up: the remedy of each known blunder is tried, and the misfit of the recording compared.

The evidence for a blunder is the logarithm of a likelihood ratio, a photograph counting as one number (`robust.py`).
By chance, one remedy exceeds :math:`\\ln(k / a)` in a share `a / k` of all recordings without blunders.  With `k` the
number of kinds of blunders times the number of places where a blunder of this kind could have been made, some remedy
does in a share of at most `a`.  So a blunder that can be made in one way only, such as kilograms in all columns of
newtons, needs less evidence than one that can be made in a hundred ways.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from prb3r.diagnosis.checks.repeats import repeats_contradict
from prb3r.diagnosis.checks.setup.attempt import Attempt, attempt_on
from prb3r.diagnosis.checks.setup.cables import cable_blunders
from prb3r.diagnosis.checks.setup.factors import MISNOTED, factor_blunders, finer
from prb3r.diagnosis.checks.setup.hung import hung_blunders
from prb3r.diagnosis.checks.setup.lengths import THICKNESS, length_blunders
from prb3r.diagnosis.checks.setup.order import EXCHANGED_STEPS, OF_ORDER, order_blunders, step_blunders
from prb3r.diagnosis.checks.setup.pictures import picture_blunders
from prb3r.diagnosis.checks.setup.remedy import File, Remedy
from prb3r.diagnosis.checks.setup.robust import expected_loss
from prb3r.diagnosis.checks.setup.slips import FORGOTTEN, doubted_slips, slip_blunders
from prb3r.diagnosis.checks.setup.trial import Trial
from prb3r.diagnosis.checks.setup.units import OF_ALL_WEIGHTS, unit_blunders
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects import AnyEffect
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Blunder:
    """A blunder that explains a misfit which constants alone leave."""

    blunder: str
    """What was done, in words that follow "it looks as if"."""
    alike: tuple[str, ...]
    """Other blunders that would look the same."""
    file: File
    """The file that has to be mended."""
    mended: Recording
    """The recording without the blunder."""
    plain: bool
    """Whether constants alone explain the mended recording, and no effect imitates the blunder; else effects that were
    left out could explain as much."""
    least: float
    """Log likelihood ratio that is needed to report the blunder."""
    faint: bool = False
    """Whether the log likelihood ratio with constants alone is below `least`, so that the blunder is at most a rival of
    effects."""
    expected: bool = False
    """Whether the tables speak for it by themselves, and the readings as much as for a blunder for which they do
    not."""
    least_in_place: float = np.inf
    """Log likelihood ratio that suffices to report it in the place of effects that stand in for it; infinite if none
    do."""

    whose: str = ""
    """What a factor concerns, of a blunder by a factor."""

    def is_same(self, other: "Blunder") -> bool:
        """Whether another blunder is this one, by its words or as what looks the same; if by a factor, by any."""
        return other.blunder in (self.blunder, *self.alike) or bool(self.whose and self.whose == other.whose)

    @property
    def sure(self) -> bool:
        """Whether it is reported without a comparison with effects."""
        return self.plain or self.expected

    @property
    def statement(self) -> str:
        """What seems to have been done, and what would look the same, in a sentence."""
        others = f", or what looks the same here: {'; or '.join(self.alike)}" if self.alike else ""
        return f"It looks as if {self.blunder}{others}."


def remedies(recording: Recording, settings: Settings) -> list[Remedy]:
    """All remedies that could be tried on a recording: of pictures, cables, lengths, slip, units, loads on disks and
    order, in this order."""
    others = (cable_blunders, length_blunders, slip_blunders, unit_blunders, hung_blunders, order_blunders)
    return [*picture_blunders(recording, settings), *(remedy for family in others for remedy in family(recording))]


def blunders_of(recording: Recording, settings: Settings, apply: Apply = serially) -> tuple[Blunder, ...]:
    """The blunders that are found in a recording, each sought with those before it mended; mostly none.

    If the last one is plain, constants alone explain the recording with all of them mended.  Only the last one may be
    faint.
    """
    out: list[Blunder] = []
    while len(out) < settings.most_blunders and not (out and out[-1].faint):
        blunder = find_blunder(out[-1].mended if out else recording, settings, apply=apply, faint=True)
        if blunder is None:
            break
        out.append(blunder)
    return tuple(out)


def find_blunder(
    recording: Recording,
    settings: Settings,
    effects: Sequence[AnyEffect] = (),
    apply: Apply = serially,
    faint: bool = False,
    exchanged: Sequence[int] = (),
    missed: Sequence[str] = (),
) -> Blunder | None:
    """The blunder that explains most of a recording's misfit, of those that explain more than chance could.

    Parameters
    ----------
    effects : added to the manipulator, as a blunder may show only beside the effects that hide it.
    apply : tries many remedies, in workers for instance, where predictions are slow.
    faint : whether a blunder with less evidence, at least `Settings.faint_blunder`, is returned if there is no other.
    exchanged : rows of steps of which two may be exchanged.
    missed : names of sequences of which the weights may be noted as a multiple of what hung there.
    """
    manipulator = recording.manipulator.model_copy(update={"effect": [*recording.manipulator.effect, *effects]})
    attempt = attempt_on(replace(recording, manipulator=manipulator) if effects else recording, settings)
    among = [
        *remedies(attempt.recording, settings),
        *step_blunders(attempt.recording, exchanged),
        *factor_blunders(attempt.recording, missed),
    ]
    least = least_of_kinds(among, settings, doubted_slips(recording))
    tried = [t for t in trials(attempt, among, apply) if not _contradicted(t, attempt)]
    better = [t for t in tried if t.total < attempt.here.total]
    speaking = [t for t in better if t.gain >= least[t.remedy.kind]]
    whispering = [t for t in better if t.gain >= settings.faint_blunder] if faint and not speaking else []
    if not speaking and not whispering:
        return None
    # a gain is of the readings that the remedy concerns: remedies are compared by the misfit of all readings
    best = min(speaking or whispering, key=lambda t: t.total + least[t.remedy.kind])
    close = best.total + settings.close_fit / 2
    # the same blunder in fewer steps is less, not another one
    others = (t for t in tried if t is not best and not t.remedy.blunder.startswith(best.remedy.blunder))
    alike = tuple(t.remedy.blunder for t in others if t.total < close)
    within_noise = expected_loss(float(np.exp(settings.far_noise))) * len(np.unique(recording.readings.step))
    # photographs miss by no more than noise that is not far off the stated one: nothing is left to explain
    plain = best.total < within_noise and not effects and bool(speaking) and not best.remedy.imitators
    expected = best.remedy.kind == FORGOTTEN and best.gain >= least_of_kinds(among, settings)[FORGOTTEN]
    found = blunder_by(best.remedy, recording, among, settings)
    least_here = least[best.remedy.kind]
    return replace(found, alike=alike, plain=plain, least=least_here, faint=not speaking, expected=expected)


def _contradicted(tried: Trial, attempt: Attempt) -> bool:
    """Whether a remedy that lets less be missed moves pictures to other steps, and loads that were repeated speak
    against that."""
    if tried.remedy.kind not in OF_ORDER or tried.total >= attempt.here.total:
        return False
    mended = tried.mended.recording, tried.standing.constants
    return repeats_contradict(mended, (attempt.recording, attempt.here.constants), attempt.trying.settings)


def blunder_by(remedy: Remedy, recording: Recording, among: Sequence[Remedy], settings: Settings) -> Blunder:
    """The blunder that a remedy undoes, one of those `among` which it was chosen, as one that effects may explain."""
    of_kind = sum(_stood_in_for(other) and other.kind == remedy.kind for other in among)
    return Blunder(
        remedy.blunder,
        (),
        remedy.file,
        remedy.mend(recording).recording,
        plain=False,
        least=least_of_kinds(among, settings)[remedy.kind],
        least_in_place=float(np.log(of_kind / settings.imitated_rate)) if _stood_in_for(remedy) else np.inf,
        whose=remedy.factor.whose if remedy.factor else "",
    )


def _stood_in_for(remedy: Remedy) -> bool:
    """Whether effects may stand in for a blunder: one that looks much the same, or for a unit of all weights, where
    the modulus is stated, stiffnesses of segments and clamps together."""
    return bool(remedy.imitators) or remedy.kind == OF_ALL_WEIGHTS


def least_of_kinds(among: Sequence[Remedy], settings: Settings, doubted: Sequence[str] = ()) -> dict[str, float]:
    """Log likelihood ratio that a remedy of each kind needs, such that the false-alarm rate of all is
    `Settings.blunder_rate`.

    The rate is divided evenly among the kinds of blunders, and among the remedies of each kind; thicknesses get less by
    odds of `Settings.faint_blunder`, as a mistaken unit, which looks nearly the same, is more frequent.
    `Settings.faint_blunder` suffices if there is other evidence for the blunder: exchanged steps are only tried where
    the weights of both steps contradict their readings, or where these steps alone are not predicted.  Weights of a
    sequence are only tried where it is not predicted, and need this for each of the factors that can be told, as chance
    chooses among these.

    Parameters
    ----------
    doubted : kinds of blunders with slip that the changes of tensions speak for (:func:`doubted_slips`).
    """
    places = Counter(remedy.kind for remedy in among)
    share = {kind: np.exp(-settings.faint_blunder) if kind == THICKNESS else 1.0 for kind in places}
    rate = {kind: settings.blunder_rate * share[kind] / sum(share.values()) for kind in places}
    least = {kind: float(np.log(count / rate[kind])) for kind, count in places.items()}
    least |= {kind: settings.faint_blunder for kind in (EXCHANGED_STEPS, *doubted) if kind in places}
    if MISNOTED in places:
        least[MISNOTED] = settings.faint_blunder + float(np.log(settings.factors_told * places[MISNOTED]))
    return least


def trials(attempt: Attempt, among: Sequence[Remedy], apply: Apply = serially) -> list[Trial]:
    """The most promising remedies with refitted constants, the best first."""
    settings, apply = attempt.trying.settings, apply if attempt.costly else serially
    rough = sorted(_refined(attempt, attempt.rough(among)), key=attrgetter("gain"), reverse=True)
    most, of_a_kind = settings.blunders_fitted, settings.blunders_of_a_kind
    if attempt.costly:
        most, of_a_kind = settings.costly_blunders_fitted, settings.costly_blunders_of_a_kind
    promising = _few_of_a_kind(rough, of_a_kind)[:most]
    full = apply(_in_full, [(attempt, tried) for tried in promising])
    # a remedy is known by its function, of which workers send back a copy
    done = [replace(there, remedy=tried.remedy) for there, tried in zip(full, promising, strict=True)]
    return sorted(done, key=attrgetter("gain"), reverse=True)


def _refined(attempt: Attempt, rough: Sequence[Trial]) -> list[Trial]:
    """The rough trials; of blunders by some factor the most promising alone, with the factor that gains most."""
    others, best = [t for t in rough if not t.remedy.factor], [t for t in rough if t.remedy.factor]
    for rounds in range(attempt.trying.settings.factor_rounds if best else 0):
        nearest = max(best, key=attrgetter("gain")).remedy.factor
        assert nearest is not None
        best = attempt.rough([nearest.remedy_by(factor) for factor in finer(nearest.value, rounds)])
    return [*others, *sorted(best, key=attrgetter("gain"))[-1:]]


def _in_full(task: tuple[Attempt, Trial]) -> Trial:
    """:meth:`Attempt.full` of one task."""
    attempt, tried = task
    return attempt.full(tried)


def _few_of_a_kind(tried: Sequence[Trial], most: int) -> list[Trial]:
    """The first `most` trials of every kind of blunder, in their order."""
    count, out = Counter[str](), []
    for candidate in tried:
        count[candidate.remedy.kind] += 1
        if count[candidate.remedy.kind] <= most:
            out.append(candidate)
    return out
