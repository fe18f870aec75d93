"""Metrics: numbers that describe a case, one class for each kind.

A metric names its columns and computes them from solved cases.  Some read the states of a case, others solve further
loads on the same manipulator (`coupling`, `drive-tension`, ...).  To add one, write a class in the file of its family
and name it in `AnyMetric`.
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
