"""The arm's joints among those that a source names."""

import pytest

from edge.errors import InputError
from edge.touch.joint_angles import joint_columns


def test_joints_that_a_source_lacks_are_named_with_those_that_it_has():
    sentence = "no angle of the arm's joints b, c; there are a, d"
    with pytest.raises(InputError, match=sentence):
        joint_columns(["a", "d"], ["b", "a", "c"])
