"""One rule of time for tables, hands and logs, which is the board's own.

Frames come in the order of their file. A time that goes back a little, within the
jitter of a clock, puts its frame in its place; one that goes back further is refused,
since two touches would be mixed. Of two frames at one time the later counts. Joint
angles are interpolated, but not across a gap.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError, counted
from edge.touch.layout import RELEASE_S
from train.progress import say

JITTER_STEPS = 0.5
"""A time may go back by so many of the usual steps."""
AHEAD_S = 60.0
AHEAD_JITTERS = 200.0
"""A time that jumps by more, and by more than so many jitters, is a wrong one."""
MOST_REPEATED = 0.01
"""Share of the frames that may have the time of the frame before."""
GAP_STEPS = 5.0
"""A gap of more than so many of the joints' usual steps, and of more than the skin's
`release_s`, is not interpolated."""
HOLD_S = 0.1
"""How long angles hold before the first message and after the last."""


@dataclass(frozen=True)
class Order:
    """The frames that count, in the order of time.

    Attributes:
        frames: (m,) their indices.
        text: the change that was made, and steps as of a sparse log, in words; empty
            for times that increase steadily.
    """

    frames: NDArray[np.intp]
    text: str


def order(
    t: NDArray[np.float64],
    where: object,
    frame: str = "frame",
    numbers: Sequence[int] | None = None,
) -> Order:
    """Which of frames at some times count.

    Args:
        t: (n,) seconds.
        where: names the file in errors.
        frame: what a frame is called there, such as `line`.
        numbers: of the frames there; None where they count from 1.

    Raises:
        InputError: a time is not finite, goes back by more than the jitter, or stands
            still.
    """
    if numbers is None:
        numbers = range(1, len(t) + 1)
    bad = np.flatnonzero(~np.isfinite(t))
    if len(bad):
        raise InputError(f"{where}: {frame} {numbers[bad[0]]} has no time")
    steps = np.diff(t)
    forward = steps[steps > 0.0]
    jitter_s = JITTER_STEPS * float(np.median(forward)) if len(forward) else 0.0
    far_s = max(AHEAD_S, AHEAD_JITTERS * jitter_s)
    wrong = np.flatnonzero((steps < -jitter_s) | (steps > far_s))
    if len(wrong):
        step_s = steps[wrong[0]]
        goes = "goes back" if step_s < 0.0 else "jumps"
        raise InputError(
            f"{where}: its time {goes} by {abs(step_s):g} s at {frame} "
            f"{numbers[wrong[0] + 1]}; split it there, or fix the times"
        )
    frames = np.argsort(t, kind="stable")
    last = np.append(np.diff(t[frames]) > 0.0, True)
    repeated = np.flatnonzero(~last)
    if len(repeated) > MOST_REPEATED * len(t):
        still = frames[repeated[0] + 1]
        raise InputError(
            f"{where}: its time stands still at {frame} {numbers[still]}; give --rate HZ, "
            "such as --rate 100, or another time"
        )
    changes = _sparse(forward)
    swapped = int((steps < 0.0).sum())
    if swapped:
        changes.append(f"{counted(swapped, 'time')} went back within the jitter")
    if len(repeated):
        changes.append(
            f"{counted(len(repeated), 'frame')} skipped, as later ones have their times"
        )
    return Order(frames[last], "; ".join(changes))


def _sparse(steps: NDArray[np.float64]) -> list[str]:
    """A sentence for steps (n,) as of a log that is not written at all times."""
    shortest_s = float(np.quantile(steps, 0.1)) if len(steps) else 0.0
    longest_s = float(steps.max(initial=0.0))
    if longest_s <= max(RELEASE_S, GAP_STEPS * shortest_s):
        return []
    return [
        f"its steps are {shortest_s:.3g} to {longest_s:.3g} s, as of a log that pauses or "
        "writes on change alone"
    ]


def angles_at(
    t: NDArray[np.float64],
    joints_t: NDArray[np.float64],
    angles: NDArray[np.float64],
    release_s: float,
    where: object = "",
    frame: str = "message",
    numbers: Sequence[int] | None = None,
) -> NDArray[np.float64]:
    """Joint angles (n, dof) at the frames' times.

    They are linear between two messages that are no gap apart, hold for `HOLD_S` before
    the first message and after the last, and are NaN elsewhere. An angle that wraps at
    +-pi between two messages is taken to have gone the shorter way.

    Args:
        t: (n,) seconds.
        joints_t: (m,) seconds of the messages.
        angles: (m, dof) radians.
        release_s: of the skin; a longer step is a gap, unless it is less than five
            usual steps.
        where, frame, numbers: of the messages, as for `order`.

    Raises:
        InputError: as `order`.
    """
    messages = order(joints_t, where, frame, numbers).frames
    joints_t = joints_t[messages]
    unwrapped = np.unwrap(angles[messages], axis=0)
    columns = [np.interp(t, joints_t, column) for column in unwrapped.T]
    at_frames = np.stack(columns, axis=1)
    gap_s = release_s
    if len(joints_t) > 1:
        gap_s = max(release_s, GAP_STEPS * float(np.median(np.diff(joints_t))))
    after = np.searchsorted(joints_t, t, side="left").clip(0, len(joints_t) - 1)
    before = (np.searchsorted(joints_t, t, side="right") - 1).clip(0)
    across_s = joints_t[after] - joints_t[before]
    outside_s = np.maximum(joints_t[0] - t, t - joints_t[-1])
    # A clock counts in steps of its own; a gap is longer by more than rounding.
    is_gap = (across_s > gap_s * (1.0 + 1e-9)) | (outside_s > HOLD_S * (1.0 + 1e-9))
    at_frames[is_gap] = np.nan
    return at_frames


def complete(angles: NDArray[np.float64], where: str) -> NDArray[np.float64]:
    """Joint angles (n, dof) that are NaN in each frame that lacks one; says how many do.

    Raises:
        InputError: all frames lack one.
    """
    unknown = ~np.isfinite(angles).all(axis=1)
    angles[unknown] = np.nan
    if unknown.all():
        raise InputError(
            f"{where} has no joint angle at the time of any frame; record both with one "
            "clock"
        )
    if unknown.any():
        say(
            f"{where} lacks joint angles for {int(unknown.sum())} of {len(angles)} "
            "frames, where they are unknown"
        )
    return angles
