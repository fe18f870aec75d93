"""Load programs that are proposed, with the explanations that they tell apart, in words and as files."""

from collections.abc import Sequence
from typing import NamedTuple

from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.search.experiment import Experiment
from prb3r.model.files.cells import written_out


class ProposedExperiment(NamedTuple):
    """A load program that is proposed, with the pairs of explanations that it is proposed for."""

    pairs: tuple[Separation, ...]
    """All of one load program (at least one)."""

    @property
    def experiment(self) -> Experiment:
        """The load program."""
        return self.pairs[0].experiment

    @property
    def separates(self) -> tuple[tuple[str, str], ...]:
        """Names of the two explanations of each pair."""
        return tuple((pair.first, pair.second) for pair in self.pairs)

    @property
    def separation(self) -> float:
        """Squared whitened distance of the pair that the program separates least."""
        return min(pair.experiment.separation for pair in self.pairs)

    @property
    def resolves(self) -> bool:
        """Whether the program tells some pair rightly."""
        return any(pair.experiment.resolves for pair in self.pairs)

    @property
    def statement(self) -> str:
        """The load program and how well it tells the explanations apart, in words."""
        told = [pair for pair in self.pairs if pair.experiment.resolves]
        others = [pair for pair in self.pairs if not pair.experiment.resolves]
        title, asked = self.experiment.title, written_out(self.experiment.asked, ".2g")
        sentences = []
        if told:
            sentences.append(
                f"{title[0].upper()}{title[1:]}: together with what is recorded, that tells {_pairs_in_words(told)} "
                f"({asked} is asked), enough to rank them rightly."
            )
        if others:
            nearest = "" if told else f"; {title} comes nearest"
            sentences.append(
                f"No load program that was tried tells {_pairs_in_words(others)}, where {asked} is asked{nearest}."
            )
        return " ".join(sentences)


def _pairs_in_words(pairs: Sequence[Separation]) -> str:
    """The explanations of pairs and the least distance between them, such as `a from b, by a squared distance of 3 in
    units of the noise`."""
    rivals = "; ".join(f"{pair.first} from {pair.second}" for pair in pairs).replace("_", " ")
    least = written_out(min(pair.experiment.separation for pair in pairs), ".2g")
    return f"{rivals}, by a squared distance of {least}{' or more' * (len(pairs) > 1)} in units of the noise"


def proposed(experiments: Sequence[Separation]) -> list[ProposedExperiment]:
    """The load programs of `experiments`, each title once, with all pairs that the program is proposed for.

    They stand in the order in which they come first.
    """
    by_title: dict[str, list[Separation]] = {}
    for pair in experiments:
        by_title.setdefault(pair.experiment.title, []).append(pair)
    return [ProposedExperiment(tuple(pairs)) for pairs in by_title.values()]


def files_of(programs: Sequence[ProposedExperiment]) -> dict[str, ProposedExperiment]:
    """Each load program by the name of its file, numbered if there are several."""
    names = [f"next_experiment{f'_{k}' if len(programs) > 1 else ''}.csv" for k in range(1, len(programs) + 1)]
    return dict(zip(names, programs, strict=True))
