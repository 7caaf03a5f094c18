"""What an owner hears of a skin that is not quite the model's."""

from dataclasses import replace

import pytest

from edge.touch.differences import differences
from edge.touch.layout import SkinLayout


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"dead": (3, 4)}, "2 taxels are dead that were alive in training"),
        ({"counts_per_newton": 900.0}, "a newton is 900 counts, and 1000 in training"),
        ({"pitch_m": 0.02}, "taxels are 20 x 20 mm apart, and 10 x 10 mm in training"),
    ],
)
def test_what_differs_from_the_models_skin_is_said(changes, sentence):
    model = SkinLayout(4, 4, counts_per_newton=1000.0, pitch_m=0.01)
    (difference, *_) = differences(model, replace(model, **changes))
    assert sentence in difference
    assert differences(model, model) == []
