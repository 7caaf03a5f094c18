"""The joints of a URDF file from one link to another, in order, or one sentence why
not."""

import pytest

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.urdf import arm_between

ARM = """<?xml version="1.0"?>
<robot name="r">
  <link name="base"/><link name="upper"/><link name="mount"/><link name="lower"/>
  <link name="tool"/><link name="aside"/>
  <joint name="elbow" type="revolute"><parent link="mount"/><child link="lower"/>
    <origin xyz="0.3 0 -1e-3" rpy="0.4 -0.5 0.6"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-2.5" upper="0" effort="1" velocity="1"/></joint>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/></joint>
  <joint name="bracket" type="fixed"><axis xyz="0 0 0"/><parent link="upper"/><child link="mount"/>
    <origin xyz="0 0.02 0.25"/></joint>
  <joint name="camera" type="fixed"><parent link="upper"/><child link="aside"/></joint>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="tool"/>
    <origin xyz="0.05 0 0" rpy="3 2 1"/><axis xyz="0.36 0.48 0.8"/>
    <limit upper="0.5" effort="1" velocity="1"/></joint>
</robot>"""


def test_a_urdf_gives_the_joints_from_base_to_tip_whatever_their_order_in_the_file(
    urdf,
):
    def names(tip):
        return [joint["name"] for joint in arm_between(urdf, "base", tip)["joint"]]

    assert names("lower") == ["shoulder", "bracket", "elbow"]
    assert names("aside") == ["shoulder", "camera"]
    with pytest.raises(InputError, match="link 'upper' is both base and tip"):
        arm_between(urdf, "upper", "upper")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("robot", "sdf", "not a URDF file: its root is <sdf> instead of <robot>"),
        (
            'link name="base"',
            'link name="world"',
            "no link 'base'; it has world, upper",
        ),
        (
            '<parent link="base"/>',
            '<parent link="lower"/>',
            "no chain of joints leads from",
        ),
        (
            "</robot>",
            '<joint name="other" type="fixed"><parent link="base"/>'
            '<child link="upper"/></joint></robot>',
            "joints 'shoulder' and 'other' both lead to link 'upper'",
        ),
        ('<child link="upper"/>', "", "joint 'shoulder' has no <child link=...>"),
        ("0.3 0 -1e-3", "0.3 0 x", "joint 'elbow': not numbers: could not convert"),
        (
            '<axis xyz="0.36 0.48 0.8"/>',
            '<mimic joint="elbow"/>',
            "joint 'slide' follows joint 'elbow'",
        ),
        ('"continuous"', '"floating"', "joint 'shoulder': type must be one of"),
    ],
)
def test_what_is_wrong_in_a_urdf_is_named(urdf, old, new, sentence):
    urdf.write_text(ARM.replace(old, new))
    with pytest.raises(InputError, match=r"arm\.urdf: .*") as caught:
        Chain.from_urdf(urdf, "base", "tool")
    assert sentence in str(caught.value)
