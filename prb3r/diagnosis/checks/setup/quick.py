"""Predictions that are quick though friction follows the load path: of what may be wrong they show enough."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.prediction import Predictor, predictor
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


def quick_predictor(recording: Recording, settings: Settings) -> Predictor:
    """What predicts a recording's readings; where friction follows the load path as if every cable had slipped in all
    its holes the way that its tension has changed, which is near enough to see what may be wrong."""
    predict = predictor(recording, settings)
    if predict.chain.presliding == 0:
        return predict
    slipped = recording.loads._replace(slip=slips_as_pulled(recording.loads.tension, recording.begins))
    return replace(predict, recording=replace(recording, loads=slipped), chain=predict.chain._replace(presliding=0.0))


def slips_as_pulled(tension: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s, m) slip of each cable: -1 drawn in where its tension has grown, +1 paid out where it fell, else as before.

    Parameters
    ----------
    tension : (s, m) N.
    begins : (s,) where a sequence begins, from rest.
    """
    before = np.where(begins[:, None], 0.0, np.concatenate([0 * tension[:1], tension[:-1]]))
    slip = -np.sign(tension - before)
    for s in range(1, len(slip)):
        if not begins[s]:
            slip[s] = np.where(slip[s] == 0, slip[s - 1], slip[s])
    return slip
