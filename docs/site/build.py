"""Build the documentation into plain HTML: `python docs/site/build.py -o results/docs`.

Pages are the Markdown files of `docs/` in the order of navigation.toml, what these link to in the repository, the
reference (reference.py, from docstrings, commands and schemas) and the gallery (gallery.py, from results).  No network.
"""

import argparse
import re
import shutil
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from jinja2 import Environment, FileSystemLoader

HERE = Path(__file__).parent
DOCS, ROOT = HERE.parent, HERE.parents[1]
sys.path.insert(0, str(HERE))

from gallery import gallery_text  # noqa: E402
from markup import Markup, pygments_css  # noqa: E402
from reference import reference_texts  # noqa: E402

from prb3r import __version__  # noqa: E402


@dataclass(frozen=True)
class Page:
    """A page to be: name without ending, Markdown, and the folder that its links start from."""

    name: str
    text: str
    folder: Path = DOCS

    @property
    def title(self) -> str:
        """Its first heading."""
        return re.search(r"^# (.+)$", self.text, re.M).group(1).replace("`", "")


def navigation(results: Path) -> list[dict[str, Any]]:
    """Groups of pages in reading order: `title`, `pages`."""
    made = {**reference_texts(), "gallery": gallery_text(results)}
    groups = []
    for group in tomllib.loads((HERE / "navigation.toml").read_text())["group"]:
        pages = [Page(name, (DOCS / f"{name}.md").read_text()) for name in group.get("pages", [])]
        pages += [Page(name, made[name]) for name in group.get("generated", [])]
        groups.append({"title": group["title"], "pages": pages})
    return groups


@dataclass
class Site:
    """Where links lead and what has to be copied for them."""

    output: Path
    names: dict[Path, str]
    """Names of pages by their Markdown files; those of the repository join when they are linked to."""

    def link(self, target: str, folder: Path) -> str:
        """The address of `target`, as linked to from Markdown in `folder`, on the site; files are copied to it.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        """
        path, mark, anchor = target.partition("#")
        if re.match(r"[a-z]+:", target) or not path:
            return target
        file = (folder / unquote(path)).resolve()
        if not file.exists():
            raise FileNotFoundError(f"{target}, linked to from {folder}")
        if file.is_dir():
            return self.link(f"{path.rstrip('/')}/README.md", folder)
        if file.suffix == ".md":
            name = self.names.setdefault(file, file.relative_to(ROOT).with_suffix("").as_posix().replace("/", "-"))
            return f"{name}.html{mark}{anchor}"
        inside = file.relative_to(ROOT) if file.is_relative_to(ROOT) else Path(*file.parts[-2:])
        copy = self.output / "files" / inside
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
        return f"files/{inside.as_posix()}{mark}{anchor}"


def build(output: Path, results: Path) -> list[Path]:
    """Write the site into `output`; figures of the gallery come from `results`.  The pages written."""
    output.mkdir(parents=True, exist_ok=True)
    groups = navigation(results)
    ordered = [page for group in groups for page in group["pages"]]
    site = Site(output, {(DOCS / f"{page.name}.md").resolve(): page.name for page in ordered})
    template = Environment(loader=FileSystemLoader(HERE), trim_blocks=True).get_template("page.html.j2")
    css = (HERE / "page.css").read_text() + pygments_css()
    written = []
    for page, before, after in _with_neighbours(ordered, site):
        body, sections = Markup(lambda target, folder=page.folder: site.link(target, folder)).html(page.text)
        file = output / f"{page.name}.html"
        html = template.render(
            name=page.name, title=page.title, body=body, sections=sections, css=css, version=__version__,
            groups=groups, before=before, after=after, open=True,
        )  # fmt: skip
        file.write_text(html, encoding="utf-8")
        written.append(file)
    return written


def _with_neighbours(ordered: list[Page], site: Site) -> Iterator[tuple[Page, Page | None, Page | None]]:
    """Pages of the navigation with those before and after, then those of the repository that they link to."""
    yield from zip(ordered, [None, *ordered], [*ordered[1:], None], strict=False)
    done = {page.name for page in ordered}
    while waiting := [(file, name) for file, name in site.names.items() if name not in done]:
        for file, name in waiting:
            done.add(name)
            yield Page(name, file.read_text(), file.parent), None, None


def main() -> None:
    """Build from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "results/docs")
    parser.add_argument("--results", type=Path, default=ROOT / "results", help="studies whose figures are shown")
    given = parser.parse_args()
    pages = build(given.output, given.results)
    print(f"{len(pages)} pages, the first is {given.output / 'index.html'}")


if __name__ == "__main__":
    main()
