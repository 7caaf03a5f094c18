"""An arm is read from a TOML file, or from a URDF file between two links."""

import pytest

from edge.errors import InputError
from edge.touch.arm_file import read_arm


def test_a_urdf_is_read_between_two_links(urdf):
    assert read_arm(urdf, "base", "tool").dof == 3


def test_a_urdf_without_its_links_is_refused(urdf):
    with pytest.raises(InputError, match="a URDF needs --base and --tip"):
        read_arm(urdf)


def test_links_are_for_a_urdf_alone():
    with pytest.raises(InputError, match="--base and --tip are for a .urdf file"):
        read_arm("arm.toml", "base", "tool")
