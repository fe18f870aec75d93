"""Remarks of a diagnosis on its explanation: on the sets of effects that were found, and on the sequences set aside.

Each function returns sentences, and none where there is nothing to remark.
"""

from collections.abc import Sequence
from itertools import combinations

from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.checks.unseen import JudgedSequence, Unseen
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.search.assumed import Assumed, another_size
from prb3r.diagnosis.search.dissipating import DISSIPATING
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.selection import Choice, presence_of
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import NonlinearPlate
from prb3r.model.effects.sections import SuperelasticPlate


def not_predicted(failed: Sequence[JudgedSequence]) -> list[str]:
    """Sequences set aside that the explanation does not predict, a sentence each."""
    remarks = []
    for sequence in failed:
        beyond = f"its errors are {sequence.error_sd:.2g} times those that noise, tensions and the fit make probable"
        remarks.append(
            f"sequence {sequence.name}, which no fit has seen, is not predicted: "
            f"{'no equilibrium at some step' if sequence.lost else beyond}; "
            "look at its weights and its order, or at what it loads that no other sequence does"
        )
    return remarks


def predicted_by_others(choice: Choice, fresh: Unseen | None, failed: Sequence[JudgedSequence]) -> list[str]:
    """A sentence on the sequences set aside that the chosen set of effects does not predict, but other sets that stand
    do, so that on average over all none has `failed`."""
    if fresh is None or failed:
        return []
    missed = [sequence.name for sequence in fresh.by_sequence(choice.fitted) if sequence.p < fresh.rate]
    if not missed:
        return []
    which = f"sequence{'s' * (len(missed) > 1)} {listed(missed)}"
    who = "what is named does" if choice.kinds else "constants alone do"
    return [
        f"{who} not predict {which}, which no fit has seen; only other sets of effects that stand do: do not rely on "
        "these numbers"
    ]


def refuted_sets(choice: Choice, refuted: Sequence[Survivor]) -> list[str]:
    """Sets of effects that explain the fitted sequences as the chosen set does, but do not predict those set aside, a
    sentence each."""
    counts = [survivor for survivor in refuted if survivor.probability >= choice.fitted.model.settings.alike_rate]
    sets = {tuple(sorted(effect.name for effect in survivor.effects)) for survivor in counts}
    return [
        f"{' with '.join(names) or 'constants alone'}: would explain what was fitted too, but does not predict what no "
        "fit has seen"
        for names in sorted(sets)
    ]


def chosen_by(first: Fit, chosen: Fit, fresh: Unseen | None) -> list[str]:
    """A remark that the sequences set aside chose between models, and so confirm nothing, where the `chosen` fit is not
    the `first` choice."""
    if fresh is None or chosen is first:
        return []
    before, after = ({effect.name for effect in fitted.model.hypotheses} for fitted in (first, chosen))
    more, fewer = (", ".join(sorted(some)) for some in (after - before, before - after))
    aside = ", ".join(fresh.recording.sequences)
    if not fewer:
        verb = "are" if len(after - before) > 1 else "is"
        decided = f"decided that {more} {verb} named, which what was fitted shows less surely"
    else:
        decided = f"chose between {more or 'nothing more'} and {fewer}, which explain what was fitted alike"
    return [f"what was set aside ({aside}) {decided}: it confirms nothing"]


def what_it_takes(choice: Choice, with_them: Choice | None, failed: Sequence[str]) -> str:
    """A sentence on the effects that explain the unpredicted sequences set aside, once these are fitted too.

    Parameters
    ----------
    choice : from the fitted sequences alone.
    with_them : from all sequences; None where no constants bring all of them into balance.
    failed : names of the sequences that are not predicted.
    """
    asked = f"what it would take to predict {' and '.join(failed)}"
    if with_them is None or with_them.structured or not with_them.fitted.balanced:
        return f"{asked}: not known; fitted with the others it is not explained either"
    before, after = ({effect.name for effect in each.fitted.model.hypotheses} for each in (choice, with_them))
    if after == before:
        same = "the same effects at other sizes" if after else "other constants alone"
        return f"{asked}: {same}, which explain all sequences once they are fitted together"
    more, less = ", ".join(sorted(after - before)), ", ".join(sorted(before - after))
    change = f"{more} in the place of {less}" if more and less else f"{more} too" if more else f"no {less}"
    return (
        f"{asked}: {change}, as all sequences fitted together have it; nothing unseen confirms that: record more of "
        "its kind, or judge it on another recording (--holdout)"
    )


def found_before(assumed: Assumed, choice: Choice) -> list[str]:
    """Effects that were assumed but cannot be looked for here, and those that were not found again, each with the
    reason."""
    remarks = [f"assumed, but not looked for: {reason}" for reason in assumed.unknown]
    for hypothesis, sizes in assumed.values.items():
        if hypothesis not in choice.fitted.model.hypotheses:
            having = [survivor for survivor in choice.survivors if hypothesis in survivor.effects]
            share = sum(survivor.probability for survivor in having)
            fits = [survivor.fitted for survivor in having]
            fits = fits or sorted(choice.tried_with(hypothesis), key=lambda fitted: fitted.chi2)
            if fits and (other := another_size(fits[0], hypothesis, sizes)):
                how = f"these data contradict its size, {other}"
            elif share < choice.fitted.model.settings.alike_rate:
                how = "these data contradict it"
            else:
                how = f"these data do not tell it (probability {share:.2g})"
            remarks.append(f"assumed, but not found again: {hypothesis.name}: {how}")
    return remarks


def never_unloaded(choice: Choice, library: Sequence[Hypothesis]) -> list[str]:
    """A remark that plates which soften may as well dissipate, where the `library` holds no effect that dissipates, as
    no sequence unloads."""
    suspected = any(hypothesis.kind in DISSIPATING for hypothesis in library)
    softening = [effect.kind for effect in choice.fitted.effects if _softens(effect)]
    if suspected or not softening:
        return []
    return [
        f"plates that soften ({softening[0]}) and plates that dissipate ({', '.join(DISSIPATING)}) are alike here, as "
        "no sequence bends a plate back: unload in steps to tell them apart"
    ]


def _softens(effect: Effect) -> bool:
    """Whether plates soften under the effect, beyond a knee or on a plateau, without dissipation."""
    if isinstance(effect, NonlinearPlate):
        return effect.ratio is not None and effect.ratio < 1
    return isinstance(effect, SuperelasticPlate)


def as_many_as_sought(choice: Choice) -> list[str]:
    """A remark that the most probable model has as many effects as the search allows."""
    count, most = len(choice.survivors[0].effects), choice.fitted.model.settings.most_effects
    if count < most:
        return []
    sought = f"{most} effect{'s' * (most != 1)}, as many as are sought"
    return [f"the most probable model has {sought}: there may be more, or another one behind them"]


def likely_too(choice: Choice) -> list[str]:
    """Effects that are more likely there than not but are not named, a sentence each: where none is named, beside the
    named effects, or in the place of those that the models with that effect mostly lack."""
    remarks, first = [], choice.survivors[0]
    behind = max(survivor.log_evidence for survivor in choice.survivors) - first.log_evidence
    passed_over = behind > choice.fitted.model.settings.better_exchanged
    but = ", though the more probable sets with it leave more than noise" if passed_over else ""
    for name, probability in sorted(choice.likely.items(), key=lambda pair: -pair[1]):
        having = [s for s in choice.survivors if name in s.kinds or name in {one.name for one in s.effects}]
        beside = presence_of(having)
        gone = [named for named in sorted(choice.kinds) if beside.get(named, 0.0) < probability / 2]
        told = f"(probability {probability:.2f})"
        if gone:
            remarks.append(f"{name} is likelier there than not {told}, in the place of {' and '.join(gone)}{but}")
        else:
            so = "likely there too" if choice.kinds else "likelier there than not"
            remarks.append(f"{name} is {so} {told}, though not sure enough to be named")
    return [*remarks, *_only_together(choice)] or some_effect(choice)


def _only_together(choice: Choice) -> list[str]:
    """A sentence on every two kinds that are likelier there than not, but nearly always both at once
    (`Settings.any_presence`), as effects are of which one makes up for the other."""
    least, said = choice.fitted.model.settings.any_presence, []
    for one, other in combinations(sorted(choice.likely.keys() & choice.presence.keys()), 2):
        both = sum(survivor.probability for survivor in choice.survivors if {one, other} <= survivor.kinds)
        if both >= least * max(choice.likely[one], choice.likely[other]):
            said.append(
                f"{one} and {other} are likely only both at once (probability {both:.2f}): one makes up for the other "
                "in part, so that neither may be there"
            )
    return said


def some_effect(choice: Choice) -> list[str]:
    """A remark that some effect is likely there, where none is named and none is likelier there than not."""
    settings = choice.fitted.model.settings
    if choice.kinds or choice.structured or choice.of_any <= settings.positive_presence:
        return []
    shares = sorted(choice.presence.items(), key=lambda pair: -pair[1])
    told = [f"{kind.replace('_', ' ')} ({100 * p:.0f} %)" for kind, p in shares if p >= settings.told_presence]
    by = f", as {listed(told)} are possible" if told else ""
    likely = f"some effect is likely there (probability {choice.of_any:.2f})"
    return [f"{likely}{by}, though none is sure enough to be named"]


def not_ruled_out(choice: Choice) -> list[str]:
    """A remark on kinds of effects that may be there beside the named ones, though likelier not in all.

    Where none is named, there is none if :func:`some_effect` says so already.
    """
    beside = presence_of([survivor for survivor in choice.survivors if survivor.kinds >= choice.kinds])
    least = choice.fitted.model.settings.told_presence
    said = choice.kinds | choice.likely.keys()
    open_ = {kind: p for kind, p in beside.items() if kind not in said and least <= p <= 0.5}
    if not open_ or (not choice.kinds and some_effect(choice)):
        return []
    told = [f"{kind.replace('_', ' ')} ({100 * p:.0f} %)" for kind, p in sorted(open_.items(), key=lambda it: -it[1])]
    beside_what = " beside what is" if choice.kinds else ""
    return [f"not named, and not ruled out{beside_what}: {listed(told)}"]


def other_forms(named: Sequence[Named]) -> list[str]:
    """The forms of each named effect that cannot be told from one another, a sentence each; none of effects in one form
    alone."""
    remarks = []
    for effect in named:
        others = []
        for form in effect.forms:
            sizes = [f"{name} {value:.3g}" for name, value in form.parameters.items()]
            others.append(form.hypothesis.name + (f" with {listed(sizes)}" if sizes else ""))
        if others:
            remarks.append(
                f"one effect in {len(others) + 1} forms: {effect.hypothesis.name}, as said, and {listed(others)}; "
                "these readings do not tell between them, and where plates bend farther than recorded they may differ"
            )
    return remarks


def or_a_blunder(blunder: Blunder | None) -> list[str]:
    """A remark on a blunder of the set-up that is a rival of the named effects, if there is one."""
    if blunder is None:
        return []
    looks = blunder.statement.removesuffix(".").removeprefix("It looks")
    return [
        f"it looks{looks} just as well, which would explain these recordings with fewer effects: look at that before "
        "you believe what is named"
    ]


def as_the_file_has_it(fresh: Unseen, refitted: Fit, filed: Fit) -> list[str]:
    """A remark that the constants of the manipulator file predict the sequences set aside better than refitted ones."""
    errors = fresh.errors(refitted, filed)
    if errors.shown is None:
        return []
    refitted_to, filed_to, unit = errors.shown
    return [
        f"the constants of the manipulator file predict {listed(errors.sequences)}, which no fit has seen, to "
        f"{filed_to:.3g} {unit}, and those refitted to {refitted_to:.3g}: some of the fitted sequences pull them "
        "away, so that their loads or readings may not be what they are noted to be"
    ]


def against_the_best(checks: Sequence[ModelCheck], settings: Settings) -> list[str]:
    """The checks whose chance is too small for the best model to be right, with these chances."""
    rare = [
        f"{check.name} ({'below 0.0001' if check.p < 1e-4 else f'{check.p:.1g}'})"
        for check in checks
        if check.p < settings.naming_rate
    ]
    if not rare:
        return []
    return [f"checks with a chance of less than {settings.naming_rate:g} speak against what is said: {'; '.join(rare)}"]
