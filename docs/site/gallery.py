"""The gallery as Markdown: every figure of the shipped studies that have been run, with its study's question."""

import json
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


MOST_BYTES = 400_000
"""Of a drawing with lines; one that takes more is shown as a picture."""


def gallery_text(results: Path) -> str:
    """Figures in `results` of the studies in `studies/`, by study; says which have not been run."""
    parts = ["# Gallery", "The figures of the shipped studies; `make docs` runs what has not been run."]
    missing = []
    for file in sorted((ROOT / "studies").glob("*.toml")):
        study = tomllib.loads(file.read_text())
        folder = results / study["name"]
        figures = [_lighter(picture) for picture in sorted(folder.glob("*.png"))]
        if not figures:
            missing.append(study["name"])
            continue
        manifest = json.loads((folder / "manifest.json").read_text())
        captions = {plot["name"]: plot.get("caption", "") for plot in study.get("plot", [])}
        parts += [f"## {study['title']}", " ".join(study.get("question", "").split())]
        for figure in figures:
            caption = captions.get(figure.stem) or figure.stem.replace("-", " ")
            parts += [f"![{caption}]({figure.resolve()})", f"*{' '.join(caption.split())}*"]
        revision = (manifest.get("git") or {}).get("revision", "unknown")[:12]
        parts += [
            f"Study [`{study['name']}`](../{file.relative_to(ROOT)}), {manifest['written']}, revision {revision}."
        ]
    if missing:
        parts += [f"Not run yet: {', '.join(missing)}."]
    return "\n\n".join(parts) + "\n"


def _lighter(picture: Path) -> Path:
    """The SVG beside a PNG, which has its size on paper, unless it is heavy."""
    drawing = picture.with_suffix(".svg")
    return drawing if drawing.is_file() and drawing.stat().st_size <= MOST_BYTES else picture
