"""Successive halving: what is clearly behind on the first folds is fitted no further.

A choice without fold i is made by the fits without folds i and j, for every j. The
folds, and a place for the choice by all trials, stand in a circle. The first fits are
those of the j near to i. Candidates that are clearly behind on these trials, in a
paired comparison, are dropped from the choice without fold i; then come the j further
away. No trial of fold i takes part in what is dropped, so the accuracy of the choice
stays a nested one. The same trials give the same choice.
"""

from itertools import combinations_with_replacement

Pair = tuple[int, int]
"""Two folds that a fit leaves out; a fold twice where it is left out alone."""
REACHES = (2, 4)
"""How far the folds of the first fits are, and of the second ones; the last fits have
all others."""


def fold_pairs(count: int, nested: bool) -> list[Pair]:
    """The folds that the fits leave out: each alone, and each two where `nested`."""
    if nested:
        return list(combinations_with_replacement(range(count), 2))
    return [(fold, fold) for fold in range(count)]


def rungs(count: int, nested: bool) -> list[tuple[int, list[Pair]]]:
    """How far the folds of the first fits are, and these fits; and so on."""
    pairs = fold_pairs(count, nested)
    steps = []
    # A step that leaves a single fold for the next one saves nothing.
    reaches = [reach for reach in REACHES if 2 * reach + 1 < count]
    for reach in (*reaches, count):
        near = [
            pair
            for pair in pairs
            if _distance(*choices_of(pair, count), count) <= reach
        ]
        pairs = [pair for pair in pairs if pair not in near]
        steps.append((reach, near))
    return [(reach, near) for reach, near in steps if near]


def choices_of(pair: Pair, count: int) -> Pair:
    """The choices that a fit serves: those without its folds; `count` stands for that
    by all trials."""
    first, second = pair
    return first, count if first == second else second


def folds_near(choice: int, reach: int, count: int) -> list[int]:
    """The folds within some places of a choice's own."""
    folds = [fold for fold in range(count) if fold != choice]
    return [fold for fold in folds if _distance(choice, fold, count) <= reach]


def _distance(a: int, b: int, count: int) -> int:
    """Places between two in the circle."""
    gap = abs(a - b)
    return min(gap, count + 1 - gap)
