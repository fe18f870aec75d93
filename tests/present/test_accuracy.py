"""The bench's picture: every method where its time and its error are, with its name inside the frame."""

import numpy as np
import pandas as pd
import pytest

from prb3r.present.accuracy import accuracy_figure, publish_accuracy

METHODS = pd.DataFrame(
    {
        "method": ["engine", "engine, exact", "reference: fsolve on Eq. 12", "$slow$ reference"],
        "time_each_s": [6e-6, 7e-6, 2e-3, 3e-2],
        "tip_error_percent": [0.08, 2e-8, 0.08, 0.0],
    }
)


def test_methods_stand_at_their_time_and_error_with_their_names_inside():
    figure = accuracy_figure(METHODS)
    (axes,) = figure.axes
    figure.canvas.draw()
    marks = np.array([line.get_xydata()[0] for line in axes.lines])
    assert marks[:, 0] == pytest.approx([6, 7, 2000, 30000])
    assert marks[:3, 1] == pytest.approx([0.08, 2e-8, 0.08])
    frame = axes.get_window_extent()
    for name, text in zip(METHODS["method"], axes.texts, strict=True):
        box = text.get_window_extent()
        assert text.get_text().replace("\\$", "$") == name
        assert frame.x0 <= box.x0
        assert box.x1 <= frame.x1


def test_the_picture_is_written_twice(tmp_path):
    assert {path.name for path in publish_accuracy(METHODS, tmp_path)} == {
        *("error-against-time.png", "error-against-time.svg"),
    }
