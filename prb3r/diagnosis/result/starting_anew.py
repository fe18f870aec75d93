"""What is said of effects that go with the steps or with time, and begin anew with the steps that are predicted."""

from collections.abc import Iterable

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.suspect import OF_THE_COURSE, effect_in_words
from prb3r.markdown import listed
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import PlateRelaxation
from prb3r.model.step_checks import TIME


def starting_anew(effects: Iterable[Effect]) -> list[str]:
    """A sentence on the `effects` that grow from step to step, and one on plates that creep; none where there are
    neither."""
    known = list({effect.kind: effect for effect in effects if effect.kind in SUSPECTS}.values())
    growing = [effect_in_words(effect) for effect in known if SUSPECTS[effect.kind].transfer is OF_THE_COURSE]
    creeping = [effect_in_words(effect) for effect in known if isinstance(effect, PlateRelaxation)]
    remarks = []
    if growing:
        goes, begins = ("goes", "begins") if len(growing) == 1 else ("go", "begin")
        remarks.append(
            f"{listed(growing)} {goes} by the number of the step and {begins} anew at the first row of a table of "
            "steps: that is the rig as it was when its recording began; for one that goes on right after it, put the "
            "recorded steps before these, as sequences of their own, and leave their rows out of what comes out "
            f"(with {TIME} at the recorded pace alone, else without)"
        )
    if creeping:
        remarks.append(
            f"{listed(creeping)} begins anew with every sequence, of plates in which nothing has relaxed: for a rig "
            "that was loaded just before, put those steps first, in the same sequence"
        )
    return remarks
