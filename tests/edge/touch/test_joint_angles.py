"""The arm's joints among those that a source names, and the speed of their angles."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.joint_angles import JointAngles, joint_columns
from tests.edge.decide.test_doubts import (
    LAYOUT,
    RATE,
    doubts_of_joints,
    moving,
    of_joints,
)
from tests.edge.touch.pressed import pressed


def test_joints_that_a_source_lacks_are_named_with_those_that_it_has():
    sentence = "no angle of the arm's joints b, c; there are a, d"
    with pytest.raises(InputError, match=sentence):
        joint_columns(["a", "d"], ["b", "a", "c"])


def test_the_speed_is_not_known_where_the_stream_begins_with_the_contact():
    felt = of_joints(moving, lead=5)
    assert np.isnan(felt.speed)
    assert doubts_of_joints(felt) == set()


def test_the_speed_is_not_known_where_angles_were_missing():
    reader = JointAngles(2)
    for t, joints in [(0.0, RATE), (0.1, None), (0.2, RATE), (0.3, RATE[:1])]:
        reader.watch(pressed(LAYOUT, t, {}, joints=joints))
        assert np.isnan(reader.speed)
