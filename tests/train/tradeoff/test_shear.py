"""What shear buys: times to an accuracy, paired gains, and its price on the wire."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from tests.train.tradeoff.examples import chosen, rule
from train.tradeoff import shear
from train.tradeoff.shear import KNOWN, UNSEEN, Answers, Compared
from train.tradeoff.wires import microcontroller, waited_s


def answers(shares, unseen=None, early=()):
    """Answers about mobility at windows of 0.2, 0.4, ... s."""
    unseen = unseen or [None] * len(shares)
    points = {}
    for i, (share, share_unseen) in enumerate(zip(shares, unseen, strict=True)):
        points[round(0.2 * (i + 1), 1)] = {
            "mobility": chosen(share, share_unseen, of=10)
        }
    rules = [rule(right=right, mean_s=seconds) for seconds, right in early]
    of_known = {"mobility": SimpleNamespace(certified=rules)}
    return Answers(points, {KNOWN: of_known, UNSEEN: {}})


def test_the_time_to_an_accuracy_is_the_first_window_from_which_it_is_kept():
    shear_answers = answers([9, 7, 9, 8])
    assert shear.reached_s(shear_answers.shares("mobility", KNOWN), 0.9) is None
    assert shear.reached_s(shear_answers.shares("mobility", KNOWN), 0.8) == 0.6
    assert shear.reached_s(shear_answers.shares("mobility", KNOWN), 0.7) == 0.2


def test_unseen_objects_have_times_of_their_own():
    shear_answers = answers([9, 9], unseen=[5, 8])
    assert shear.reached_s(shear_answers.shares("mobility", UNSEEN), 0.8) == 0.4
    assert shear.reached_s(answers([9, 9]).shares("mobility", UNSEEN), 0.1) is None


def test_early_decisions_have_the_shortest_mean_time_that_is_right_enough():
    shear_answers = answers([9], early=[(0.3, 75), (0.5, 90), (0.8, 95)])
    assert shear_answers.early_s("mobility", KNOWN, 0.9) == pytest.approx(0.5)
    assert shear_answers.early_s("mobility", KNOWN, 0.95) == pytest.approx(0.8)
    assert shear_answers.early_s("mobility", KNOWN, 0.99) is None
    assert shear_answers.early_s("mobility", UNSEEN, 0.9) is None


def test_gains_are_paired_differences():
    pair = Compared(answers([9, 9], [7, 7]), answers([8, 9], [8, 7]))
    first, second = shear.gains(pair)
    assert first["without %, known objects"] == 80.0
    assert first["with %, known objects"] == 90.0
    assert first["points, known objects"].startswith("+10 (")
    assert first["points, unseen objects"].startswith("-10 (")
    assert second["points, known objects"].startswith("+0 (")


def test_times_say_never_with_a_dash():
    pair = Compared(answers([9], early=[(0.1, 100)]), answers([7]))
    rows = {(row["right"], row["decision"]): row for row in shear.times(pair)}
    fixed = rows["90%", "fixed, known objects"]
    assert fixed["without s"] == "-"
    assert fixed["with s"] == "0.20"
    early = rows["95%", "early, known objects"]
    assert early["without s"] == "-"
    assert early["with s"] == "0.10"


def test_three_axes_take_three_times_the_bits(forearm):
    three = replace(forearm, axes=3)
    slower = microcontroller(three).frame_s / microcontroller(forearm).frame_s
    assert slower == pytest.approx(3.0, rel=0.01)
    assert waited_s(three, 100.0) > microcontroller(three).frame_s


def test_the_section_draws_every_task():
    shear_answers = answers([9, 9], [7, 8], early=[(0.3, 0.05)])
    section = shear.section(Compared(shear_answers, shear_answers))
    assert [table.name for table in section.tables] == ["shear_times", "shear"]
    assert section.figures[0].png.startswith(b"\x89PNG")
