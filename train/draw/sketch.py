"""Sketch a contact from the side: the arm with its skin, and the place of the contact."""

import math
from typing import Any, NamedTuple

import numpy as np

from edge.arrays import Floats
from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.features import WINDOW_S
from edge.touch.layout import SkinLayout
from edge.touch.region import largest_region


class Moment(NamedTuple):
    """A moment that is drawn: its name, seconds from onset, colour and line."""

    name: str
    after_s: float
    colour: str
    line: str


MOMENTS = (
    Moment("at onset", 0.0, "0.45", "--"),
    Moment("1.2 s on", WINDOW_S, "tab:blue", "-"),
)


def link_positions(chain: Chain, q: Any) -> Floats:
    """(links, 3) positions of the chain's joints and its tip, in metres."""
    chains = [Chain(chain.joints[: i + 1]) for i in range(len(chain.joints))]
    return np.vstack(
        [np.zeros(3), *(link.pose(q[: link.dof])[:3, 3] for link in chains)]
    )


def draw_side(
    axis: Any,
    recording: Recording,
    chain: Chain,
    layout: SkinLayout,
    onset: float,
) -> None:
    """Draw the arm at onset and at the end of the window, in the x-z plane of its base.

    A star marks the contact, where there is one at that moment.
    """
    joints = recording.joints
    assert joints is not None
    for moment in MOMENTS:
        k = int((recording.t[:-1] < onset + moment.after_s).sum())
        x, _, z = link_positions(chain, joints[k]).T
        line = {"color": moment.colour, "label": moment.name, "markersize": 4}
        axis.plot(x, z, moment.line, marker="o", **line)
        pose = chain.pose(joints[k])
        if layout.radius_m is not None:
            corners = skin_outline(pose, layout)
            axis.fill(*corners.T, facecolor=moment.colour, alpha=0.35)
        region = largest_region(
            recording.frames[k],
            layout.threshold_counts,
            wraps=layout.wraps,
        )
        if region is not None:
            place = pose[:3, :3] @ layout.position(*region.centroid) + pose[:3, 3]
            star = {"ms": 13, "mec": "white", "ls": "none", "color": moment.colour}
            label = f"contact {moment.name}"
            axis.plot(*place[[0, 2]], "*", **star, label=label)
    axis.set_title("seen from the side", fontsize=9)
    axis.set(xlabel=f"x in the frame of {chain.base}, metres", ylabel="z, metres")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4)


def skin_outline(pose: Floats, layout: SkinLayout) -> Floats:
    """(4, 2) x and z of the corners of a cylinder's skin, seen from the side."""
    first_m = layout.row0_z_m
    length_m = layout.pitch[0] * (layout.rows - 1)
    ends = pose[:3, 3] + np.outer([first_m, first_m - length_m], pose[:3, 2])
    x, z = ends[0, [0, 2]] - ends[1, [0, 2]]
    radius = layout.radius_m or 0.0
    across = np.array([z, -x]) * radius / max(math.hypot(x, z), 1e-9)
    first, last = ends[:, [0, 2]]
    return np.array([first - across, first + across, last + across, last - across])
