"""The small rig with another manipulator file, and what may be suspected of it."""

from dataclasses import replace

import numpy as np
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library.scope import Scope
from prb3r.model.manipulator import Manipulator

MU = 0.3


def recording(**changes):
    """The small rig with another manipulator file, pushed at its tip so that no kind is out of the question."""
    plain = recorded(Case(hidden=()))
    data = plain.manipulator.model_dump(exclude_none=True) | changes
    hung = np.zeros_like(plain.loads.force)
    hung[0, [1, 4]] = 0.2  # weights at disks 2 and 5
    rate = np.where(plain.loads.elapsed % 2, 5.0, 0.02) * np.ones_like(plain.loads.tension)
    loads = plain.loads._replace(tip=np.full_like(plain.loads.tip, 0.5), force=hung, rate=rate)
    return replace(plain, manipulator=Manipulator.model_validate(data), loads=loads)


def scope(**changes):
    made = recording(**changes)
    predict = predictor(made)
    return Scope.of(made, predict.chain, predict.equilibria(Constants()))


def sections(**changes):
    plain = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True)
    return [segment | changes for segment in plain["segment"]]


def bare_sections(**changes):
    """Of plates that are known by their stiffness alone."""
    unsaid = "width_m", "thickness_m"
    known = {"bending_stiffness_n_m2": 0.24} | changes
    return [{k: v for k, v in (each | known).items() if k not in unsaid} for each in sections()]
