"""Fenced blocks of the README and the documentation, and how each language is run."""

import re
import shlex
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from markdown_it import MarkdownIt
from pydantic import TypeAdapter

from prb3r.cli import main
from prb3r.schema import FILES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MARKER = re.compile(r"<!-- (not run|long): (.+) -->")
COMMAND = re.compile(r"(?:\.venv/bin/)?prb3r ")


@dataclass(frozen=True)
class Block:
    """A fenced block; `file` is where its text belongs (```` ```toml studies/mine.toml ````)."""

    page: Path
    line: int
    language: str
    file: str
    text: str
    marker: str
    """Empty, `long` or `not run`."""
    reason: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks_of(page: Path) -> Iterator[Block]:
    """The blocks of a page, in order."""
    marker, reason = "", ""
    for token in MarkdownIt("commonmark").parse(page.read_text()):
        if token.type == "html_block" and (found := MARKER.match(token.content)):
            marker, reason = found.groups()
        elif token.type == "fence":
            language, _, file = token.info.strip().partition(" ")
            yield Block(page, token.map[0] + 1, language, file.strip(), token.content, marker, reason)
            marker, reason = "", ""


@dataclass
class Session:
    """What the blocks of one page share: a folder, a namespace, and what the last command printed."""

    folder: Path
    namespace: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    printed: str = ""

    def run(self, block: Block) -> None:
        """Run a block as its language asks for; whatever is wrong is raised."""
        getattr(self, f"_run_{block.language}")(block)

    def _run_python(self, block: Block) -> None:
        exec(compile(block.text, str(block), "exec"), self.namespace)

    def _run_toml(self, block: Block) -> None:
        data = tomllib.loads(block.text)
        if block.file:
            self._write(block)
        else:
            validate_fragment(data)

    def _run_csv(self, block: Block) -> None:
        self._write(block)

    def _run_text(self, block: Block) -> None:
        expected, rest, _ = block.text.partition("...\n")
        assert self.printed.startswith(expected) if rest else self.printed == expected, self.printed

    def _run_sh(self, block: Block) -> None:
        self.printed = ""
        rest: list[str] = []
        for line in block.text.replace("\\\n", "").splitlines():
            if COMMAND.match(line):
                self._shell(rest)
                self._command(line)
            else:
                rest.append(line)
        self._shell(rest)

    def _command(self, line: str) -> None:
        """Run the program in this process, which saves a second and a half each time."""
        words = shlex.split(line, comments=True)[1:]
        words, target = (words[:-2], words[-1]) if ">" in words[:-1] else (words, None)
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 0, f"{line}\n{done.output}"
        if target:
            (self.folder / target).write_text(done.stdout)
        else:
            self.printed += done.stdout

    def _shell(self, lines: list[str]) -> None:
        script = "\n".join(lines)
        lines.clear()
        if script.strip():
            subprocess.run(["bash", "-euc", script], cwd=self.folder, check=True, timeout=60)

    def _write(self, block: Block) -> None:
        path = self.folder / block.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text)


def validate_fragment(data: dict[str, Any]) -> None:
    """Check the keys of a part of a file against the kind of file that has them all."""
    for model in FILES.values():
        if data.keys() <= model.model_fields.keys():
            for name, value in data.items():
                TypeAdapter(model.model_fields[name].rebuild_annotation()).validate_python(value)
            return
    raise AssertionError(f"no file has all of {', '.join(data)}")
