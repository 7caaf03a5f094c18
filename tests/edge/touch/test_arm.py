"""Kinematics against yourdfpy, and against angles that turn exactly."""

import math

import mpmath
import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.arm import Chain, Joint, read_arm


def test_a_urdf_chain_agrees_with_yourdfpy(urdf):
    chain = read_arm(urdf, "base", "tool")
    assert chain.names == ("shoulder", "elbow", "slide")
    assert chain.limits == (None, (-2.5, 0.0), (0.0, 0.5))
    yourdfpy = pytest.importorskip("yourdfpy", reason="a workstation's package")
    robot = yourdfpy.URDF.load(str(urdf), build_scene_graph=True, load_meshes=False)
    rng = np.random.default_rng(0)
    for q in rng.uniform(-3, 3, (50, 3)):
        robot.update_cfg(dict(zip(chain.names, q, strict=True)))
        expected = robot.get_transform("tool", "base")
        assert np.abs(chain.pose(q) - expected).max() < 1e-14


def test_a_chain_survives_its_metadata(urdf):
    for chain in (Chain.cody(), Chain.from_urdf(urdf, "base", "tool")):
        copy = Chain.from_dict(chain.to_dict())
        q = np.linspace(-1, 1, chain.dof)
        assert (copy.pose(q) == chain.pose(q)).all()
        assert (copy.names, copy.limits) == (chain.names, chain.limits)


@pytest.mark.parametrize(
    ("q", "word"),
    [
        ([0, 0], r"not an array \(2,\)"),
        ([0, 0, math.nan, 0, 0], "upper_arm_roll is not within 1e.06 rad"),
        (["a"] * 5, "must be numbers"),
    ],
)
def test_missing_extra_and_non_finite_angles_are_named(q, word):
    with pytest.raises(InputError, match=word):
        Chain.cody().pose(q)


@pytest.mark.parametrize("q", [[0, 0], [0, 0, math.nan, 0, 0]])
def test_a_point_takes_no_others(q):
    with pytest.raises(InputError):
        Chain.cody().point(q, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "joint must be"),
        ("speed = 1\n[[joint]]\naxis = [0, 0, 1]", "unknown key speed"),
        ("[[joint]]\naxis = [0, 0, 0]", "axis is zero"),
        ("[[joint]]\naxis = [0, 0, 1]\nlimits_deg = [3, 1]", "0.0523599 exceeds"),
        ("[[joint]]\nname = 'hip'\naxis = [0, 0]", "joint 'hip': axis"),
        ("[[joint]]\nname = 'a'\naxis = [0, 0, 1]\n" * 2, "are named 'a'"),
    ],
)
def test_a_wrong_toml_chain_is_named(text, word, tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=f"arm.toml: .*{word}"):
        read_arm(path)


@pytest.mark.parametrize("axis", [(1e-8, 1e-8, 0.0), (5.0, 5.0, 0.0)])
def test_an_axis_of_any_length_is_a_direction(axis):
    expected = Chain([Joint("j", (1.0, 1.0, 0.0))]).pose([1.0])
    assert Chain([Joint("j", axis)]).pose([1.0]) == pytest.approx(expected, abs=4e-16)


@pytest.mark.parametrize("angle", [1e-300, 1e-5, math.pi, 1e5])
def test_a_turn_of_any_size_loses_no_digit(angle):
    """Rodrigues' formula about (1, 1, 0), in 60 digits."""
    turned = Chain([Joint("j", (1.0, 1.0, 0.0))]).pose([angle])[:3, :3]
    with mpmath.workdps(60):
        half = mpmath.sin(mpmath.mpf(angle) / 2) ** 2
        across = mpmath.sin(angle) / mpmath.sqrt(2)
    assert turned[0, 1] == pytest.approx(float(half), rel=4e-15)
    assert turned[0, 2] == pytest.approx(float(across), rel=4e-15)


@pytest.mark.parametrize("seed", range(3))
def test_a_point_is_where_the_pose_takes_it(seed):
    """Turned joint by joint, it rounds no more than many whole poses at once do."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["revolute", "prismatic", "fixed", "continuous"], 6)
    joints = [
        Joint(
            f"j{i}",
            tuple(rng.normal(size=3)),
            kind=kind,
            origin_xyz=tuple(rng.normal(size=3)),
            origin_rpy=tuple(rng.normal(size=3)) if i % 2 else (0.0, 0.0, 0.0),
            translate=tuple(rng.normal(size=3)),
        )
        for i, kind in enumerate(kinds)
    ]
    for chain in (Chain(joints), Chain.cody(), Chain([])):
        q = rng.normal(size=(2, 3, chain.dof))
        at = rng.normal(size=3)
        poses = chain.pose(q)
        for i in np.ndindex(2, 3):
            expected = poses[i][:3, :3] @ at + poses[i][:3, 3]
            point = chain.point(q[i], tuple(at))
            assert point == pytest.approx(expected, abs=1e-14)
            together = chain.points(q[0], [np.full(3, axis) for axis in at])
            if i[0] == 0 and chain.dof:
                assert tuple(axis[i[1]] for axis in together) == point


@pytest.mark.parametrize(
    ("name", "links"), [("arm.urdf", ()), ("arm.toml", ("base", "tool"))]
)
def test_links_are_for_a_urdf_and_needed_there(name, links):
    with pytest.raises(InputError, match=f"{name}: .*--base and --tip"):
        read_arm(name, *links)
