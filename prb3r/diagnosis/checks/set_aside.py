"""Which sequences are set aside before anything is fitted."""

import numpy as np

from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Loads


def set_aside(
    of_sequence: np.ndarray, loads: Loads, seed: int, settings: Settings, read: np.ndarray | None = None
) -> tuple[int, ...]:
    """Numbers of the sequences that are set aside, drawn at random: at most `Settings.held_out_share` of them, but one
    at least; none of fewer than `Settings.fewest_sequences`.  Sequences without readings show nothing and do not count.

    What the recording shows twice the others must show twice, and what it shows once, once: every cable drawn in, paid
    out and pulled hard, every pair of cables pulled together, every load on the tip or on a disk.  Where none can be
    set aside so, once is enough, and where still none can, nothing is asked.  Sequences that pull no cable hard are set
    aside only where no other one can be: what acts by the cables does not show in them, and they could not judge it.

    Parameters
    ----------
    of_sequence : (s,) number of the sequence of each step.
    read : numbers of the sequences with readings; absent: all.
    """
    count = int(of_sequence.max()) + 1
    known = np.isin(np.arange(count), np.arange(count) if read is None else read)
    if known.sum() < settings.fewest_sequences:
        return ()
    pulled = loads.tension > 0
    hard = pulled & (loads.tension >= settings.hard_pull * loads.tension.max(0))
    way = np.concatenate([pulled & (loads.slip < 0), pulled & (loads.slip > 0), hard], 1)
    pairs = (pulled[:, :, None] & pulled[:, None, :]).reshape(len(pulled), -1)
    hung = np.concatenate([loads.tip != 0, (loads.force != 0).any(2)], 1)
    used = np.stack([np.concatenate([way, pairs, hung], 1)[of_sequence == k].any(0) for k in range(count)])
    used &= known[:, None]
    order, most = np.random.default_rng(seed).permutation(count), max(int(known.sum() * settings.held_out_share), 1)
    telling = known & np.array([hard[of_sequence == k].any() for k in range(count)])
    for among, least in ((telling, 2), (telling, 1), (known, 2), (known, 1), (known, 0)):
        chosen: list[int] = []
        for k in order[among[order]]:
            rest = np.delete(used, [*chosen, k], axis=0)
            if len(chosen) < most and (rest.sum(0) >= np.minimum(used.sum(0), least)).all():
                chosen.append(int(k))
        if chosen:
            break
    return tuple(sorted(chosen))
