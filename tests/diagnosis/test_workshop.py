"""Bands on another design hold how exactly its plates are made: each segment as a whole, and every plate."""

import json

import numpy as np
import pytest
from diagnosis.simulated import diagnosed, manipulator

from prb3r import predict
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.workshop import common_stiffness_sd
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Tolerance

ROUGH = 0.02
"""Relative standard deviation of thicknesses."""
REACH = 1.96
"""Of a 95 % band, standard deviations."""


def made_of(*segments):
    plain = manipulator()
    (plate, *_), ends = plain["segment"], len(segments)
    cables = [cable | {"ends_at_segment": min(cable["ends_at_segment"], ends)} for cable in plain["cable"]]
    return Manipulator.model_validate(plain | {"segment": [plate | {"plates": n} for n in segments], "cable": cables})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A diagnosis whose recording states a tolerance of thicknesses alone, and leaves little open of the rest."""
    folder = tmp_path_factory.mktemp("rough")
    write_record(diagnosed(), folder)
    record = json.loads((folder / "diagnosis.json").read_text())
    exact = dict.fromkeys(record["posterior"]["tolerance"], 0.0)
    record["posterior"]["tolerance"] = exact | {"thickness_relative": ROUGH}
    (folder / "diagnosis.json").write_text(json.dumps(record))
    return folder


@pytest.mark.long
@pytest.mark.parametrize(
    ("segments", "first", "tip"), [((4, 4), 2.0, 1 / 2 + 1 / 8), ((8,), 2.0, 1 + 1 / 8)], ids=["two", "one"]
)
def test_a_band_is_as_wide_as_plates_made_each_and_in_segments_scatter(folder, segments, first, tip):
    """A cable's moment bends each plate by thickness^-3.  The first angle has the variance of a segment and of a plate,
    3 ROUGH each; the tip's, a mean over plates, that of segments and plates over their numbers."""
    pulled = {"sequence": ["a"], "step": [1], "cable_1_n": [2.0]}
    table = predict(folder, made_of(*segments), pulled, draws=600).positions
    width = (table["angle_high_rad"] - table["angle_low_rad"]) / table["angle_rad"].abs()
    for row, variance in ((1, first), (8, tip)):
        assert width[row] == pytest.approx(2 * REACH * 3 * ROUGH * np.sqrt(variance), rel=0.12), row


def test_what_no_recording_tells_from_the_modulus_is_in_the_bands():
    """The thickness of an only segment: of the recorded rig, unless others tell it apart, of the other one, of both."""
    one, two, known = made_of(6), made_of(3, 3), Tolerance(thickness_relative=ROUGH)
    shares = [common_stiffness_sd(here, there, known, False) for here in (one, two) for there in (one, two)]
    assert shares == pytest.approx([3 * ROUGH * np.sqrt(2), 3 * ROUGH, 3 * ROUGH, 0.0])
    assert common_stiffness_sd(one, one, known, True) == pytest.approx(3 * ROUGH)
