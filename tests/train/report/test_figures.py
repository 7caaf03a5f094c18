"""Pictures of a report: the same numbers give the same bytes, for a page and for a
phone."""

import io

import numpy as np
import pytest
from matplotlib.image import imread

from train.report import figures
from train.report.figures import PHONE, confusion


def test_the_same_numbers_give_the_same_bytes_and_others_do_not():
    truth = np.array(["a", "a", "b"])
    answers = np.array(["a", "z", "b"])
    first = confusion("n", "t", truth, answers)
    assert first == confusion("n", "t", truth, answers)
    assert first.png != confusion("n", "t", truth, truth).png
    assert imread(io.BytesIO(first.narrow)).shape[1] == PHONE * 200


@pytest.mark.parametrize("classes", [2, 8, 36])
def test_a_confusion_matrix_has_names_on_both_sides(classes, monkeypatch):
    names = np.array([f"object {i:02}" for i in range(classes)])
    sides = []

    def spy(axes, counts, fontsize):
        for ticks in (axes.get_xticklabels(), axes.get_yticklabels()):
            sides.append([tick.get_text() for tick in ticks])

    monkeypatch.setattr(figures, "_draw_matrix", spy)
    confusion("n", "t", names, names)
    assert sides == [list(names)] * 4


def test_a_label_with_dollar_signs_is_no_formula():
    labels = np.array([r"a $\frac$ b", "c"])
    assert confusion("n", r"no $\frac$ either", labels, labels).png
