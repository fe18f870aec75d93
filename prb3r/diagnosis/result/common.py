"""The result of several recordings diagnosed together, as plain data and in sentences: which parameters they share,
whether they agree on these, and what each has of its own."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from prb3r.diagnosis.confidence import NORMAL_REACH
from prb3r.diagnosis.fit.joint import JointModel
from prb3r.diagnosis.library.joint import SHARED
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.shared_parameter import SharedParameter, shared_parameter_of
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.agreement import (
    ParameterEstimate,
    chance_of_one_value,
    log_bayes_factor,
    shared_parameters,
)
from prb3r.diagnosis.search.together import Together
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed, quoted
from prb3r.runs.files import ensure_writable, write_json

TOGETHER_FILE = "together.json"


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
    own_sizes: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    """By name, effects with one parameter that several rigs have, each its own: the value by the recording, in the unit
    of files."""
    settings: Settings = Settings()

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
        sizes = self.own_sizes.get(effect, {})
        if not sizes:
            return ""
        told = [f"{size} on {name}" for name, size in zip(quoted(tuple(sizes)), sizes.values(), strict=True)]
        return f" ({', '.join(told)}{self._whether_alike(tuple(sizes.values()))})"

    def _whether_alike(self, sizes: Sequence[Estimate]) -> str:
        """Whether sizes agree, as a clause; empty where one has no interval."""
        known = [
            ParameterEstimate(size.value, (size.high - size.low) / (2 * NORMAL_REACH))
            for size in sizes
            if size.low is not None and size.high is not None
        ]
        if len(known) < len(sizes):
            return ""
        return ", which agree" if chance_of_one_value(known) >= self.settings.alarm_rate else ", which do not agree"

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
            "shared": [parameter.as_json() for parameter in self.shared],
            "own": {name: list(effects) for name, effects in self.own.items()},
            "unshared": {effect: list(owners) for effect, owners in self.unshared.items()},
            "unexplained": list(self.unexplained),
            "own_sizes": {
                effect: {name: size.record for name, size in sizes.items()} for effect, sizes in self.own_sizes.items()
            },
            "statements": list(self.sentences),
        }


def common_of(together: Together, names: Sequence[str]) -> Common:
    """The result of recordings diagnosed together, under the `names` of the recordings in their order."""
    model = together.fitted.model
    return Common(
        recordings=tuple(names),
        shared=tuple(shared_parameter_of(compared, together, names) for compared in shared_parameters(together)),
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


def own_sizes_of(common: Common, diagnoses: Sequence[Diagnosis]) -> Mapping[str, Mapping[str, Estimate]]:
    """The sizes that the `diagnoses` tell of effects that several rigs have, as of `Common.own_sizes`."""
    sizes = dict[str, dict[str, Estimate]]()
    for diagnosis in diagnoses:
        for effect in diagnosis.effects:
            if effect.name in common.own.get(diagnosis.name, ()) and len(effect.parameters) == 1:
                (size,) = effect.parameters.values()
                sizes.setdefault(effect.name, {})[diagnosis.name] = size
    return {name: each for name, each in sizes.items() if len(each) > 1}


def write_common(common: Common, folder: str | Path) -> Path:
    """Write `together.json` into a folder and return its path.

    Raises the errors of `ensure_writable` and `write_json`.
    """
    folder = Path(folder)
    ensure_writable(folder)
    return write_json(folder / TOGETHER_FILE, common.as_json())
