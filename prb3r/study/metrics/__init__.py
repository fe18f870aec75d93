"""Metrics: numbers that a case is judged by, each one small class.

A metric names its columns and computes them from a solved case.  Some read the states of the case, others load the
case further (`coupling`, `drive-tension`, ...): they are small experiments on the same manipulator.  To add one, write
a class in the file of its family and name it in `AnyMetric`.
"""

from typing import Annotated

from pydantic import Field

from prb3r.study.metrics.drive import ChangingPoint, DriveTension
from prb3r.study.metrics.position import CurvatureError, LocusError, Position, Shift
from prb3r.study.metrics.reach import Follow, Workspace
from prb3r.study.metrics.response import Coupling, FrictionDirection, Loop, TipCompliance
from prb3r.study.metrics.strength import LimitLoad, Safety, Stability

AnyMetric = Annotated[
    Position
    | Shift
    | CurvatureError
    | LocusError
    | Coupling
    | Workspace
    | Follow
    | DriveTension
    | FrictionDirection
    | Loop
    | TipCompliance
    | Safety
    | Stability
    | LimitLoad
    | ChangingPoint,
    Field(discriminator="kind"),
]
