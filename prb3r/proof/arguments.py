"""Words after `python -m prb3r.proof...`: the run of a proof that a command is about."""

import argparse
from collections.abc import Collection, Sequence


def of_a_run(
    description: str, classes: Collection[str], default: Sequence[str] = (), case: bool = False
) -> argparse.Namespace:
    """The words as `seed`, `cases`, `classes` and, if a recording is asked for (`case`), `case` and `folder`.

    Ends the program with a message and exit code 2 where they are wrong.

    Parameters
    ----------
    description : what the command does.
    classes : names of the classes that it takes.
    default : classes where none is given; empty: all.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seed", type=int, help="of the run")
    parser.add_argument("cases", type=int, help="recordings of the run")
    if case:
        parser.add_argument("case", type=int, help="number of the recording, from 0")
        parser.add_argument("folder", help="where it is written")
    parser.add_argument("classes", nargs="*", metavar="class", help=f"of the run: {', '.join(classes)}")
    asked = parser.parse_args()
    asked.classes = asked.classes or list(default)
    if unknown := [name for name in asked.classes if name not in classes]:
        parser.error(f"there is no class {unknown[0]!r}; the classes are {', '.join(classes)}")
    if asked.cases < 1:
        parser.error("a run has one recording at least")
    if case and not 0 <= asked.case < asked.cases:
        parser.error(f"there is no recording {asked.case}: a run of {asked.cases} has 0 to {asked.cases - 1}")
    return asked
