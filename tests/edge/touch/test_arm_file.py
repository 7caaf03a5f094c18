"""The arm that a user names, in a TOML file or between two links of a URDF."""

import pytest

from edge.errors import InputError
from edge.touch.arm_file import read_arm


def test_a_urdf_is_read_between_two_links(urdf):
    assert read_arm(urdf, "base", "tool").dof == 3


def test_a_xacro_file_is_called_one_although_links_are_named(urdf):
    path = urdf.rename(urdf.with_suffix(".urdf.xacro"))
    with pytest.raises(InputError, match="is a xacro macro, not a URDF file"):
        read_arm(path, "base", "tool")
