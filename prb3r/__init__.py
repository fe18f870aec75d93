"""Design studies for cable-driven continuum manipulators: statics, friction, coupled segments."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from prb3r.diagnosis.result.design_prediction import predict
    from prb3r.errors import EngineError, Prb3rError, RecordingError, SpecError
    from prb3r.front import diagnose
    from prb3r.inverse.reach import reach
    from prb3r.model.manipulator import Manipulator, load_manipulator
    from prb3r.model.sensitivity import sensitivities
    from prb3r.model.solve import solve
    from prb3r.recording.reading import load_recording
    from prb3r.study.run import run_study

__version__ = "0.1.0"

_WHERE = {
    "Manipulator": "prb3r.model.manipulator",
    "load_manipulator": "prb3r.model.manipulator",
    "solve": "prb3r.model.solve",
    "reach": "prb3r.inverse.reach",
    "sensitivities": "prb3r.model.sensitivity",
    "run_study": "prb3r.study.run",
    "load_recording": "prb3r.recording.reading",
    "diagnose": "prb3r.front",
    "predict": "prb3r.diagnosis.result.design_prediction",
    "Prb3rError": "prb3r.errors",
    "SpecError": "prb3r.errors",
    "RecordingError": "prb3r.errors",
    "EngineError": "prb3r.errors",
}
__all__ = [
    "EngineError",
    "Manipulator",
    "Prb3rError",
    "RecordingError",
    "SpecError",
    "diagnose",
    "load_manipulator",
    "load_recording",
    "predict",
    "reach",
    "run_study",
    "sensitivities",
    "solve",
]


def __getattr__(name: str):  # compiled kernels and pandas load when they are first needed
    from importlib import import_module

    if name in _WHERE:
        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'prb3r' has no attribute {name!r}")
