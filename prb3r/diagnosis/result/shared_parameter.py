"""A parameter that several rigs share: its values, from all recordings and from each, and whether these agree."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.confidence import NORMAL_REACH
from prb3r.diagnosis.result.posterior import FILE_NAMES
from prb3r.diagnosis.result.statements import IN_WORDS, Estimate
from prb3r.diagnosis.search.agreement import ParameterEstimate, SharedParameterEstimates
from prb3r.diagnosis.search.together import Together
from prb3r.diagnosis.settings.sharing import SharingSettings
from prb3r.markdown import listed, quoted
from prb3r.quantities import describe, name_in_words


class EffectOfOneRig(NamedTuple):
    """An effect of one rig alone that could make up the difference between rigs."""

    effect: str
    """Its kind."""
    recording: str
    """Name of the recording of that rig."""
    probability: float
    """Probability of the effect among the joint models in which all rigs have one value."""


@dataclass(frozen=True)
class SharedParameter:
    """A parameter that several recordings share."""

    effect: str
    """Name of the effect that the parameter belongs to; empty for a constant."""
    parameter: str
    """Name of the parameter, as files have it."""
    recordings: tuple[str, ...]
    """Names of the recordings that share the parameter."""
    together: Estimate
    """From all recordings together."""
    alone: tuple[Estimate, ...]
    """From each of `recordings` alone with the same effects; without an interval where it does not tell the
    parameter."""
    p: float
    """Chance of values `alone` at least that far apart, if the parameter is the same on all rigs."""
    agrees: bool
    """Whether `p` raises no alarm and no rig has a value of its own."""
    probability: float
    """Probability that the parameter is the same on all rigs, over the surviving joint models."""
    own: tuple[str, ...]
    """Recordings whose rig has a value of its own after all."""
    made_up_by: tuple[EffectOfOneRig, ...] = ()
    """Where the recordings disagree, effects of single rigs in joint models with one value nevertheless, the most
    probable first (`Settings.told_presence`)."""
    settings: SharingSettings = SharingSettings()
    """Limits for what is said of sharing."""

    @property
    def compared(self) -> bool:
        """Whether two recordings or more tell the parameter alone, without which none can agree with another."""
        return sum(estimate.low is not None for estimate in self.alone) > 1

    @property
    def quantity(self) -> str:
        """The parameter and its effect in words; the effect alone where its name says what it is measured by."""
        words, effect = self._in_words[0], self.effect.replace("_", " ")
        if not effect:
            return words
        measure = words.split()[-1]  # a lone letter, as of a direction, names nothing
        return f"the {effect}" if len(measure) > 1 and measure in effect else f"{words} of {effect}"

    @property
    def _in_words(self) -> tuple[str, float, str]:
        """The parameter in words, without its effect, and the factor and unit in which people read it."""
        plain = (
            f"the {name_in_words(self.parameter).lower()}",
            1.0,
            f" {describe(self.parameter).unit}".removesuffix(" 1"),
        )
        return IN_WORDS.get(self.parameter, plain)

    @property
    def statement(self) -> str:
        """Whether the recordings agree on the parameter, as two that tell it can, with its values, in a sentence."""
        quantity, (_, factor, unit) = self.quantity, self._in_words
        said = [
            f"{estimate.times(factor)}{unit} on {name}" if estimate.low is not None else f"not told by {name} alone"
            for name, estimate in zip(quoted(self.recordings), self.alone, strict=True)
        ]
        if not self.agrees:
            told = f"The recordings, each by itself, do not agree on {quantity}: {' against '.join(said)}."
            possible = self.probability > self.settings.imitated_probability
            return told + (f" {self._shared_all_the_same}" if possible else "")
        how = f"The recordings agree on {quantity}"
        if not self.compared:
            how = f"No two recordings tell {quantity}, so that none contradicts another"
        return f"{how}: {self.together.times(factor)}{unit} together, {', '.join(said)}."

    @property
    def _shared_all_the_same(self) -> str:
        """A sentence on how probable one value for all rigs still is, where the recordings, each by itself, tell
        different ones."""
        how = "All joint models that are left have one value"
        if self.probability <= self.settings.all_probability:
            how = f"Joint models with one value have {100 * self.probability:.0f} % of the probability"
        by = [
            f"{one.effect.replace('_', ' ')} of {one.recording} ({100 * one.probability:.0f} % of them)"
            for one in self.made_up_by
        ]
        return f"{how}: {listed(by) if by else 'an effect of one rig'} can make up the difference."

    def as_json(self) -> dict[str, Any]:
        """The parameter as `together.json` holds it, with its sentence."""
        plain = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "settings"}
        plain |= {"together": self.together.record, "alone": [each.record for each in self.alone]}
        return plain | {"made_up_by": [one._asdict() for one in self.made_up_by], "statement": self.statement}


def shared_parameter_of(
    compared: SharedParameterEstimates, together: Together, names: Sequence[str]
) -> SharedParameter:
    """A compared parameter in its unit, with what is concluded on sharing it; `names` are those of the recordings."""
    settings = together.fitted.model.settings
    file_name = FILE_NAMES.get(compared.name, compared.name)

    def estimate(told: ParameterEstimate) -> Estimate:
        reach = NORMAL_REACH * told.sd if np.isfinite(told.sd) else 0.0
        ends = [told.u, told.u - reach, told.u + reach]
        if compared.free is None:
            rig = together.fitted.model.rigs[compared.rigs[0]]
            nominal, bounds = rig.recording.manipulator, rig.widest[compared.name]
            value = nominal.youngs_modulus_pa if compared.name == "log_stiffness" else nominal.friction.coefficient
            values = [float(value * np.exp(end)) for end in np.clip(ends, *bounds)]
            open_ends = ends[1] <= bounds[0], ends[2] >= bounds[1]
        else:
            values = [compared.free.value(end) for end in ends]
            open_ends = compared.free.open_ends(*sorted(values[1:]))
        low, high = sorted(values[1:])
        return Estimate(values[0], low, high, open_ends) if reach else Estimate(values[0])

    agrees = not compared.parted and compared.p >= settings.alarm_rate
    return SharedParameter(
        effect=compared.effect,
        parameter=file_name,
        recordings=tuple(names[rig] for rig in compared.rigs),
        together=estimate(compared.joint),
        alone=tuple(estimate(told) for told in compared.alone),
        p=compared.p,
        agrees=agrees,
        probability=together.shared_probability(compared.effect, compared.name),
        own=tuple(names[rig] for rig in compared.parted),
        made_up_by=() if agrees else tuple(effects_that_make_up(compared, together, names)),
        settings=settings,
    )


def effects_that_make_up(
    compared: SharedParameterEstimates, together: Together, names: Sequence[str]
) -> Iterator[EffectOfOneRig]:
    """The effects of single rigs that joint models with one value of a parameter have and others mostly lack, as of
    `SharedParameter.made_up_by`."""
    least = together.fitted.model.settings.told_presence

    def presence(one_value: bool) -> dict[tuple[str, str], float]:
        """Probability of each effect of a rig alone, among the joint models with one value or among all others."""
        found = dict[tuple[str, str], float]()
        models = [s for s in together.survivors if together.shares(s, compared.effect, compared.name) == one_value]
        for survivor in models:
            effects: frozenset[Any] = survivor.effects
            for key in {(one.kind, names[one.rigs[0]]) for one in effects if one.first and len(one.rigs) == 1}:
                found[key] = found.get(key, 0.0) + survivor.probability
        total = sum(survivor.probability for survivor in models)
        return {key: share / total for key, share in found.items()}

    without = presence(False)
    for (kind, name), share in sorted(presence(True).items(), key=lambda pair: -pair[1]):
        if share - without.get((kind, name), 0.0) >= least:
            yield EffectOfOneRig(kind, name, share)
