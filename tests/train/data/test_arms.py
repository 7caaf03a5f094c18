"""The arm of a recording."""

from dataclasses import replace

import pytest

from edge.errors import InputError
from edge.touch.arm import Chain, Joint
from train.data.arms import arm_of, joint_angles


def test_an_arm_is_the_recordings_own_or_the_one_given_or_codys(make_touch):
    touch = make_touch()
    swing = Chain([Joint("swing", (0.0, 0.0, 1.0))])
    first_joint = replace(touch, joints=touch.joints[:, :1])
    assert arm_of(touch, "a").names == Chain.cody().names
    assert arm_of(first_joint, "a", swing) is swing
    with_arm = replace(first_joint, meta={**first_joint.meta, "arm": swing.to_dict()})
    assert arm_of(with_arm, "a").to_dict() == swing.to_dict()
    assert (
        arm_of(replace(first_joint, meta={**first_joint.meta, "arm": None}), "a", swing)
        is None
    )
    assert arm_of(make_touch(arm=False), "a", swing) is None


def test_recordings_have_the_same_number_of_joint_angles(make_touch):
    touch = make_touch()
    assert joint_angles([(touch, "a"), (touch, "b")]) == 5
    with pytest.raises(InputError, match="b: has no joint angles"):
        joint_angles([(touch, "a"), (make_touch(arm=False), "b")])
