"""Draw all dimensions of a manipulator file: `python docs/site/dimensions.py` writes docs/pictures/dimensions.png."""

from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

PICTURES = Path(__file__).parents[1] / "pictures"
LENGTH, CLAMP, DISK, PLATE = 72.0, 18.0, 10.0, 2.4
"""A plate with its clamps, a clamp, a disk, the thickness of a plate: as drawn, not to scale."""
PITCH, THIN = 34.0, 4.0
"""From disk to disk and the thickness of a disk, where the whole manipulator is drawn."""
OUTER, INNER, RADIUS = 25.5, 21.0, 29.0
"""Offsets of the cables and the radius of a disk, mm."""
STEEL, METAL, SLEEVE, ROPES = "#bb5566", "#c8ccd2", "#8f969f", ("#004488", "#997700")
STYLE = {"font.size": 8, "font.family": "DejaVu Sans", "svg.fonttype": "path", "svg.hashsalt": "prb3r"}


def dimensions() -> Figure:
    """A figure of two panels: the manipulator from the side, and one plate between two disks."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.1, 5.0), layout="constrained")
        whole, plate = figure.subplots(2, 1, height_ratios=[1, 1.4])
        _whole(whole)
        _plate(plate)
    return figure


def _whole(axes: Axes) -> None:
    """Two segments of three plates: disks, cables and where they end, axes, segments."""
    ends = 3 * PITCH, 6 * PITCH
    for number in range(7):
        axes.add_patch(Rectangle((number * PITCH - THIN, -RADIUS), THIN, 2 * RADIUS, color=METAL, lw=0))
        axes.text(number * PITCH - THIN / 2, -RADIUS - 4, str(number), ha="center", va="top", color="#555")
    axes.plot([0, ends[1] - THIN], [0, 0], color=STEEL, lw=1.6)
    for offset, end, name in [
        (OUTER, ends[1], "1"),
        (INNER, ends[0], "2"),
        (-INNER, ends[0], "3"),
        (-OUTER, ends[1], "4"),
    ]:
        colour = ROPES[abs(offset) == INNER]
        axes.plot([-22, end], [offset, offset], color=colour, lw=1)
        axes.plot([end], [offset], "o", color=colour, ms=3.5)
        axes.text(
            -23, offset, f"cable {name}", ha="right", va="bottom" if offset in (OUTER, -INNER) else "top", color=colour
        )
    for letter, head in (("x", (22, 0)), ("y", (0, 17))):
        axes.annotate("", head, (0, 0), arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
        axes.text(head[0] + 2, head[1] + 2, letter, va="bottom")
    _across(axes, 0, ends[0], RADIUS + 9, "[[segment]] 1: plates = 3")
    _across(axes, ends[0], ends[1], RADIUS + 9, "[[segment]] 2: plates = 3")
    axes.text(ends[1] + 4, OUTER, "ends_at_segment = 2", va="center", color=ROPES[0])
    axes.text(ends[0] + 4, INNER - 1, "ends_at_segment = 1", va="top", color=ROPES[1])
    axes.text(
        -THIN / 2, -RADIUS - 14, "number of the disk: 0 is the base, the last one the tip", va="top", color="#555"
    )
    _bare(axes, (-60, 262), (-RADIUS - 24, RADIUS + 18))


def _plate(axes: Axes) -> None:
    """One plate between two disks with every length that the file names."""
    far = LENGTH
    for left in (-DISK, far):
        axes.add_patch(Rectangle((left, -RADIUS), DISK, 2 * RADIUS, color=METAL, lw=0))
    for left in (0, far - CLAMP):
        axes.add_patch(Rectangle((left, -3.2), CLAMP, 6.4, color=SLEEVE, lw=0))
    axes.add_patch(Rectangle((0, -PLATE / 2), LENGTH, PLATE, color=STEEL, lw=0))
    for offset, colour in ((OUTER, ROPES[0]), (INNER, ROPES[1]), (-INNER, ROPES[1]), (-OUTER, ROPES[0])):
        axes.plot([-DISK - 4, far + DISK + 4], [offset, offset], color=colour, lw=1)
    axes.plot([-DISK - 22, far + DISK + 22], [0, 0], color="#888", lw=0.6, dashes=(12, 3, 2, 3))
    _across(axes, 0, LENGTH, 11, "length_m: of one plate, with its clamps")
    _across(axes, 0, CLAMP, -9, "clamp_m")
    _across(axes, LENGTH - CLAMP, LENGTH, -9, "clamp_m")
    _across(axes, CLAMP, LENGTH - CLAMP, -16, "arc that bends")
    _across(axes, far, far + DISK, -RADIUS - 5, "[disk] thickness_m", below=True)
    _along(axes, far + DISK + 9, 0, OUTER, "offset_m of cable 1\n(positive)")
    _along(axes, far + DISK + 9, -OUTER, 0, "offset_m of cable 4\n(negative)")
    axes.annotate(
        "thickness_m of a plate;\nits width_m goes\ninto the page",
        (CLAMP + 6, PLATE / 2), (-DISK - 8, 8), ha="right", va="center", arrowprops={"arrowstyle": "-", "lw": 0.6},
    )  # fmt: skip
    axes.text(-DISK - 8, -12, "position of a disk:\nits centre", ha="right", va="center")
    axes.plot([far + DISK / 2], [0], "k+", ms=9)
    axes.plot([-DISK / 2], [0], "k+", ms=9)
    axes.annotate("", (-DISK / 2, -0.5), (-DISK - 8, -10), arrowprops={"arrowstyle": "-", "lw": 0.6})
    _bare(axes, (-52, 118), (-RADIUS - 11, RADIUS + 3), aspect="auto")


def _across(axes: Axes, start: float, end: float, height: float, text: str, below: bool = False) -> None:
    axes.annotate(
        "",
        (end, height),
        (start, height),
        arrowprops={"arrowstyle": "|-|,widthA=.25,widthB=.25", "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
    )
    axes.text((start + end) / 2, height + (-1.5 if below else 1.5), text, ha="center", va="top" if below else "bottom")


def _along(axes: Axes, place: float, start: float, end: float, text: str) -> None:
    axes.annotate(
        "",
        (place, end),
        (place, start),
        arrowprops={"arrowstyle": "|-|,widthA=.25,widthB=.25", "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
    )
    axes.text(place + 2, (start + end) / 2, text, va="center")


def _bare(axes: Axes, width: tuple[float, float], height: tuple[float, float], aspect: str = "equal") -> None:
    axes.set(xlim=width, ylim=height, aspect=aspect)
    axes.axis("off")


def main() -> None:
    """Write the drawing."""
    PICTURES.mkdir(exist_ok=True)
    figure = dimensions()
    figure.savefig(PICTURES / "dimensions.png", dpi=160, facecolor="white")


if __name__ == "__main__":
    main()
