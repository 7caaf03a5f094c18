"""The joints of a URDF file from one link to another, in order, or one sentence why not."""

import pytest

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.urdf import joints_between

ARM = """<?xml version="1.0"?>
<robot name="r">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="aside"/>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.3 0 -1e-3" rpy="0 1.5 0"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="0" effort="1" velocity="1"/></joint>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/></joint>
  <joint name="camera" type="fixed"><parent link="upper"/><child link="aside"/></joint>
</robot>"""


@pytest.fixture
def joints(tmp_path):
    def read(text, base="base", tip="lower"):
        path = tmp_path / "arm.urdf"
        path.write_text(text)
        return joints_between(path, base, tip)

    return read


def test_the_chain_runs_from_base_to_tip_whatever_the_order_of_the_file(joints):
    assert [joint["name"] for joint in joints(ARM)] == ["shoulder", "elbow"]
    assert [joint["name"] for joint in joints(ARM, "upper", "aside")] == ["camera"]
    assert joints(ARM, "upper", "upper") == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<robot", "<sdf", "not a URDF file"),
        ('link name="base"', 'link name="world"', "no link 'base'; it has world, upper"),
        ('<parent link="base"/>', '<parent link="lower"/>', "no chain of joints leads from"),
        ('<parent link="base"/>', '<parent link="upper"/>', "no chain of joints leads from"),
        ('<child link="upper"/>', "", "joint 'shoulder' has no <child link=...>"),
        ("0.3 0 -1e-3", "0.3 0 x", "joint 'elbow': not numbers: could not convert"),
        (
            '<axis xyz="0 1 0"/>',
            '<mimic joint="shoulder"/>',
            "joint 'elbow' follows joint 'shoulder' (<mimic>)",
        ),
        ('lower="-2.5"', 'lower="low"', "joint 'elbow': not numbers: could not convert"),
    ],
)
def test_what_is_wrong_is_named(joints, old, new, said):
    with pytest.raises(InputError, match=r"arm\.urdf: .*") as caught:
        joints(ARM.replace(old, new))
    assert said in str(caught.value)


def test_an_origin_of_two_numbers_is_named_by_the_chain(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace("0.3 0 -1e-3", "0.3 0"))
    with pytest.raises(InputError, match="joint 'elbow': origin_xyz must be a list of 3 numbers"):
        Chain.from_urdf(path, "base", "lower")


def test_a_file_that_is_not_there_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        joints_between(tmp_path / "none.urdf", "a", "b")
