"""Pictures of a report: the same numbers give the same bytes."""

import numpy as np

from train.report.figures import confusion


def test_the_same_numbers_give_the_same_bytes_and_others_do_not():
    truth = np.array(["a", "a", "b"])
    answers = np.array(["a", "z", "b"])
    first = confusion("n", "t", truth, answers)
    assert first == confusion("n", "t", truth, answers)
    assert first.png != confusion("n", "t", truth, truth).png


def test_a_label_with_dollar_signs_is_no_formula():
    labels = np.array([r"a $\frac$ b", "c"])
    assert confusion("n", r"no $\frac$ either", labels, labels).png
