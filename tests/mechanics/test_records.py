"""Records of chains that differ by little are those that each would have alone."""

import numpy as np
import pytest
from prototype import ELASTICA, PRB_3R, random_chain

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate_law import Contact, Hysteresis, Law
from prb3r.mechanics.records import differing, pack, pack_held_beside


def others_of(chain):
    """Chains that differ from `chain` in one field each, in all that records hold, and in none."""
    several = np.linspace(0.9, 1.1, chain.plates)
    changes = {
        "plate": chain.plate._replace(end=chain.plate.end * 1.01, stiffness=chain.plate.stiffness * 0.9),
        "arc": chain.arc * several,
        "clamp": chain.clamp + 0.001,
        "disk": 0.007,
        "stiffness": chain.stiffness * several[:, None],
        "rest": chain.rest + 0.01,
        "offset": chain.offset * 1.1,
        "reach": np.minimum(chain.reach, 1),
        "friction": chain.friction * (several > 1)[:, None],
        "presliding": 1e-4,
        "edges": True,
        "clearance": 1e-3,
        "pulley": np.full(len(chain.reach), 0.9),
        "law": Law(knee=2.0, ratio=0.5, sharpness=3.0),
        "hysteresis": Hysteresis(0.3, 1.5, 2),
        "curvature": chain.plate.stiffness * 0.5,
        "contact": Contact(0.1, 20.0),
        "cable_stiffness": 0.1 * chain.stiffness,
        "softening": 0.01,
        "relaxation": 0.2,
        "relaxation_time": 5.0,
        "friction_exponent": 0.2,
        "friction_tension": 3.0,
        "wrap_saturation": 0.4,
        "hole_drag": 0.3,
        "umbilical": 0.05,
    }
    return [chain, *(chain._replace(**{name: value}) for name, value in changes.items())]


@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["springs", "elastica"])
@pytest.mark.parametrize("share", [0.0, 0.2])
def test_packed_beside_another_a_chain_is_as_packed_alone(plate, share):
    chain = random_chain(np.random.default_rng(2), plate=plate)._replace(hysteresis=Hysteresis(share, 1.0))
    others = others_of(chain)[: None if share == 0 else -10]  # whose stiffness slips like that of the first
    together = pack_held_beside(pack(chain, held=True), [(other, differing(other, chain)) for other in others])
    for k, other in enumerate(others):
        alone = pack(other, held=True)
        for name, records, wanted in zip(together._fields, together, alone, strict=True):
            for field in wanted.dtype.names:
                np.testing.assert_array_equal(records[k][field], wanted[field], err_msg=f"{name} {field} of other {k}")


def test_every_field_that_records_hold_makes_them_differ():
    """But for those that say what of the loads acts and by which clock, and the segments."""
    chain = random_chain(np.random.default_rng(2))
    changed = [differing(other, chain) for other in others_of(chain)]
    assert changed[0] == set()
    assert all(len(names) == 1 for names in changed[1:])
    elsewhere = {"segment", "tied", "constant", "closure", "tip_efficiency", "disk_efficiency", "gain", "quadratic"}
    elsewhere |= {"play", "zero_drift", "friction_rate", "friction_reference", "friction_excess", "friction_decay"}
    elsewhere |= {"friction_drift", "tilt", "gravity", "hanger", "relaxation_step"}
    assert set().union(*changed) == set(Chain._fields) - elsewhere
    alone = [b"".join(field.tobytes() for field in pack(other)) for other in others_of(chain)]
    assert len(set(alone)) == len(alone)
