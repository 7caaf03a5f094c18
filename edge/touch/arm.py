"""Forward kinematics of a joint chain: joint angles to the pose of the link with the
skin."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from edge.arrays import Floats
from edge.config import ConfigTable, read_toml, short_text
from edge.elementary import MOST_RAD, cos, length, sin
from edge.errors import InputError, about
from edge.touch.urdf import arm_between

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
LONGEST_M = 1000.0
"""Greatest coordinate of an arm's vectors."""
STEPS = ("origin_xyz", "origin_rpy", "translate")
"""Of a joint, fixed."""
MOVING = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True)
class Joint:
    """A joint: a fixed step (`origin`), then motion about or along `axis`, then a fixed
    step.

    The step before the motion is `origin_xyz` and `origin_rpy`, as in a URDF. The step
    after it is `translate`, as in `edge/arms/cody.toml`. Lengths are in metres, angles
    in radians. `limits` are the lowest and highest angle of the joint, or its travel
    along the axis if it slides.
    """

    name: str
    axis: Vector
    kind: str = "revolute"
    origin_xyz: Vector = ZERO
    origin_rpy: Vector = ZERO
    translate: Vector = ZERO
    limits: tuple[float, float] | None = None


class Chain:
    """An arm: joints in a row from a base link to a tip link.

    >>> import edge
    >>> chain = edge.Chain.cody()
    >>> chain.pose([0.0] * 5)[:3, 3].round(5).tolist()
    [0.00635, -0.21668, -0.55648]
    """

    def __init__(
        self,
        joints: Sequence[Joint],
        base: str = "base",
        tip: str = "tip",
    ) -> None:
        """Make a chain of joints; a joint of the kind "fixed" takes no angle.

        Raises:
            InputError: a joint's axis has no direction, or its limits are swapped; two
                joints that move have one name.
        """
        self.joints = tuple(joints)
        self.base = base
        self.tip = tip
        moving = [joint for joint in self.joints if joint.kind != "fixed"]
        self.dof = len(moving)
        """Number of angles that `pose` takes."""
        self.names = tuple(joint.name for joint in moving)
        """The moving joints' names, in the order of the angles."""
        for name in self.names:
            if self.names.count(name) > 1:
                raise InputError(
                    f"two joints are named {name!r}; angles come by name, so each needs "
                    "one of its own"
                )
        self.limits = tuple(joint.limits for joint in moving)
        """(lower, upper) of each moving joint in radians, or metres if it slides; or
        None."""
        self._slides = [joint.kind == "prismatic" for joint in moving]
        self.links = [
            (
                joint.kind,
                _direction(joint),
                _step(joint.origin_xyz, joint.origin_rpy),
                joint.translate,
            )
            for joint in self.joints
        ]
        """Of each joint: its kind, its axis of length 1, the fixed steps before (3, 4) and
        after it."""

    def pose(self, q: ArrayLike) -> Floats:
        """Pose of the tip in the base's frame.

        Args:
            q: (dof,) or (..., dof) radians, or metres for a sliding joint, from base to
                tip.

        Returns:
            (4, 4) or (..., 4, 4) homogeneous transform, metres.

        Raises:
            InputError: there is another number of angles, or one is not finite, or
                beyond `MOST_RAD`.
        """
        try:
            angles = np.asarray(q, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(f"joint angles must be numbers, not {q!r}") from None
        if angles.shape[-1:] != (self.dof,):
            raise InputError(
                f"the arm takes {self.dof} joint angles ({', '.join(self.names)}), not "
                f"an array {angles.shape}"
            )
        within = np.abs(angles) <= MOST_RAD
        if not within.all():
            joint = self.names[np.argwhere(~within)[0][-1]]
            raise InputError(
                f"the angle of joint {joint} is not within {MOST_RAD:g} rad"
            )
        transform = np.zeros((*angles.shape[:-1], 4, 4))
        transform[..., 3, 3] = 1.0
        of_each_joint = np.moveaxis(angles, -1, 0)[..., None]
        motions = self._motions(of_each_joint)
        transform[..., :3, :] = np.stack(self._carried(motions, np.eye(4)), axis=-2)
        return transform

    def point(self, q: ArrayLike, position: Vector) -> Vector:
        """A point of the tip in the base's frame, as plain floats: `pose(q)` times it.

        It is much faster than computing the pose. Rotations follow Rodrigues' formula,
        R = I + sin(q) K + (1 - cos(q)) K^2. It is computed with 1 - cos(q) = 2
        sin^2(q/2), which loses no digits at small angles.

        Args:
            q: (dof,) as for `pose`.
            position: (3,) in the tip's frame, metres.

        Raises:
            InputError: as `pose`.
        """
        self.check(q)
        motions = self._motions(np.asarray(q).tolist())
        x, y, z = self._carried(motions, (*position, 1.0))
        return x, y, z

    def points(
        self, q: Floats, positions: Sequence[Floats]
    ) -> tuple[Floats, Floats, Floats]:
        """x, y and z (m,) of `point` for angles (m, dof) that `check` takes, and
        positions x, y and z (m,): the same bits."""
        x, y, z = self._carried(self._motions(q.T), (*positions, 1.0))
        return x, y, z

    def check(self, q: ArrayLike) -> None:
        """Refuse what `pose` refuses, much faster."""
        angles = np.asarray(q).tolist()
        if len(angles) != self.dof or not sum(map(abs, angles)) <= MOST_RAD:
            self.pose(q)  # raises

    def _motions(self, angles: Iterable[Any]) -> list[tuple[Any, Any]]:
        """Of each moving joint the sine and 1 - the cosine of its angle, or its travel
        twice; angles are numbers or arrays."""
        motions = []
        for slides, angle in zip(self._slides, angles, strict=True):
            if slides:
                motions.append((angle, angle))
            else:
                half = sin(0.5 * angle)
                motions.append((sin(angle), 2.0 * half * half))
        return motions

    def _carried(self, motions: Sequence[tuple[Any, Any]], position: Any) -> Any:
        """(x, y, z) in the base's frame of coordinates (4,) in the tip's frame, which
        are numbers, or arrays of the shape of `_motions`."""
        x, y, z, w = position
        remaining = reversed(motions)
        for kind, (kx, ky, kz), step, (dx, dy, dz) in reversed(self.links):
            x = x + dx * w
            y = y + dy * w
            z = z + dz * w
            if kind == "prismatic":
                travel = next(remaining)[0] * w
                x = x + kx * travel
                y = y + ky * travel
                z = z + kz * travel
            elif kind != "fixed":
                f, g = next(remaining)
                ax = ky * z - kz * y
                ay = kz * x - kx * z
                az = kx * y - ky * x
                x = x + (f * ax + g * (ky * az - kz * ay))
                y = y + (f * ay + g * (kz * ax - kx * az))
                z = z + (f * az + g * (kx * ay - ky * ax))
            x, y, z = [a * x + b * y + c * z + d * w for a, b, c, d in step]
        return x, y, z

    def to_dict(self) -> dict[str, Any]:
        """The chain as a JSON object, which keeps every number exactly."""
        joints = []
        for joint in self.joints:
            entry: dict[str, Any] = {"name": joint.name, "type": joint.kind}
            for key in ("axis", *STEPS, "limits"):
                value = getattr(joint, key)
                if value not in (ZERO, None):
                    entry[key] = list(value)
            joints.append(entry)
        return {"base": self.base, "tip": self.tip, "joint": joints}

    @classmethod
    def from_dict(cls, arm: Mapping[str, Any], where: str = "arm") -> Self:
        """The chain that `to_dict` or an arm's TOML file describes.

        Raises:
            InputError: a key is unknown or missing, or a value is impossible.
        """
        table = ConfigTable(arm, where)
        joints = [
            _joint_from(joint, i)
            for i, joint in enumerate(table.tables("joint", "joint"))
        ]
        base = table.text("base", "base")
        tip = table.text("tip", "tip")
        table.refuse_unknown()
        with about(where):
            chain = cls(joints, base, tip)
        return chain

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Self:
        """The chain of a TOML file like `edge/arms/cody.toml`.

        Raises:
            InputError: the file cannot be read, or does not describe a chain.
        """
        return cls.from_dict(read_toml(path).raw, where=os.fspath(path))

    @classmethod
    def cody(cls) -> Self:
        """Cody's right arm, up to the wrist frame that carries the skin: 5 angles."""
        return cls.from_toml(Path(__file__).parents[1] / "arms" / "cody.toml")

    @classmethod
    def from_urdf(cls, path: str | os.PathLike[str], base: str, tip: str) -> Self:
        """The chain between two links of a URDF file.

        Raises:
            InputError: the file cannot be read, or no chain leads from `base` to `tip`.
        """
        return cls.from_dict(arm_between(path, base, tip), where=os.fspath(path))


def _direction(joint: Joint) -> Vector:
    """The axis of a joint, of length 1."""
    size = length(joint.axis)
    if not 1e-9 <= size < math.inf:
        raise InputError(
            f"joint {joint.name}: its axis is zero or too long; give a direction"
        )
    if joint.limits is not None and not joint.limits[0] <= joint.limits[1]:
        raise InputError(
            f"joint {joint.name}: its lower limit {joint.limits[0]:g} exceeds its "
            f"upper limit {joint.limits[1]:g}"
        )
    x, y, z = (component / size for component in joint.axis)
    return x, y, z


def _step(xyz: Vector, rpy: Vector) -> tuple[tuple[float, ...], ...]:
    """The transform (3, 4) of a URDF origin: roll, pitch, yaw about fixed axes x, y,
    z."""
    cr, cp, cy = map(cos, rpy)
    sr, sp, sy = map(sin, rpy)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, xyz[0]),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, xyz[1]),
        (-sp, cp * sr, cp * cr, xyz[2]),
    )


def _joint_from(table: ConfigTable, index: int) -> Joint:
    name = table.text("name", f"joint {index}")
    if table.has("name"):
        # The joints of a URDF have no order, so an error names the joint and not its
        # number.
        table.prefix = f"joint {short_text(name)}: "
    steps = {key: _vector(table, key) for key in STEPS if table.has(key)}
    limits = None
    for key, unit in (("limits", 1.0), ("limits_deg", math.pi / 180.0)):
        if table.has(key):
            lower, upper = table.numbers(key, 2)
            limits = (lower * unit, upper * unit)
    joint = Joint(
        name=name,
        axis=_vector(table, "axis"),
        kind=table.choice("type", (*MOVING, "fixed"), "revolute"),
        limits=limits,
        **steps,
    )
    table.refuse_unknown()
    return joint


def _vector(table: ConfigTable, key: str) -> Vector:
    """Three numbers. No link is a kilometre long, so that no product overflows."""
    x, y, z = table.numbers(key, 3, low=-LONGEST_M, high=LONGEST_M)
    return x, y, z


def read_arm(
    path: str | os.PathLike[str],
    base: str | None = None,
    tip: str | None = None,
) -> Chain:
    """The chain of a TOML file, or of a URDF file between two of its links.

    Raises:
        InputError: as `Chain.from_toml` and `Chain.from_urdf`; or links are given for a
            TOML file, or a link is missing for a URDF.
    """
    if Path(path).suffix.lower() in (".urdf", ".xml", ".xacro"):
        if base is None or tip is None:
            raise InputError(
                f"{path}: a URDF needs --base and --tip, the arm's first link and the "
                "link that carries the skin"
            )
        return Chain.from_urdf(path, base, tip)
    if base is not None or tip is not None:
        raise InputError(f"{path}: --base and --tip are for a .urdf file")
    return Chain.from_toml(path)
