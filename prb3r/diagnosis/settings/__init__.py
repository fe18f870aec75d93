"""Every number that a diagnosis was given: what it means, and where its value comes from.

"Choice" marks what was set by judgement; what it is worth shows `prb3r prove --settings`, which moves each threshold by
20 % to either side.  Closed forms are computed here and nowhere else.

What is no choice about the diagnosis stands elsewhere, each with a word on it: how large an effect may be and where its
fits begin, in its record (`prb3r.diagnosis.library`); what reading a recording doubts (`prb3r.recording`), which knows
of no diagnosis; and guards and steps of the arithmetic, beside what they guard.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from prb3r.diagnosis.chance import normal_critical
from prb3r.diagnosis.settings.blunders import BlundersSettings
from prb3r.diagnosis.settings.designs import DesignsSettings
from prb3r.diagnosis.settings.evidence import EvidenceSettings, RatesSettings
from prb3r.diagnosis.settings.fits import FitsSettings
from prb3r.diagnosis.settings.library import LibrarySettings
from prb3r.diagnosis.settings.noise import DoubtSettings, NoiseSettings, SequencesSettings
from prb3r.diagnosis.settings.search import SearchSettings
from prb3r.diagnosis.settings.sharing import SharingSettings
from prb3r.diagnosis.settings.telling import LawsSettings, LocationSettings, RemarksSettings
from prb3r.mechanics.budget import Allowance


@dataclass(frozen=True)
class Settings(
    RatesSettings,
    EvidenceSettings,
    LibrarySettings,
    SearchSettings,
    NoiseSettings,
    DoubtSettings,
    SequencesSettings,
    FitsSettings,
    BlundersSettings,
    LocationSettings,
    LawsSettings,
    RemarksSettings,
    SharingSettings,
    DesignsSettings,
):
    """Thresholds, limits and choices of a diagnosis."""

    @property
    def allowance(self) -> Allowance:
        """What a load path may take."""
        return Allowance(self.work_of_sequence, self.work_of_step)

    @cached_property
    def detectable(self) -> float:
        """Norm of an effect's whitened change at which it is noticed but for `missed_rate`: 5.17."""
        return float(normal_critical(self.alarm_rate / 2 / self.directions_assumed) + normal_critical(self.missed_rate))

    @cached_property
    def alike(self) -> float:
        """Squared whitened distance of two predictions that are ranked wrongly with `alike_rate`: 10.8.

        Their log likelihoods differ by d^2 / 2 on the average and scatter by d, so the rate is Phi(-d / 2).
        """
        return float(4 * normal_critical(self.alike_rate) ** 2)

    @cached_property
    def resolved(self) -> float:
        """Squared whitened distance of two predictions that are ranked wrongly with `resolved_rate`: 21.6."""
        return float(4 * normal_critical(self.resolved_rate) ** 2)

    @cached_property
    def close_fit(self) -> float:
        """Rise of chi-square with its penalty up to which a rival fits as well: twice the ln of `likelihood_ratio`,
        5.99."""
        return float(2 * np.log(self.likelihood_ratio))

    @cached_property
    def farthest(self) -> float:
        """Largest ln of a factor on stiffness or friction, either way: that of `widest_factor`, 3.91."""
        return float(np.log(self.widest_factor))

    def plain(self) -> dict[str, Any]:
        """All fields with their values by name, as `diagnosis.json` holds them."""
        return asdict(self)
