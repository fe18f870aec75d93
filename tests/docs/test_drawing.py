"""The drawing of dimensions names every length that a manipulator file has."""

import sys

from docs.blocks import ROOT

from prb3r import Cable, Disk, Segment


def test_every_length_of_a_file_is_drawn():
    sys.path.insert(0, str(ROOT / "docs/site"))
    try:
        from dimensions import dimensions
    finally:
        sys.path.remove(str(ROOT / "docs/site"))
    drawn = " ".join(text.get_text() for axes in dimensions().axes for text in axes.texts)
    fields = [name for part in (Cable, Disk, Segment) for name in part.model_fields if name.endswith("_m")]
    assert [name for name in fields if name not in drawn] == ["outer_fibre_m"]  # not of a strip
