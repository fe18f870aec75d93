"""The result of several recordings diagnosed together, as plain data and in sentences: which parameters they share,
whether they agree on these, and what each has of its own."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from prb3r.diagnosis.confidence import NORMAL_REACH
from prb3r.diagnosis.fit.joint import JointModel
from prb3r.diagnosis.library.joint import SHARED
from prb3r.diagnosis.result.statements import IN_WORDS, Estimate
from prb3r.diagnosis.search.agreement import (
    ParameterEstimate,
    SharedParameterEstimates,
    log_bayes_factor,
    shared_parameters,
)
from prb3r.diagnosis.search.together import Together
from prb3r.diagnosis.settings.sharing import SharingSettings
from prb3r.markdown import listed, quoted
from prb3r.quantities import describe, name_in_words
from prb3r.runs.files import ensure_writable, write_json

TOGETHER_FILE = "together.json"
CONSTANT_FILES = {"log_stiffness": "youngs_modulus_pa", "log_friction": "friction_coefficient"}
"""Names in files of the constants that rigs may share."""


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
    made_up_by: tuple[Mapping[str, str | float], ...] = ()
    """Where the recordings disagree, effects of single rigs in joint models with one value nevertheless, each with the
    `recording` and its `probability` among these models (`Settings.told_presence`), the most probable first."""
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
        by = []
        for one in self.made_up_by:
            effect = str(one["effect"]).replace("_", " ")
            by.append(f"{effect} of {one['recording']} ({100 * float(one['probability']):.0f} % of them)")
        return f"{how}: {listed(by) if by else 'an effect of one rig'} can make up the difference."


@dataclass(frozen=True)
class Common:
    """The result of several recordings diagnosed together."""

    recordings: tuple[str, ...]
    """Names of all recordings."""
    shared: tuple[SharedParameter, ...]
    own: Mapping[str, tuple[str, ...]]
    """By recording, the names of the effects that its rig alone has."""
    unshared: Mapping[str, tuple[str, ...]]
    """By name, effects that the rigs could share but that single rigs have instead, with the recordings of these
    rigs."""
    log_bayes_factor: float
    """ln of the evidence of all recordings with what they share, over that of each recording by itself."""
    remarks: tuple[str, ...]
    """What is not shared and why, and the suppositions that sharing rests on."""
    unexplained: tuple[str, ...] = ()
    """Recordings that are not explained, so that what they tell of shared parameters rests on models that miss them."""
    apart: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    """By name, effects with one size that several rigs have, each its own: the size by the recording."""
    settings: SharingSettings = SharingSettings()

    @property
    def sentences(self) -> Iterator[str]:
        """The result in sentences: whether the evidence favours sharing what no rig has its own value of, each shared
        parameter, effects that are not shared, each rig's own effects, and remarks."""
        whole = [parameter.quantity for parameter in self.shared if not parameter.own]
        if not whole:
            yield "The rigs share nothing of what was found: each recording tells its values alone."
        elif self.unexplained:
            names = listed(quoted(self.unexplained))
            verb = "is" if len(self.unexplained) == 1 else "are"
            yield (
                f"Whether the rigs share {listed(whole)} is not known: {names} {verb} not explained, and what is said "
                "of that below rests on models that miss readings."
            )
        else:
            factor, least = self.log_bayes_factor, self.settings.strong_log_bayes_factor
            ruled = "speak against the view that" if factor < -least else "leave open whether"
            ruled = "bear out that" if factor > least else ruled
            odds = f"the Bayes factor of that against each recording by itself has ln {factor:.1f}; {least:g} is strong"
            yield f"The recordings {ruled} the rigs share {listed(whole)} ({odds})."
        yield from (parameter.statement for parameter in self.shared)
        shown = dict(zip(self.recordings, quoted(self.recordings), strict=True))
        for effect, known in self.unshared.items():
            owners = [shown[name] for name in known]
            others = [shown[name] for name in self.recordings if name not in known]
            rest = f", {listed(others)} none" if others else ""
            said = f"{listed(owners)} {'has its' if len(owners) == 1 else 'have their'} own{rest}"
            yield f"The recordings do not share {effect.replace('_', ' ')}: {said}."
        for known, effects in self._by_owners().items():
            which = f"{shown[known[0]]} alone"
            if len(known) > 1:
                names = listed([shown[name] for name in known])
                which = f"{names}, each with its own values"
            yield f"Of {which}: {', '.join(effect.replace('_', ' ') + self._sizes(effect) for effect in effects)}."
        yield from (f"note: {remark}" for remark in self.remarks)

    def _sizes(self, effect: str) -> str:
        """The sizes that several rigs have of an effect, and whether they agree, in brackets; empty where unknown."""
        sizes = self.apart.get(effect, {})
        if len(sizes) < 2:
            return ""
        told = [f"{size} on {name}" for name, size in zip(quoted(tuple(sizes)), sizes.values(), strict=True)]
        return f" ({', '.join(told)}{', which agree' * _are_alike(tuple(sizes.values()))})"

    def _by_owners(self) -> dict[tuple[str, ...], list[str]]:
        """Names of the effects that are neither of the material nor of its friction, by the recordings whose rigs have
        them."""
        owners, together = dict[str, list[str]](), dict[tuple[str, ...], list[str]]()
        for name, effects in self.own.items():
            for effect in effects:
                if effect not in self.unshared and name not in owners.setdefault(effect, []):
                    owners[effect].append(name)
        for effect, names in owners.items():
            together.setdefault(tuple(names), []).append(effect)
        return together

    def as_json(self) -> dict[str, Any]:
        """The content of `together.json`: plain numbers, texts, lists and mappings."""
        return {
            "schema": 1,
            "recordings": list(self.recordings),
            "log_bayes_factor": self.log_bayes_factor,
            "shared": [_plain_parameter(parameter) for parameter in self.shared],
            "own": {name: list(effects) for name, effects in self.own.items()},
            "unshared": {effect: list(owners) for effect, owners in self.unshared.items()},
            "unexplained": list(self.unexplained),
            "apart": {effect: {k: size.record for k, size in sizes.items()} for effect, sizes in self.apart.items()},
            "statements": list(self.sentences),
        }


def _are_alike(sizes: Sequence[Estimate]) -> bool:
    """Whether sizes lie no farther apart than their intervals, taken as independent, allow."""
    reach = [0.0 if size.low is None or size.high is None else (size.high - size.low) / 2 for size in sizes]
    return all(
        abs(one.value - other.value) <= np.hypot(reach[i], reach[k])
        for i, one in enumerate(sizes)
        for k, other in enumerate(sizes)
    )


def _plain_parameter(parameter: SharedParameter) -> dict[str, Any]:
    """A shared parameter as `together.json` holds it, with its sentence."""
    plain = {field.name: getattr(parameter, field.name) for field in fields(parameter) if field.name != "settings"}
    plain |= {"together": parameter.together.record, "alone": [each.record for each in parameter.alone]}
    return plain | {"statement": parameter.statement}


def common_of(together: Together, names: Sequence[str]) -> Common:
    """The result of recordings diagnosed together, under the `names` of the recordings in their order."""
    model = together.fitted.model
    return Common(
        recordings=tuple(names),
        shared=tuple(_shared(compared, together, names) for compared in shared_parameters(together)),
        own={name: tuple(_own(model, rig)) for rig, name in enumerate(names)},
        unshared=_unshared(together, names),
        log_bayes_factor=float(log_bayes_factor(together)),
        remarks=together.groups.remarks,
        settings=model.settings,
    )


def _own(model: JointModel, rig: int) -> Iterator[str]:
    """Names of the effects in the joint model that rig `rig`, counted from 0, alone has."""
    for hypothesis in model.hypotheses:
        part = hypothesis.parts[rig]
        if part is not None and len(hypothesis.rigs) == 1:
            yield part.name


def _unshared(together: Together, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """The effects of single rigs that are of the material or its friction, and that the library of the joint search
    also holds as shared ones: by the name of the effect, the names of the recordings whose rigs have it."""
    common = [joint for joint in together.search.library if len(joint.rigs) > 1 and joint.kind in SHARED]
    owners = dict[str, tuple[str, ...]]()
    for hypothesis in together.fitted.model.hypotheses:
        effect, rig = hypothesis.first, hypothesis.rigs[0]
        could = [part for joint in common if (part := joint.parts[rig]) is not None]
        if effect and len(hypothesis.rigs) == 1 and any(part.same_effect(effect) for part in could):
            owners[effect.name] = (*owners.get(effect.name, ()), names[rig])
    return owners


def _shared(compared: SharedParameterEstimates, together: Together, names: Sequence[str]) -> SharedParameter:
    """A compared parameter in its unit, with what is concluded on sharing it."""
    settings = together.fitted.model.settings
    file_name = CONSTANT_FILES.get(compared.name, compared.name)

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
        made_up_by=() if agrees else tuple(_made_up_by(compared, together, names)),
        settings=settings,
    )


def _made_up_by(
    compared: SharedParameterEstimates, together: Together, names: Sequence[str]
) -> Iterator[Mapping[str, str | float]]:
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
            yield {"effect": kind, "recording": name, "probability": share}


def write_common(common: Common, folder: str | Path) -> Path:
    """Write `together.json` into a folder and return its path.

    Raises the errors of `ensure_writable` and `write_json`.
    """
    folder = Path(folder)
    ensure_writable(folder)
    return write_json(folder / TOGETHER_FILE, common.as_json())
