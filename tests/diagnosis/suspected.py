"""The small rig with another manipulator file, and what may be suspected of it."""

from dataclasses import replace

import numpy as np
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library.scope import Scope
from prb3r.model.manipulator import Manipulator

MU = 0.3
SAG = {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": -9.8}


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


def other_design(factor=2.0, **changes):
    """Two plates a segment, `factor` times as thick."""
    plain = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True)
    segments = [
        segment | {"thickness_m": factor * segment["thickness_m"], "plates": 2, **changes}
        for segment in plain["segment"]
    ]
    return Manipulator.model_validate(plain | {"segment": segments})


def rods(*diameters):
    """An arm of segments of round rods of these diameters, m, known by their stiffness alone."""
    plain, modulus = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True), 1.87e11
    stiffness = [modulus * np.pi * d**4 / 64 for d in diameters]
    segments = [bare_sections(bending_stiffness_n_m2=each)[0] for each in stiffness]
    return Manipulator.model_validate(plain | {"segment": segments})


def scaled(manipulator, size):
    """The manipulator with all its lengths `size` times as large."""
    plain = manipulator.model_dump(exclude_none=True)
    lengths = ("length_m", "clamp_m", "width_m", "thickness_m", "offset_m")
    for part in (plain["disk"], *plain["segment"], *plain["cable"]):
        part |= {name: size * value for name, value in part.items() if name in lengths}
    return Manipulator.model_validate(plain)
