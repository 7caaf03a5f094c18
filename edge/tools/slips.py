"""Labels that are probably slips of whoever gave them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from difflib import SequenceMatcher

from edge.tools.teaching import JOINED, label_counts

RARE_SHARE = 0.1
"""A task that fewer of the recordings have is named."""
FEW_SHARE = 0.25
"""A label is a slip of another one if it is at most so frequent in comparison."""
ALIKE = 0.85
"""Similarity of two spellings, from 0 to 1, from which one is a slip of the other."""
SPACES = re.compile(r"[\s_-]+")
MOST = 8
"""Sentences of a kind."""

Labels = Sequence[Mapping[str, str]]
"""{task: label} of each recording."""


def slips(labels: Labels) -> list[str]:
    """A sentence for each kind of label that is probably a slip.

    >>> slips([{"object": "box"}] * 8 + [{"object": "Box"}])
    ["object='Box' on 1 of 9 recordings; is it 'box'?"]
    """
    sentences = [*_rare_tasks(labels), *_contradictions(labels)]
    for task in sorted(set().union(*labels)):
        sentences += _rare_labels(task, labels)
    return sentences


def counts_text(labels: Labels) -> list[str]:
    """A line for each task: how many recordings have each label."""
    lines = []
    for task in sorted(set().union(*labels)):
        counts = label_counts(task, labels)
        total = counts.total()
        parts = ", ".join(f"{label} {count}" for label, count in counts.most_common(12))
        more = f" and {len(counts) - 12} more" if len(counts) > 12 else ""
        lines.append(f"{task} ({total} of {len(labels)}): {parts}{more}")
    return lines


def _rare_tasks(labels: Labels) -> list[str]:
    counts = Counter(task for trial in labels for task in trial)
    sentences = []
    for task, count in sorted(counts.items()):
        meant = _meant(task, count, counts)
        if meant is not None or count <= RARE_SHARE * len(labels):
            question = "" if meant is None else f"; is it {meant!r}?"
            sentences.append(
                f"task {task!r} on {count} of {len(labels)} recordings{question}"
            )
    return sentences[:MOST]


def _rare_labels(task: str, labels: Labels) -> list[str]:
    counts = label_counts(task, labels)
    total = counts.total()
    sentences = []
    for label, count in sorted(counts.items()):
        meant = _meant(label, count, counts)
        if meant is not None:
            sentences.append(
                f"{task}={label!r} on {count} of {total} recordings; is it {meant!r}?"
            )
        elif count == 1 and len(counts) < total:
            sentences.append(f"{task}={label!r} on a single recording")
    return sentences[:MOST]


def _meant(name: str, count: int, counts: Mapping[str, int]) -> str | None:
    """The frequent name that a rare one is probably a slip of."""
    for other, frequent in counts.items():
        if other != name and count <= FEW_SHARE * frequent and _alike(name, other):
            return other
    return None


def _alike(name: str, other: str) -> bool:
    plain = SPACES.sub("", name.casefold())
    plain_other = SPACES.sub("", other.casefold())
    if plain == plain_other:
        return True
    if any(part.isdigit() for part in plain + plain_other) or len(plain) < 4:
        return False
    return SequenceMatcher(None, plain, plain_other).ratio() >= ALIKE


def _contradictions(labels: Labels) -> list[str]:
    """Sentences on trials whose category is not that of their softness and mobility."""
    product, *factors = JOINED
    contradictions = []
    for trial in labels:
        if trial.keys() >= set(JOINED):
            implied = "-".join(trial[factor] for factor in factors)
            if trial[product] != implied:
                contradictions.append(f"{trial[product]!r} beside {implied!r}")
    if not contradictions:
        return []
    return [
        f"{product} contradicts {' and '.join(factors)} on {len(contradictions)} of "
        f"{len(labels)} recordings, such as {contradictions[0]}"
    ]
