"""Figures and report of a diagnosis, beside its record."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from prb3r import __version__
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.projection import calibration, proposals
from prb3r.diagnosis.result.tables import detectable
from prb3r.present import style
from prb3r.present.diagnosis import words as say
from prb3r.present.diagnosis.evidence import moment_map, profiles, ranking
from prb3r.present.diagnosis.fits import held_out, residuals
from prb3r.present.diagnosis.shapes import misfits
from prb3r.present.diagnosis.sheet import Evidence
from prb3r.present.page import Table, picture, save_figure, templates
from prb3r.quantities import describe
from prb3r.runs.files import write_whole

FIGURES: dict[str, tuple[Callable[[Evidence], Figure | None], str]] = {
    "shapes": (
        misfits,
        "The steps that refitted constants miss most: measured and modelled above, the difference below.",
    ),
    "missing-moment": (
        moment_map,
        "Moment that would have to act on each plate, in addition, for the model to meet the readings. Rows and "
        "columns of one colour are physics, scattered pale cells are noise.",
    ),
    "ranking": (
        ranking,
        "Every kind of effect at the place where it helps most, tested on what refitted constants leave.",
    ),
    "profiles": (profiles, "How surely the recordings hold each parameter: all else is refitted at every point."),
    "residuals": (
        residuals,
        "Residuals in units of the noise, made independent of each other (values beyond 6 are in the outermost bars); "
        "a right model has a root mean square of 1 everywhere.",
    ),
    "held-out": (held_out, "The sequences that were set aside before anything was fitted."),
}
LISTED = 20
"""Up to how many outliers are listed."""


def publish_diagnosis(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    """Draw the figures of a diagnosis and write `report.html`; the files written.

    Raises
    ------
    EngineError
        If the folder does not take them.
    """
    evidence, files, pictures = Evidence(diagnosis), [], {}
    with matplotlib.rc_context(style.RC):
        for name, (draw, caption) in FIGURES.items():
            figure = draw(evidence)
            if figure is None:  # of an earlier diagnosis, if there is one
                for kind in ("png", "svg"):
                    (folder / f"{name}.{kind}").unlink(missing_ok=True)
                continue
            files += save_figure(figure, folder, name)
            pictures[name] = picture(folder, name, caption)
    page = templates().get_template("diagnosis.html.j2").render(content(evidence), pictures=pictures)
    return [*files, write_whole(folder / "report.html", page.encode())]


def content(evidence: Evidence) -> dict[str, object]:
    """What the page says."""
    diagnosis = evidence.diagnosis
    return {
        "name": diagnosis.recording.name,
        "verdict": say.verdict(diagnosis),
        "quality": say.fit_quality(diagnosis),
        "where": diagnosis.mismatch.statement,
        "effects": [each.statement for each in diagnosis.named],
        "partial": diagnosis.verdict == "unexplained",
        "closure": say.closure(diagnosis),
        "parameters": _parameters(diagnosis),
        "errors": _errors(diagnosis),
        "held_out": say.held_out(diagnosis),
        "alternatives": list(say.alternatives(diagnosis)),
        "nothing_else": say.nothing_else(diagnosis),
        "nothing_to_measure": say.nothing_to_measure(diagnosis),
        "proposals": [(each.statement, _steps(each.experiment.steps)) for each in proposals(diagnosis)],
        "constants": _constants(diagnosis),
        "hidden": list(say.hidden(diagnosis)),
        "clues": _clues(diagnosis),
        "detectable": _detectable(diagnosis),
        "outliers": _outliers(evidence),
        "remarks": diagnosis.remarks,
        "made": list(_made(diagnosis)),
    }


def _parameters(diagnosis: Diagnosis) -> Table | None:
    rows = []
    for each in diagnosis.named:
        name = say.effect(each.hypothesis)
        gain = "–" if each.heldout_gain is None else say.percent(each.heldout_gain)
        for key, value in each.parameters.items() or [("", None)]:
            texts = [say.quantity(key, part) for part in value] if value else ["–"] * 3
            interval = "–" if value is None or value.low is None else f"{texts[1]} to {texts[2]}"
            label = say.parameter(key) if key else "–"
            rows.append([name, label, texts[0], interval, say.number(each.delta_bic), gain])
    head = ["Effect", "Parameter", "Value", "95 % interval", "Change of BIC", "Held-out gain"]
    return Table(head, rows, (0, 1)) if rows else None


def _errors(diagnosis: Diagnosis) -> Table:
    held, named = diagnosis.heldout, bool(diagnosis.named)
    explained = diagnosis.explained.reduced if named else None
    first = [say.number(each) for each in (diagnosis.nominal_chi2, diagnosis.calibrated.reduced, explained, 1.0)]
    rows = [["Squared error per degree of freedom, fitted sequences", *first]]
    if held is not None:
        for what, unit in (("positions", "m"), ("angles", "rad")):
            before, after, noise = (
                getattr(held, f"{key}_{unit}") for key in ("rmse_calibrated", "rmse_explained", "noise")
            )
            if before is not None:
                values = [say.quantity(f"error_{unit}", each) for each in (before, after if named else None, noise)]
                rows.append([f"Root mean square error of {what}, held out", "–", *values])
    return Table(["", "Nominal", "E and μ refitted", "With what is named", "Noise alone"], rows)


def _constants(diagnosis: Diagnosis) -> Table:
    models = {"nominal": "Nominal", "calibrated": "Refitted alone", "explained": "With what is named"}
    if not diagnosis.named:
        del models["explained"]
    rows = []
    for name, found in calibration(diagnosis).items():
        if name in say.CONSTANTS and found["nominal"]:
            ends = [say.quantity(name, found[key]) for key in ("low", "high")]
            interval = f"{ends[0]} to {ends[1]}" if np.isfinite(found["low"]) else "–"
            rows.append([say.CONSTANTS[name], *(say.quantity(name, found[key]) for key in models), interval])
    return Table(["", *models.values(), "95 % interval"], rows)


def _clues(diagnosis: Diagnosis) -> Table | None:
    def factor(value: float | None, sd: float | None) -> str:
        return "–" if value is None or sd is None else f"{value:.3f} ± {sd:.3f}"

    def away(value: float | None, sd: float | None) -> float:
        return 0.0 if value is None or not sd else abs(value - 1) / sd

    rows = []
    for each in diagnosis.clues:
        far = max(away(each.stiffness, each.stiffness_sd), away(each.friction, each.friction_sd))
        values = factor(each.stiffness, each.stiffness_sd), factor(each.friction, each.friction_sd)
        part = re.sub(r"^disks (\d+) to \1$", r"disk \1", each.part)
        rows.append([each.by, part, *values, f"{far:.1f} sd"])
    return Table(["By", "Part", "E, factor", "μ, factor", "Farthest from 1"], rows, (0, 1)) if rows else None


def _detectable(diagnosis: Diagnosis) -> Table | None:
    rows = []
    for each in detectable(diagnosis).to_dict("records"):
        if np.isfinite(each["size"]):
            size = f"{say.parameter(each['parameter'])} by {say.quantity(each['parameter'], each['size'])}"
        else:
            size = "would have shown" if each["shown"] else "would not have shown at any likely size"
        rows.append([each["effect"].replace("_", " "), each["place"] or "–", size])
    return Table(["Effect", "Seen best at", "Smallest change that would have shown"], rows, (0, 1, 2)) if rows else None


def _outliers(evidence: Evidence) -> Table | None:
    rows = evidence.residuals
    fitted = rows[~rows["held_out"]].iloc[evidence.diagnosis.outliers]
    texts = []
    for row in fitted.head(LISTED).to_dict("records"):
        values = [say.quantity(row["kind"], row[key]) for key in ("measured", "explained")]
        what = describe(row["kind"]).symbol or row["kind"]
        done = "weighed down" if row["weighed_down"] else ""
        texts.append([str(row["sequence"]), str(row["step"]), str(row["disk"]), what, *values, done])
    if len(fitted) > LISTED:
        texts.append(["and more", f"{len(fitted) - LISTED}", *[""] * 5])
    head = ["Sequence", "Step", "Disk", "Reading", "Measured", "Predicted", ""]
    return Table(head, texts, (0, 3, 6)) if texts else None


def _steps(steps: pd.DataFrame) -> Table:
    """A load program, without columns that are the same nothing everywhere."""
    loads = [name for name in steps if name not in ("sequence", "step") and not str(name).startswith("slip_")]
    used = ["step", *(name for name in loads if (steps[name] != 0).any())]
    used += [name for name in steps if str(name).startswith("slip_") and (steps[name] != -1).any()]
    rows = [[style.digits(float(row[name])) for name in used] for row in steps.to_dict("records")]
    return Table([style.shown(describe(str(name))).label for name in used], rows, ())


def _made(diagnosis: Diagnosis) -> Iterator[tuple[str, str]]:
    recording = diagnosis.recording
    yield "Recording", recording.name
    yield "Manipulator", recording.manipulator.name
    yield (
        "Readings",
        f"{recording.readings.count:,} in {len(recording.steps)} steps of {len(recording.sequences)} sequences",
    )
    yield "Seed", str(diagnosis.seed)
    yield "Written by", f"prb3r {__version__}"
