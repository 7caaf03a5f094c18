"""A trial from its first step to its last: the record that every compiled function takes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import from_dtype, njit

from train.simulate import compiled as tools
from train.simulate.arm import JOINTS
from train.simulate.compiled import integers, record, vectors
from train.simulate.schema import EFFECTS

SLOTS = ("motion", "viscous", *EFFECTS)
"""Whose parts a trial may have."""

POSE = (("rotation", 3), ("axes", JOINTS), ("origins", JOINTS))
TRIAL = record(
    # Itself, for a function that calls another; the solver; each part's address.
    *integers("here", "solve"),
    ("own", "i8", (len(SLOTS),)),
    # How many steps its frame has and how long each is, its time in seconds, and how many frames
    # have ended.
    *integers("steps"),
    *("h", "t", "frame", "rate_hz"),
    # The arm: the table of `arm.Kinematics`, and of each joint: the equilibrium point's start,
    # speed and time; its damping and spring; what holds it in a step, and the compliance of all;
    # its angle now, after the step without load, and at the frame.
    *integers("joints", "chain"),
    *vectors(JOINTS, "start", "rate", "travel_s"),
    *vectors(JOINTS, "damping", "joint_k", "held", "give"),
    *vectors(JOINTS, "q", "q_free", "q_frame"),
    # Its pose, as of `arm.pose_of`.
    *vectors(3, "origin"),
    *((name, "f8", (3, size)) for name, size in POSE),
    # The point on the forearm's axis beside the middle of the contact; the object's face: its
    # normal, a point, the direction along the forearm; where on the skin it is met, and its shape.
    *vectors(3, "point", "normal", "face", "along_face"),
    *("z", "width_m", "face_radius_m", "skin_radius_m", "row_pitch_m"),
    # The contact's coordinates (`contact`): how many, where they are with no load in the step, at
    # the frame, and loaded; the loads; what they take off; the joints' part in them.
    *integers("coordinates"),
    *vectors(2, "y", "y_frame", "depth", "loads"),
    *vectors(3, "compliance"),
    ("jacobian", "f8", (2, JOINTS)),
    # What the solver is asked, and what it answers; 1 where it found no answer.
    *vectors(2, "free", "found"),
    *vectors(3, "c"),
    "lost",
    # The bed: lines of springs, of which the first are the columns that can touch; its law, lines
    # K a - B by their gaps (`state.Bed`); a taxel's stiffness with what is in series with it.
    *integers("rows", "lines", "columns", "springs", "law_lines"),
    *integers("row_z", "weight", "line_gap", "line_depth"),
    *integers("gaps", "stiffness", "alive", "column_gaps", "reach"),
    *integers("law_gaps", "slopes", "intercepts"),
    "taxel_k",
    # What a frame shows: the newtons borne, its deepest line, and (rows, columns) newtons a taxel.
    *("force", "deepest"),
    *integers("image"),
)
"""A trial. Whole numbers but those that count things are addresses of what has another length in
each scene; `compiled.vector` and its like read it."""


class Rows(np.ndarray[Any, Any]):
    """(n,) records whose fields are attributes, as of `np.recarray`, at a fifth of its time."""

    def __getattr__(self, name: str) -> Any:
        """A field (n, ...)."""
        try:
            return self[name].view(np.ndarray)
        except ValueError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Fill a field."""
        self[name] = value


class Part:
    """What an effect keeps of each trial, in a record of its own."""

    def __init__(self, slot: str, *fields: Any) -> None:
        """Fields as for `compiled.record`."""
        self.slot = SLOTS.index(slot)
        self.dtype = record(*fields)
        at, number = tools.reads(from_dtype(self.dtype)), self.slot

        @njit(error_model="numpy")
        def of(trial: Any) -> Any:
            return at(trial.own[number])

        self.of = of
        """For compiled functions: a trial's own."""

    def rows(self, n: int) -> Rows:
        """(n,) records of zeros."""
        return np.zeros(n, dtype=self.dtype).view(Rows)


compiled = tools.compiled(TRIAL)
"""Decorates a function of a trial."""
