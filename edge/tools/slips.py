"""Labels that are probably slips of whoever gave them."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher

from edge.labels import CATEGORY

FEW_SHARE = 0.25
"""A name is a slip of another one if it is at most so frequent in comparison."""
SHORT = 3
RARE_SHARE = 0.1
"""Letters of a name that others resemble by chance, so that only one that is at most so
frequent is a slip."""
LETTERS_PER_SLIP = 7
"""Letters of a name for each wrong one, of which one is always allowed."""
SPACES = re.compile(r"[\s_-]+")
MOST_NAMES = 500
MOST = 8
"""Sentences of a kind."""
MOST_PLACES = 3
"""Recordings that a sentence names."""

Labels = Sequence[Mapping[str, str]]
"""{task: label} of each recording."""


def slips(labels: Labels, places: Sequence[str]) -> list[str]:
    """A sentence for each kind of label that is probably a slip, with some of the places
    (n,) of the recordings.

    >>> slips([{"object": "box"}] * 8 + [{"object": "Box"}], list("abcdefghi"))
    ["object='Box' on 1 of 9 recordings (i); is it 'box'?"]
    """
    trials = list(zip(labels, places, strict=True))
    of_tasks = _by((task, place) for trial, place in trials for task in trial)
    sentences = _rare("task ", of_tasks, len(labels))
    odd = _by((CATEGORY.contradiction(trial), place) for trial, place in trials)
    for sentence, where in odd.items():
        if sentence:
            sentences.append(f"{sentence}, on {_some(where, len(labels))}")
    for task in sorted(of_tasks):
        given = _by((trial[task], place) for trial, place in trials if task in trial)
        sentences += _rare(f"{task}=", given, len(of_tasks[task]))
    return sentences


def _by(pairs: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """{name: its places}."""
    places: dict[str, list[str]] = {}
    for name, place in pairs:
        places.setdefault(name, []).append(place)
    return places


def _some(places: Sequence[str], total: int) -> str:
    """How many recordings of all, and the places of some."""
    more = f" and {len(places) - MOST_PLACES} more" if places[MOST_PLACES:] else ""
    named = "; ".join(places[:MOST_PLACES])
    return f"{len(places)} of {total} recordings ({named}{more})"


def doubts(labels: Labels) -> list[list[str]]:
    """Of each recording, a sentence for each label that is probably a slip, or
    contradicts others.

    >>> doubts([{"object": "box"}] * 8 + [{"object": "Box"}])[-1]
    ["object='Box': is it 'box'?"]
    """
    slip = {}
    for task in set().union(*labels):
        for name, likely in _likely(_label_counts(task, labels)).items():
            slip[task, name] = f"{task}={name!r}: is it {likely!r}?"
    sentences = []
    for trial in labels:
        named = [CATEGORY.contradiction(trial), *map(slip.get, trial.items())]
        sentences.append([sentence for sentence in named if sentence])
    return sentences


def too_few(labels: Labels) -> list[str]:
    """A sentence where the recordings are of two things, so that none can be unknown.

    >>> too_few([{"object": "box"}, {"object": "cup"}])
    ['record a third object, and the model can tell what it does not know']
    """
    kinds = {CATEGORY.task, *CATEGORY.factors}
    names = [set(trial.items()) for trial in labels]
    things = Counter(task for task, _ in set().union(*names) if task not in kinds)
    if things and max(things.values()) == 2:
        return ["record a third object, and the model can tell what it does not know"]
    return []


def counts_text(labels: Labels) -> list[str]:
    """A line for each task: how many recordings have each label."""
    lines = []
    for task in sorted(set().union(*labels)):
        counts = _label_counts(task, labels)
        total = counts.total()
        names = ", ".join(f"{label} {count}" for label, count in counts.most_common(12))
        more = f" and {len(counts) - 12} more" if len(counts) > 12 else ""
        lines.append(f"{task} ({total} of {len(labels)}): {names}{more}")
    return lines


def _label_counts(task: str, labels: Labels) -> Counter[str]:
    """How many recordings have each label of a task."""
    return Counter(trial[task] for trial in labels if task in trial)


def _rare(thing: str, places: Mapping[str, Sequence[str]], total: int) -> list[str]:
    """Sentences on the names that are probably slips.

    Args:
        thing: stands before each name.
        places: of the recordings with each name.
        total: recordings that could have one.
    """
    sentences = []
    likely = _likely({name: len(where) for name, where in places.items()})
    for name, where in sorted(places.items()):
        if name in likely:
            question = f"; is it {likely[name]!r}?"
            sentences.append(f"{thing}{name!r} on {_some(where, total)}{question}")
        elif len(where) == 1 and len(places) < total:
            sentences.append(f"{thing}{name!r} on a single recording ({where[0]})")
    return sentences[:MOST]


def _likely(counts: Mapping[str, int]) -> dict[str, str]:
    """{name: the more frequent one that it is probably a slip of}."""
    meant = {name: _meant(name, counts) for name in counts}
    return {name: other for name, other in meant.items() if other}


def _meant(name: str, counts: Mapping[str, int]) -> str | None:
    """The more frequent name that one is probably a slip of."""
    if len(counts) > MOST_NAMES:  # too many to be compared with each other
        return None
    plain = _plain(name)
    count = counts[name]
    share = FEW_SHARE if len(plain) > SHORT else RARE_SHARE
    for candidate, frequent in counts.items():
        is_rare = count <= share * frequent
        if is_rare and candidate != name and _alike(plain, _plain(candidate)):
            return candidate
        if _plain(candidate) == plain and (frequent, candidate) > (count, name):
            return candidate
    return None


def _plain(name: str) -> str:
    """A name without case and spaces."""
    return SPACES.sub("", name.casefold())


def _alike(first: str, second: str) -> bool:
    """Whether two names without case and spaces differ by few letters."""
    longest = max(len(first), len(second))
    if any(letter.isdigit() for letter in first + second) or longest < SHORT:
        return False
    matcher = SequenceMatcher(None, first, second)
    equal = sum(block.size for block in matcher.get_matching_blocks())
    return longest - equal <= max(1, longest // LETTERS_PER_SLIP)
