"""Mutated files: whatever a study, a manipulator or a recording says, checking it ends with a sentence.

`make fuzz COUNT=100000` tries so many mutations of the shipped files and names those that end otherwise: a traceback,
a hang, a file written.  The same numbers give the same files.
"""

import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

from prb3r.check import check_file
from prb3r.errors import Prb3rError

STUDIES = Path(__file__).parents[1] / "studies"
LONGEST_S, LONGEST_WAIT_S = 60, 900
"""How long checking a file may take: of the processor, which a busy machine shares out, and by the clock."""
VALUES = (
    *(
        "0",
        "-1",
        "1",
        "1e308",
        "-1e-308",
        "nan",
        "inf",
        "-inf",
        "9" * 400,
        "0x7fffffffffffffff",
        "1e5",
        "100000",
        "true",
    ),
    *(
        '""',
        '"\\u0000"',
        '"../../x"',
        '"/dev/zero"',
        '"$\\\\foo$"',
        '"=1+1"',
        '"tip"',
        '"case_id"',
        '"segment.1.plates"',
    ),
    *("[]", "{}", "[[]]", "[1, 'a']", "[nan]", "{ a = 1 }", "1979-05-27", "[" * 200 + "]" * 200, "'''", "\ufeff"),
)
"""What is put in place of a value."""


def originals() -> list[Path]:
    """The files that are mutated."""
    return sorted(STUDIES.rglob("*.toml"))


def mutated(text: str, words: list[str], rng: random.Random) -> str:
    """The text with one to four changes: values, keys and lines exchanged, repeated or left out, letters replaced."""
    for _ in range(rng.randint(1, 4)):
        lines = text.split("\n")
        k = rng.randrange(len(lines))
        change = rng.randrange(7)
        if change <= 1:
            lines[k] = re.sub(r"=.*", lambda _: "= " + rng.choice(VALUES), lines[k], count=1)
        elif change == 2:
            lines[k] = re.sub(r"[\w.+-]+", lambda found: rng.choice([found[0], rng.choice(words)]), lines[k])
        elif change == 3:
            del lines[k]
        elif change == 4:
            lines.insert(rng.randrange(len(lines)), lines[k])
        elif change == 5:
            other = rng.randrange(len(lines))
            lines[k], lines[other] = lines[other], lines[k]
        else:
            place = rng.randrange(len(text) + 1)
            lines = (
                text[:place] + chr(rng.choice([0, 9, 34, 39, 91, 123, 0x2028, 0x1F600])) + text[place + 1 :]
            ).split("\n")
        text = "\n".join(lines)
    return text


def outcome(path: Path) -> str:
    """What checking a file led to: `right`, `refused`, or else the end of the traceback; warnings are errors."""
    running = [True]

    def too_long(*_: object) -> None:
        if running:
            raise TimeoutError(f"no answer within {LONGEST_S} s of the processor or {LONGEST_WAIT_S} s by the clock")

    before = {number: signal.signal(number, too_long) for number in (signal.SIGALRM, signal.SIGPROF)}
    signal.alarm(LONGEST_WAIT_S)
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_file(path, None)
    except Prb3rError as error:
        return "refused" if str(error).strip() else "refused without a word"
    except Exception:
        return "\n".join(traceback.format_exc().splitlines()[-4:])
    finally:
        running.clear()
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
    return "right"


def tried(numbers: range, folder: Path) -> Iterator[tuple[int, Path, str]]:
    """Number, original and outcome of mutations; they stand beside what the originals name, in a copy in `folder`."""
    home = folder / "studies"
    shutil.copytree(STUDIES, home)
    files = originals()
    texts = {path: path.read_text() for path in files}
    words = sorted(set(re.findall(r"[\w.+-]+", "\n".join(texts.values()))))
    kept = sorted(home.rglob("*"))
    for number in numbers:
        rng = random.Random(number)
        path = rng.choice(files)
        place = home / path.relative_to(STUDIES)
        place.write_text(mutated(texts[path], words, rng), errors="replace")
        found = outcome(place)
        place.write_text(texts[path])
        yield number, path, found if sorted(home.rglob("*")) == kept else "has written files"


def main(count: int) -> int:
    """Try so many mutations; the number of those that did not end with a sentence."""
    began, counts, bad = time.monotonic(), {"right": 0, "refused": 0}, 0
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for done, (number, path, found) in enumerate(tried(range(count), Path(folder)), 1):
            if found in counts:
                counts[found] += 1
            else:
                bad += 1
                print(f"mutation {number} of {path.name}: {found}\n", flush=True)
            if done % 1000 == 0:
                print(f"{done} of {count}, {counts}, {bad} bad, {time.monotonic() - began:.0f} s", flush=True)
    print(f"{count} mutations of {len(originals())} files: {counts}, {bad} ended otherwise")
    return bad


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])) > 0)
