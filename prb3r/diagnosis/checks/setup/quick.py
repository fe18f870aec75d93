"""Quick predictions where friction follows the load path, near enough to show which blunders are promising."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.prediction import Predictor, predictor
from prb3r.diagnosis.settings import Settings
from prb3r.model.steps import tension_changes
from prb3r.recording.recording import Recording


def quick_predictor(recording: Recording, settings: Settings) -> Predictor:
    """A predictor of the recording's readings that follows no history.

    Effects that follow the load path are left out.  Where the friction of the manipulator follows it, a cable is taken
    to slip at all holes the way that its tension has changed; elsewhere slip is as declared.
    """
    predict, manipulator = predictor(recording, settings), recording.manipulator
    if not manipulator.follows_history:
        return predict
    loads, declared = recording.loads, [effect for effect in manipulator.effect if not effect.follows_history]
    if manipulator.friction.direction == "history":
        loads = loads._replace(slip=slips_as_pulled(loads.tension, recording.begins))
    without = replace(recording, manipulator=manipulator.model_copy(update={"effect": declared}), loads=loads)
    return replace(predict, recording=without, chain=predict.chain._replace(presliding=0.0))


def slips_as_pulled(tension: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s, m) slip of each cable: -1 drawn in where its tension has grown, +1 paid out where it fell, else as before; 0
    until its tension first changes.

    Parameters
    ----------
    tension : (s, m) N.
    begins : (s,) whether a sequence begins there, from rest.
    """
    slip = -np.sign(tension_changes(tension, begins))
    for s in range(1, len(slip)):
        if not begins[s]:
            slip[s] = np.where(slip[s] == 0, slip[s - 1], slip[s])
    return slip
