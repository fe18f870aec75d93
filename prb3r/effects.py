"""Extra physics by name, for the `effect` of a `Manipulator`; docs/effects.md says what each one means.

Examples
--------
>>> import prb3r
>>> manipulator = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
>>> weak = prb3r.effects.WeakenedPlate(plate=4, factor=0.8)
>>> manipulator.replace("effect", [weak]).effect[0].kind
'weakened_plate'
"""

from prb3r.model.effects.cables import (
    DeadCable,
    Hanger,
    HoleClearance,
    HoleOffset,
    LoadCell,
    TensionDrift,
    TensionOffset,
    TensionPlay,
)
from prb3r.model.effects.camera import CameraAspect, CameraDrift, CameraScale, LensDistortion
from prb3r.model.effects.empirical import EmpiricalMoment, MomentTerm
from prb3r.model.effects.friction import (
    BreakawayFriction,
    CableFriction,
    EdgeWrap,
    FrictionDrift,
    HoleDrag,
    LoadDependentFriction,
    PulleyFriction,
    RateDependentFriction,
    SlipHistory,
    WornHole,
    WrapSaturation,
)
from prb3r.model.effects.loads import (
    BaseTilt,
    Gravity,
    PayloadScale,
    SelfWeight,
    TipForce,
    TipLoadFriction,
    TipMass,
    Umbilical,
    WeightFriction,
)
from prb3r.model.effects.plates import (
    BaseCompliance,
    CableBending,
    ClampCompliance,
    DiskContact,
    HystereticPlate,
    NonlinearPlate,
    NotchClosing,
    PlateRelaxation,
    PlateSoftening,
    Precurvature,
    PrecurvatureGradient,
    SegmentStiffness,
    StiffnessGradient,
    WeakenedPlate,
)
from prb3r.model.effects.sections import FlagHysteresis, SuperelasticPlate

__all__ = [
    "BaseCompliance",
    "BaseTilt",
    "BreakawayFriction",
    "CableBending",
    "CableFriction",
    "CameraAspect",
    "CameraDrift",
    "CameraScale",
    "ClampCompliance",
    "DeadCable",
    "DiskContact",
    "EdgeWrap",
    "EmpiricalMoment",
    "FlagHysteresis",
    "FrictionDrift",
    "Gravity",
    "Hanger",
    "HoleClearance",
    "HoleDrag",
    "HoleOffset",
    "HystereticPlate",
    "LensDistortion",
    "LoadCell",
    "LoadDependentFriction",
    "MomentTerm",
    "NonlinearPlate",
    "NotchClosing",
    "PayloadScale",
    "PlateRelaxation",
    "PlateSoftening",
    "Precurvature",
    "PrecurvatureGradient",
    "PulleyFriction",
    "RateDependentFriction",
    "SegmentStiffness",
    "SelfWeight",
    "SlipHistory",
    "StiffnessGradient",
    "SuperelasticPlate",
    "TensionDrift",
    "TensionOffset",
    "TensionPlay",
    "TipForce",
    "TipLoadFriction",
    "TipMass",
    "Umbilical",
    "WeakenedPlate",
    "WeightFriction",
    "WornHole",
    "WrapSaturation",
]
