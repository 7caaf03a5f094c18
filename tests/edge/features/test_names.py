"""Feature types by name."""

import pytest

from edge.errors import InputError
from edge.features.names import PAPER, feature_types, measures
from edge.touch.layout import SkinLayout


def test_zones_that_no_feature_calls_for_are_not_measured():
    def zones(*features):
        return measures(SkinLayout(5, 7), features).zones

    assert zones("skin_force", "left_area").names == ["skin", "left"]
    assert zones(*PAPER) is None


@pytest.mark.parametrize(
    ("features", "sentence"),
    [
        (["skin_forse"], "no feature 'skin_forse'; the nearest are skin_force"),
        (["max_force@1"], "must be taken at 2 to 10000 times"),
        (["zone_kernels_mean"], "takes no transform, summary or number of times"),
        (["log_sqrt_log_max_force"], "applies one transform twice"),
        (["sqrt_log_joint_change"], "has no logarithm; take sqrt_joint_change"),
        ([], "no feature named"),
        (["max_force", "skin_area", "max_force"], "max_force is named twice"),
    ],
)
def test_a_wrong_name_is_one_sentence(features, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        feature_types(tuple(features))
    assert "\n" not in str(caught.value)
