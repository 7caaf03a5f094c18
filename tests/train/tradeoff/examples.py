"""Choices and measurements that are made up, for tests of the trade-off."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from train.choose.evaluate import Promise
from train.choose.settings import Chosen
from train.model.pipeline import Choice
from train.tradeoff.commands import Commands
from train.tradeoff.early import Certified
from train.tradeoff.measured import Measured

BUILD = Path("build/tradeoff")


def chosen(right, unseen=None, of=100):
    """A choice that answers so many trials rightly, and so many of unseen objects
    where these were left out."""

    def result(count):
        return Promise(count, of, hits=np.arange(of) < count)

    left_out = "trial" if unseen is None else "object"
    accuracy = result(right if unseen is None else unseen)
    return Chosen(Choice("IV", 1, 1), accuracy, result(right), left_out)


def rule(error=0.1, right=95, mean_s=0.5):
    """Early decisions of 100 contacts, so many of them right, half of them 0.1 s after
    the mean."""
    hits = np.arange(100) < right
    seconds = mean_s + np.where(np.arange(100) % 2, 0.1, -0.1)
    return Certified(error, hits, hits, 0.0, seconds)


def measured(points, certified, **changes):
    """Measurements of {window: {task: choice}} with {task: certified rules}, on a
    board that takes no time."""
    facts = {
        "y": dict.fromkeys(certified, np.array(["a"])),
        "points": points,
        "comparisons": {
            task: SimpleNamespace(certified=rules) for task, rules in certified.items()
        },
        "costs": [],
        "board": SimpleNamespace(arithmetic_s=0.0, name="a board"),
        "commands": Commands(("mine",), BUILD, BUILD / "board.json"),
        "wire_s": 0.0,
    }
    return Measured(**{**facts, **changes})
