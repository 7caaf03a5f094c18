"""Arrays whose last axis is the trial, in groups: the clock, the arm, the contact, the
skin's bed of springs, and what the skin feels."""

from dataclasses import dataclass
from typing import Annotated, Any

from train.simulate.arm import Array, Mask, Places

PerJoint = Annotated[Array, "joint"]
PerRow = Annotated[Array, "row"]
PerColumn = Annotated[Array, "column"]
Vector = Annotated[Array, "xyz"]
Pair = Annotated[Array, "pair"]
"""Arrays with these axes before that of the trials; a plain `Array` is (n,)."""


class Column:
    """An array of a `Group`."""

    def __init__(self, name: str) -> None:
        """Of its name."""
        self.name = name

    def __get__(self, group: "Group", owner: type) -> Any:
        """The values of the group's trials: of all of them the array itself."""
        values = group.arrays[self.name]
        places = group.places
        if places is None:
            return values
        return values.take(places, -1)

    def __set__(self, group: "Group", values: Any) -> None:
        """Set the values of the group's trials."""
        places = group.places
        array = group.arrays[self.name]
        if places is None:
            array[...] = values
        elif array.ndim == 1:
            array[places] = values
        else:
            array[..., places] = values


class Group:
    """Arrays (..., n), of which the trials at some places are read and assigned; None
    for all."""

    def __init_subclass__(cls) -> None:
        """Make an array of each attribute that the class names."""
        for name in cls.__annotations__:
            setattr(cls, name, Column(name))

    def __init__(self, arrays: dict[str, Any], places: Any = None) -> None:
        """Of {name: array of all trials}."""
        self.arrays = arrays
        self.places = places


class StepClock(Group):
    """Each trial's own clock, (n,) each.

    Attributes:
        usual, steps, steps_left: number of steps in a frame away from jolts, in the present
            frame, and still to come in it.
        frame: number of frames ended.
        t, h: seconds now, and seconds of a step.
    """

    usual: Places
    steps: Places
    steps_left: Places
    frame: Places
    t: Array
    h: Array


@dataclass
class JointGains:
    """The arm's joints, the same in all trials, (dof, 1) each.

    Attributes:
        stiffness, damping: of each joint.
    """

    stiffness: Array
    damping: Array


class Arm(Group):
    """The arm's motion.

    Attributes:
        start, travel_s: (dof, n) the equilibrium point's angles at t = 0, and for how
            long it moves.
        rate, lag: (dof, n) the equilibrium point's speed, and radians by which the
            joint trails it in free motion.
        q, q_free, q_frame: (dof, n) joint angles: now, after the step without load, at
            the frame.
        step_stiffness, step_compliance: (dof, n) stiffness of a joint's damping and
            inertia within a step, and the compliance of the joint with it.
        tip, along: (3, n) metres of the forearm's tip at the frame, and its direction.
        axes, origins: (3, dof, n) of the joints at the frame, as of `arm.Pose`.
        point: (3, n) the point of the forearm's axis beside the contact.
    """

    start: PerJoint
    travel_s: PerJoint
    rate: PerJoint
    lag: PerJoint
    q: PerJoint
    q_free: PerJoint
    q_frame: PerJoint
    step_stiffness: PerJoint
    step_compliance: PerJoint
    tip: Vector
    along: Vector
    axes: Annotated[Array, "xyz", "joint"]
    origins: Annotated[Array, "xyz", "joint"]
    point: Vector


class ContactState(Group):
    """The contact between forearm and object.

    Attributes:
        y, y_frame, depth, loads: (2, n) its coordinates (`contact`) without load, at
            the frame and under load, and its loads.
        normal, face, along_face: (3, n) of the object's face its normal, a point, and
            its direction along the forearm.
        jacobian, compliance: (dof, 2, n), (3, n) how the joints move its coordinates,
            and the arm's compliance in them.
        z: (n,) metres in the skin's link, where the object is met.
        soft: (n,) metres that the object gives way for each newton in this step.
        fits: (n,) 1 where the object fits itself to a forearm that lies askew, else 0.
        grip, pull: (n,) friction between skin and face, and newtons of the skin's pull
            on the arm along the face.
        lift: (n,) newtons with which that pull lifts the object.
        turned: (n,) radians that the face has turned about the vertical.
        free_depth: (n,) the depth without load, which is y[0].
    """

    y: Pair
    y_frame: Pair
    depth: Pair
    loads: Pair
    normal: Vector
    face: Vector
    along_face: Vector
    jacobian: Annotated[Array, "joint", "pair"]
    compliance: Vector
    z: Array
    soft: Array
    fits: Array
    grip: Array
    pull: Array
    lift: Array
    turned: Array
    free_depth: Array


class Bed(Group):
    """The springs between skin and object.

    Attributes:
        columns, column_gaps, reach: (C, n) the skin's columns that can touch, the gap
            of each in metres at zero depth, and the part of it that the face can touch.
        column_angle: (C, n) radians from the push to each of these columns, positive
            towards higher columns.
        taxel_k: (n,) newtons a metre of a taxel with the springs in series.
        gaps, stiffness: (S, n) the springs of a row: metres at which each is touched,
            and newtons a metre. A trial of fewer springs has some at infinity, of no
            stiffness.
        intact: (S, 1, n), or (S, rows, n) where springs may break: 1, or 0 of a broken
            one.
        springs: (n,) number of springs of a row.
        law_gaps, slopes, intercepts: (E, n) the bed's law max_s (K_s a - B_s), by its
            gaps.
        weight, line_gap: (rows, n) the part of each row that the face covers, and
            metres by which the face draws back there.
        gain, load: (n,), (rows, n) a row whose springs bear F bears gain F + load.
        row_force: (rows, n) newtons on each row in the last step; where the forearm
            does not pivot, the first row holds the sum.
        first_row_force: (n,) which is row_force[0].
        lost: (n,) whether the solver failed to find a contact's loads.
    """

    columns: Annotated[Places, "column"]
    column_gaps: PerColumn
    reach: PerColumn
    column_angle: PerColumn
    taxel_k: Array
    gaps: Annotated[Array, "spring"]
    stiffness: Annotated[Array, "spring"]
    intact: Annotated[Array, "spring", "line"]
    springs: Places
    law_gaps: Annotated[Array, "line"]
    slopes: Annotated[Array, "line"]
    intercepts: Annotated[Array, "line"]
    weight: PerRow
    line_gap: PerRow
    gain: Array
    load: PerRow
    row_force: PerRow
    first_row_force: Array
    lost: Mask


@dataclass
class RowSprings:
    """Each row's springs in the order of their depth, for a forearm that pivots.

    Attributes:
        gaps: (S, n) metres at which each spring is touched, ascending.
        stiffness: (1, S, n) newtons a metre, or (rows, S, n) where springs may break.
    """

    gaps: Array
    stiffness: Array


class SkinLoad(Group):
    """What the skin feels at a frame.

    Attributes:
        line_depth: (rows, n) metres of each row's depth.
        image: (rows, C, n) newtons on each taxel.
        force, deepest, inside: (n,) newtons on the skin, depth of the deepest row, and
            the same but negative where no row touches.
    """

    line_depth: PerRow
    image: Annotated[Array, "row", "column"]
    force: Array
    deepest: Array
    inside: Array
