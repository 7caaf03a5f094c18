"""Shares with shear and without, and the price of shear on the wire."""

from dataclasses import replace

import pytest

from tests.train.tradeoff.examples import chosen
from train.tradeoff.shear import KNOWN, UNSEEN, Answers
from train.tradeoff.wires import microcontroller, waited_s


def test_known_and_unseen_objects_have_shares_of_their_own():
    both = {"mobility": chosen(9, 5, of=10), "object": chosen(8, of=10)}
    answers = Answers({0.2: both})
    assert answers.tasks == ["mobility", "object"]
    assert answers.shares("mobility", KNOWN) == {0.2: 0.9}
    assert answers.shares("mobility", UNSEEN) == {0.2: 0.5}
    assert answers.shares("object", UNSEEN) == {0.2: None}


def test_three_axes_take_three_times_the_bits(forearm):
    three = replace(forearm, axes=3)
    slower = microcontroller(three).frame_s / microcontroller(forearm).frame_s
    assert slower == pytest.approx(3.0, rel=0.01)
    assert waited_s(three, 100.0) > microcontroller(three).frame_s
