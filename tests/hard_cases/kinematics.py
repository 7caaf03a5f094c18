"""The arm's kinematics: many steps, large and tiny angles, limits and wrapped
angles."""

import json
import math

import mpmath
import numpy as np
from hypothesis import strategies as st

from edge.touch.arm import Chain, Joint
from edge.touch.joint_stream import Joints
from tests.hard_cases.cases import SEEDS, Case, Ladder, decades


def orthonormal_error(steps, reach):
    """Largest |R R^T - 1| along a path of `steps` poses."""
    chain = Chain.cody()
    worst = 0.0
    rate = np.array([0.7, -1.1, 0.3, 1.7, -0.9])
    for start in range(0, steps, 20000):
        i = np.arange(start, min(start + 20000, steps))[:, None]
        turn = chain.pose(reach * np.sin(1e-3 * i * rate) + 1e-4 * i)[:, :3, :3]
        gap = turn @ turn.transpose(0, 2, 1) - np.eye(3)
        worst = max(worst, float(np.abs(gap).max()))
    return worst


def exact_turn(axis, angle):
    """Rodrigues' formula in 60 digits (400 for the reduction of large angles)."""
    with mpmath.workdps(400):
        a = mpmath.mpf(angle)
        s = mpmath.sin(a)
        c = 1 - mpmath.cos(a)
        size = mpmath.sqrt(sum(mpmath.mpf(v) ** 2 for v in axis))
        x, y, z = (mpmath.mpf(v) / size for v in axis)
        k = mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        out = mpmath.eye(3) + s * k + c * (k * k)
        return [[out[i, j] for j in range(3)] for i in range(3)]


def turn_error(angle, seed):
    """Largest error of a rotation; off the diagonal relative to the angle where it is
    tiny."""
    x, y, z = np.random.default_rng(seed).normal(size=3).tolist()
    rotation = Chain([Joint("j", (x, y, z))]).pose([angle])[:3, :3]
    truth = exact_turn((x, y, z), angle)
    scale = min(1.0, abs(angle)) or 1.0
    worst = 0.0
    for i in range(3):
        for j in range(3):
            gap = abs(float(mpmath.mpf(float(rotation[i, j])) - truth[i][j]))
            worst = max(worst, gap if i == j else gap / scale)
    return worst


def line_error(angle, step):
    """Error of the pose midway between two lines of a sender that wraps its angles."""

    def wrap(q):
        return math.remainder(q, 2.0 * math.pi)

    text = "".join(
        json.dumps({"t": t, "q": [wrap(q)]}) + "\n"
        for t, q in ((5.0, angle), (5.01, angle + step))
    )
    lines = iter([text.encode(), None])
    joints = Joints(lambda: next(lines), dof=1, now=lambda: 0.0)
    angles = joints.at(-0.005)
    if angles is None:
        return math.inf
    turn = Chain([Joint("j", (0.0, 0.0, 1.0))])
    return float(np.abs(turn.pose(angles) - turn.pose([angle + 0.5 * step])).max())


CASES = [
    Case(
        "kinematics: orthonormal over a million steps",
        "R R^T = 1",
        "largest entry of R R^T - 1",
        orthonormal_error,
        [{"steps": 1_000_000, "reach": 2.0}],
        {"steps": st.just(2000), "reach": st.floats(0, 1e6)},
        Ladder("radians a step", decades(0, 18, 1), "reach", "", {"steps": 2000}),
        examples=8,
        bound=5e-15,
    ),
    Case(
        "kinematics: large and tiny angles, and limits of joints wrapped by 2 pi",
        "Rodrigues' formula in 400 digits",
        "error of an entry, off the diagonal over a tiny angle",
        turn_error,
        [{"angle": a, "seed": 0} for a in (0.0, 1e-300, 1e-8, math.pi, 1e6, 1e15)]
        + [
            {"angle": limit + 2.0 * math.pi * turns, "seed": 0}
            for limit in {
                limit for limits in Chain.cody().limits for limit in limits or ()
            }
            for turns in (-1000, 0, 1)
        ],
        {"angle": st.floats(-1e15, 1e15), "seed": SEEDS},
        Ladder("radians", decades(0, 300, 0.1), "angle"),
        examples=25,
        bound=1e-15,
    ),
    Case(
        "kinematics: a sender that wraps its angles between two lines",
        "the pose midway on the shorter way",
        "error of an entry",
        line_error,
        [{"angle": math.pi - 0.001, "step": 0.002}],
        {"angle": st.floats(-7, 7), "step": st.floats(-0.3, 0.3)},
        Ladder(
            "radians between two lines",
            [1e-9, 1e-3, 1.0, 3.1, 3.2],
            "step",
            beside={"angle": 3.0},
        ),
        bound=2e-12,
    ),
]
