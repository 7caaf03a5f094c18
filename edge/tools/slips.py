"""Labels that are probably slips of whoever gave them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
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

Labels = Sequence[Mapping[str, str]]
"""{task: label} of each recording."""


def slips(labels: Labels) -> list[str]:
    """A sentence for each kind of label that is probably a slip.

    >>> slips([{"object": "box"}] * 8 + [{"object": "Box"}])
    ["object='Box' on 1 of 9 recordings; is it 'box'?"]
    """
    tasks = Counter(task for trial in labels for task in trial)
    sentences = _rare("task ", tasks, len(labels))
    for sentence, count in Counter(map(CATEGORY.contradiction, labels)).items():
        if sentence:
            sentences.append(f"{sentence}, on {count} of {len(labels)} recordings")
    for task in sorted(tasks):
        counts = _label_counts(task, labels)
        sentences += _rare(f"{task}=", counts, counts.total())
    return sentences


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


def _rare(thing: str, counts: Mapping[str, int], total: int) -> list[str]:
    """Sentences on the names that are probably slips.

    Args:
        thing: stands before each name.
        counts: of the recordings with each name.
        total: recordings that could have one.
    """
    sentences = []
    likely = _likely(counts)
    for name, count in sorted(counts.items()):
        if name in likely:
            sentences.append(
                f"{thing}{name!r} on {count} of {total} recordings; is it "
                f"{likely[name]!r}?"
            )
        elif count == 1 and len(counts) < total:
            sentences.append(f"{thing}{name!r} on a single recording")
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
