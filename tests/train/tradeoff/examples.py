"""Choices and measurements that are made up, for tests of the trade-off."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from train.choose.evaluate import NestedAccuracy
from train.choose.settings import Chosen
from train.model.pipeline import Choice
from train.tradeoff.commands import Commands
from train.tradeoff.early import EarlyDecisions
from train.tradeoff.measured import Measurements

BUILD = Path("build/tradeoff")


def chosen(right, unseen=None, of=100):
    """A choice that answers so many trials rightly, and so many of unseen objects
    where these were left out."""

    def result(count):
        return NestedAccuracy(count, of, hits=np.arange(of) < count)

    held_out = "trial" if unseen is None else "object"
    accuracy = result(right if unseen is None else unseen)
    return Chosen(Choice("IV", 1, 1), accuracy, result(right), held_out)


def rule(error=0.1, right=95, mean_s=0.5, unseen=None):
    """Early decisions of 100 contacts, so many of them right, and so many of 100
    contacts with unseen objects where these were left out."""

    def hits(count):
        return None if count is None else np.arange(100) < count

    return EarlyDecisions(error, mean_s, hits(right), hits(unseen))


def measured(points, certified, **changes):
    """Measurements of {window: {task: choice}} with {task: certified rules}."""
    facts = {
        "y": dict.fromkeys(certified, np.array(["a"])),
        "points": points,
        "certified": certified,
        "costs": [],
        "board": SimpleNamespace(arithmetic_s=0.0, name="a board"),
        "commands": Commands(("mine",), Path("a.npz"), BUILD),
        "wire_s": 0.0,
    }
    return Measurements(**{**facts, **changes})
