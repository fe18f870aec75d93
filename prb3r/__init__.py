"""Design studies for cable-driven continuum manipulators: statics, friction, coupled segments."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from prb3r import effects
    from prb3r.errors import EngineError, Prb3rError, RecordingError, SpecError
    from prb3r.front.comparison import compare
    from prb3r.front.diagnoses import diagnose
    from prb3r.front.inverse import reach
    from prb3r.front.prediction import predict_on as predict
    from prb3r.front.studies import run_study
    from prb3r.model.manipulator import Manipulator, load_manipulator
    from prb3r.model.parts import Cable, Disk, Segment
    from prb3r.model.sensitivity import sensitivities
    from prb3r.model.solve import solve, solve_in_blocks
    from prb3r.present.study.drawing import plot
    from prb3r.recording.reading import load_recording
    from prb3r.study.spec import load_study

__version__ = "0.1.0"

_WHERE = {
    "Cable": "model.parts",
    "Disk": "model.parts",
    "EngineError": "errors",
    "Manipulator": "model.manipulator",
    "Prb3rError": "errors",
    "RecordingError": "errors",
    "Segment": "model.parts",
    "SpecError": "errors",
    "compare": "front.comparison",
    "diagnose": "front.diagnoses",
    "effects": "",
    "load_manipulator": "model.manipulator",
    "load_recording": "recording.reading",
    "load_study": "study.spec",
    "plot": "present.study.drawing",
    "predict": "front.prediction:predict_on",
    "reach": "front.inverse",
    "run_study": "front.studies",
    "sensitivities": "model.sensitivity",
    "solve": "model.solve",
    "solve_in_blocks": "model.solve",
}
"""Module of each public name (and its name there, if another); modules are imported when a name is first used, so that
compiled kernels, pandas and matplotlib load only when needed."""
__all__ = [
    "Cable",
    "Disk",
    "EngineError",
    "Manipulator",
    "Prb3rError",
    "RecordingError",
    "Segment",
    "SpecError",
    "__version__",
    "compare",
    "diagnose",
    "effects",
    "load_manipulator",
    "load_recording",
    "load_study",
    "plot",
    "predict",
    "reach",
    "run_study",
    "sensitivities",
    "solve",
    "solve_in_blocks",
]


def __getattr__(name: str):
    from importlib import import_module

    if name not in _WHERE:
        raise AttributeError(f"module 'prb3r' has no attribute {name!r}")
    where, _, defined = _WHERE[name].partition(":")
    offered = getattr(import_module(f"prb3r.{where}"), defined or name) if where else import_module(f"prb3r.{name}")
    globals()[name] = offered
    return offered


def __dir__() -> list[str]:
    return sorted(__all__)
