"""Labels that are probably slips of whoever gave them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from difflib import SequenceMatcher
from itertools import chain

from edge.record.labels import CATEGORY

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
MOST = 20
"""Sentences."""
MOST_PLACES = 3
"""Recordings that a sentence names."""

Labels = Sequence[Mapping[str, str]]
"""{task: label} of each recording."""


def slips(labels: Labels, places: Sequence[str]) -> list[str]:
    """A sentence for each label that is probably a slip or contradicts others, with
    some of the places (n,) of its recordings.

    >>> slips([{"object": "box"}] * 8 + [{"object": "Box"}], list("abcdefghi"))
    ["object='Box': is it 'box'? (1 of 9 recordings: i)"]
    """
    where: dict[str, list[str]] = {}
    for place, sentences in zip(places, doubts(labels, singles=True), strict=True):
        for sentence in sentences:
            where.setdefault(sentence, []).append(place)
    return [
        f"{sentence} ({len(named)} of {len(labels)} recordings: "
        f"{', '.join(named[:MOST_PLACES])}{', ...' * (len(named) > MOST_PLACES)})"
        for sentence, named in list(where.items())[:MOST]
    ]


def doubts(labels: Labels, *, singles: bool = False) -> list[list[str]]:
    """Of each recording, a sentence for each task or label that is probably a slip, or
    contradicts others, or (`singles`) that no other one has.

    >>> doubts([{"object": "box"}] * 8 + [{"object": "Box"}])[-1]
    ["object='Box': is it 'box'?"]
    """
    doubtful = _doubtful(labels, singles)
    sentences = []
    for trial in labels:
        names = [*(("", task) for task in trial), *trial.items()]
        named = [CATEGORY.contradiction(trial), *map(doubtful.get, names)]
        sentences.append(list(filter(None, named)))
    return sentences


def _doubtful(labels: Labels, singles: bool) -> dict[tuple[str, str], str]:
    """{(task, label), or ("", task): a sentence} of those that are probably slips."""
    doubtful = {}
    tasks = Counter(chain(*labels))
    of_tasks = {task: _label_counts(task, labels) for task in sorted(tasks)}
    for task, counts in {"": tasks, **of_tasks}.items():
        likely = _likely(counts)
        total = counts.total() if task else len(labels)
        for name, count in counts.items():
            text = f"{task}={name!r}" if task else f"task {name!r}"
            if name in likely:
                doubtful[task, name] = f"{text}: is it {likely[name]!r}?"
            elif singles and count == 1 and len(counts) < total:
                doubtful[task, name] = f"{text} stands alone"
    return doubtful


def too_few(labels: Labels) -> list[str]:
    """A sentence where the recordings are of two objects, so that none can be unknown.

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
