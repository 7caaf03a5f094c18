"""Plots of a report: the same numbers give the same bytes."""

import numpy as np

from train.report.figures import confusion


def test_the_same_numbers_give_the_same_bytes_and_others_do_not():
    truth, said = np.array(["a", "a", "b"]), np.array(["a", "b", "b"])
    first = confusion(truth, said, "said")
    assert first.startswith(b"\x89PNG")
    assert first == confusion(truth, said, "said")
    assert first != confusion(truth, truth, "said")


def test_a_label_that_was_only_said_has_a_row_without_trials():
    assert confusion(np.array(["a"]), np.array(["z"]), "said").startswith(b"\x89PNG")
