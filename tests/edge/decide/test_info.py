"""Confidence from distances, rules by their certified error, refusals, and the
unknown."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from edge.config import ConfigTable
from edge.decide.early import fastest, is_fixed, refusal, stopping_rules
from edge.decide.info import KnownDistance, Stopping, StoppingRule, margin
from edge.decide.metadata_reader import read_known_distance, read_stopping
from edge.decide.unusual import unusual
from edge.errors import InputError


class TestMargin:
    def test_is_how_much_farther_the_nearest_other_label_lies(self):
        assert margin([1.0, 4.0, 3.0], 0) == 2.0
        assert margin([1.0, 4.0, 3.0], 1) == -3.0

    def test_without_another_label_there_is_nothing_to_weigh(self):
        assert margin([4.0], 0) == 0.0

    @pytest.mark.parametrize(
        ("distances", "expected"),
        [
            ((0.0, math.inf), math.inf),
            ((math.inf,) * 2, -math.inf),
        ],
    )
    def test_what_is_infinitely_far_is_no_evidence_for_a_label(
        self,
        distances,
        expected,
    ):
        assert margin(distances, 0) == expected


def stopping(**changes):
    ways = ((0.10, 1.2, 2.0, 2), (0.15, 0.8, 0.9, 2), (0.25, 0.4, 0.6, 2))
    rules = tuple(StoppingRule(*way) for way in ways)
    curves = (1.0, 1.0, 2.0), (0.0, 0.0, -1.0), (0.0, 1.0, 2.0), 0.5, 0.0, 1.0
    return replace(Stopping(*curves, rules, trials=140, wrong=7, risk=0.1), **changes)


def test_the_fastest_rule_that_is_certified_is_taken():
    assert fastest(stopping(), 0.05) is None
    assert [fastest(stopping(), error).mean_s for error in (0.1, 0.2, 0.9)] == [
        1.2,
        0.8,
        0.4,
    ]


@pytest.mark.parametrize(
    ("point", "evidence", "excess", "odds"),
    [
        (0, 1.0, 0.0, math.e),
        (2, -1.0, 0.0, math.exp(-3)),
        (0, 1e300, 0.0, 1e300),
        (0, 0.0, 0.5, 1.0),
        (1, 0.0, 0.5, math.exp(-0.5)),
    ],
)
def test_confidence_is_the_logistic_function_of_the_margin_less_the_doubt(
    point, evidence, excess, odds
):
    confidence = stopping().confidence(point, [0.0, evidence], 0, excess=excess)
    assert confidence == pytest.approx(odds / (1 + odds))


def test_a_refusal_names_the_smallest_error_and_how_many_trials_would_do():
    text = refusal(stopping(), 0.08)
    assert "the smallest error that 140 calibration trials certify is 0.100" in text
    trials = int(text.split("about ")[1].split()[0])
    # So many trials with the same share of errors pass the exact binomial test.
    wrong = math.floor(trials * 7 / 140)
    tail = sum(
        math.comb(trials, k) * 0.08**k * 0.92 ** (trials - k) for k in range(wrong + 1)
    )
    assert 0.0025 < tail <= 0.05


def test_a_refusal_asks_for_more_trials_than_there_were():
    """However many there were: a rule may have failed that so many could have
    certified."""
    text = refusal(stopping(trials=10_000, wrong=0), 0.09)
    assert text.endswith("0.09 needs about 10001 trials")


def test_where_the_full_window_errs_more_often_trials_do_not_help():
    assert "more trials alone will not do" in refusal(stopping(wrong=21), 0.15)
    assert "needs about" in refusal(stopping(wrong=0), 0.01)


KNOWN_DISTANCE = KnownDistance(
    limits=(3.0, 4.0),
    middles=(math.e, 2.0),
    slopes=(1.0, 5.0),
    worth={"unknown": 0.46, "sure": 0.09},
)


def table(stored):
    return ConfigTable(asdict(stored), "model.onnx", "stopping.t.")


def of_three(**changes):
    """The rules of three decision points, read again."""
    return read_stopping(table(stopping(**changes)), 3)


def of_two(**changes):
    """The limits of two."""
    return read_known_distance(table(replace(KNOWN_DISTANCE, **changes)), 2)


def test_what_is_stored_is_read_again():
    assert of_three() == stopping()
    assert of_two() == KNOWN_DISTANCE


@pytest.mark.parametrize(
    ("read", "changes", "says"),
    [
        (of_three, {"slopes": (1.0, 1.0)}, "slopes must be a list of 3 numbers"),
        (
            of_three,
            {"slopes": (1.0, 1e308, 1.0)},
            "slopes must be a number from 1e-12 to 1e",
        ),
        (
            of_three,
            {"rules": (StoppingRule(0.1, 1.0, 0.9, 3),)},
            "rules 0: last must be .* 0 to 2, not 3",
        ),
        (of_three, {"wrong": 141}, "wrong must be a whole number from 0 to 140, not"),
        (of_two, {"limits": (1.0,)}, "limits must be a list of 2 numbers, not"),
        (of_two, {"slopes": (1.0, -1.0)}, "slopes must be a number of at least 0, not"),
        (of_two, {"worth": {"sure": 1.5}}, "worth.sure must be a number from 0 to 1,"),
    ],
)
def test_what_contradicts_itself_is_refused(read, changes, says):
    with pytest.raises(InputError, match=f"model.onnx: stopping.t.{says}"):
        read(**changes)


@pytest.mark.parametrize(
    ("point", "score", "known"),
    [(0, 1.0, 1 / (1 + math.exp(-1))), (0, math.e, 0.5), (1, 2.0, 0.5), (0, 0.0, 1.0)],
)
def test_the_farther_a_thing_the_less_likely_it_is_known(point, score, known):
    assert KNOWN_DISTANCE.known(point, score) == pytest.approx(known)


@pytest.mark.parametrize(
    ("means", "phrase"),
    [
        ((5.0, 1.0), "each feature is usual, but not all of them together"),
        ((11.0, 1.0), "max force higher than in training"),
        ((11.0, 0.0), "skin area lower than in training"),
    ],
)
def test_what_is_farthest_from_its_usual_range_is_said(means, phrase):
    usual = {"log_max_force@5": (0.0, 10.0), "sqrt_skin_area@20": (0.5, 1.5)}
    assert unusual(np.array(means), (1, 1), usual) == phrase


@pytest.mark.parametrize(
    ("confidence", "fixed"),
    [(1.0, False), (math.nextafter(1.0, 2.0), True)],
)
def test_only_a_rule_that_no_confidence_meets_waits_for_a_fixed_window(
    confidence, fixed
):
    assert is_fixed(StoppingRule(0.1, 1.0, confidence, 3)) is fixed


@pytest.mark.parametrize("error", [0.0, 1e-320, 1.0, math.nan])
def test_an_error_rate_lies_inside_0_to_1(error):
    with pytest.raises(InputError, match="must be at least 1e-06 and below 1"):
        stopping_rules(None, error)
