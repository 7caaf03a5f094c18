"""Sketch a contact from the side: the arm, and the object that was simulated, as it
moves."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from edge.arrays import Floats
from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.features import WINDOW_S
from edge.touch.layout import SkinLayout
from edge.touch.region import largest_region

DEPTH_M = 0.12
STANDS_M = 0.15
"""Depth of an object, and its foot's distance below the contact, where the scene gives
none."""
ABOVE_M = 0.02
"""Smallest height of an object above the contact."""
STEMS = 30
"""Most stems of a plant that are drawn."""
LOST_S = 0.3
"""Seconds without contact after which an object that tips has fallen."""


class Moment(NamedTuple):
    """A moment that is drawn: its name, seconds from onset, colour, line and
    hatching."""

    name: str
    after_s: float
    colour: str
    line: str
    hatch: str


MOMENTS = (
    Moment("at onset", 0.0, "0.45", "--", "//"),
    Moment("1.2 s on", WINDOW_S, "tab:blue", "-", "\\\\"),
)


class Place(NamedTuple):
    """Position (3,) of a contact, the skin's outward normal there (3,), and metres
    along the skin to its first row."""

    position: Floats
    normal: Floats
    row0_m: float


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

    An object that was simulated (`meta.simulation`) stands on its table, and slides,
    leans or turns there.
    """
    joints = recording.joints
    simulation = recording.meta.get("simulation")
    assert joints is not None
    first: Place | None = None
    motion = ""
    for moment in MOMENTS:
        k = int((recording.t[:-1] < onset + moment.after_s).sum())
        x, _, z = link_positions(chain, joints[k]).T
        line = {"color": moment.colour, "label": moment.name, "markersize": 4}
        axis.plot(x, z, moment.line, marker="o", **line)
        if layout.radius_m is not None:
            corners = skin_outline(chain.pose(joints[k]), layout)
            axis.fill(*corners.T, facecolor=moment.colour, alpha=0.35)
        last = _last_contact(recording, joints, chain, layout, k)
        if last is None:
            continue
        since, place = last
        first = first or place
        style = {"color": moment.colour}
        if since == 0.0:
            star = {"ms": 13, "mec": "white", "ls": "none", **style}
            label = f"contact {moment.name}"
            axis.plot(*place.position[[0, 2]], "*", **star, label=label)
        if simulation:
            style["hatch"] = moment.hatch
            motion = _object(axis, simulation, first, place.position, since, **style)
    title = _title(simulation, motion) if simulation else "seen from the side"
    axis.set_title(title, fontsize=9)
    axis.set(xlabel=f"x in the frame of {chain.base}, metres", ylabel="z, metres")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4)


def _title(simulation: Mapping[str, Any], motion: str) -> str:
    """The title over a simulated object that moves so."""
    mass = simulation["values"].get("mass_kg")
    weight = f", {mass:.2g} kg" if mass else ""
    effects = ", ".join(simulation["effects"])
    return f"seen from the side: {simulation['family']}{weight}{motion}\n{effects}"


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


def _last_contact(
    recording: Recording,
    joints: Floats,
    chain: Chain,
    layout: SkinLayout,
    k: int,
) -> tuple[float, Place] | None:
    """Seconds from the last contact to frame k, and the place of that contact."""
    for i in range(k, -1, -1):
        region = largest_region(
            recording.frames[i],
            layout.threshold_counts,
            wraps=layout.wraps,
        )
        if region is not None:
            pose = chain.pose(joints[i])
            position = layout.position(*region.centroid)
            place = Place(
                position=pose[:3, :3] @ position + pose[:3, 3],
                normal=pose[:3, :2] @ position[:2],
                row0_m=region.centroid[0] * layout.pitch[0],
            )
            return float(recording.t[k] - recording.t[i]), place
    return None


def _object(
    axis: Any,
    simulation: dict[str, Any],
    first: Place,
    now: Floats,
    since: float,
    **style: Any,
) -> str:
    """Draw the object where it now stands; its motion in words, for the title.

    Of a face larger than the skin, only the part beside and below the skin is drawn:
    nothing is known of an object beside the upper arm.

    Args:
        first: the contact at onset.
        now: (3,) position of the last contact, `since` seconds ago.
        style: colour and hatching, by their names in matplotlib.
    """
    body = _Body.of(simulation, first)
    ahead = math.copysign(1.0, first.normal[0] or 1.0)
    start = first.position[[0, 2]]
    table = start[0] + ahead * np.array([-0.1, body.depth + 0.25])
    axis.plot(table, 2 * [start[1] + body.floor], color="sienna")
    way = max(ahead * float(now[0] - first.position[0]), 0.0)
    slid = way if "sliding" in body.effects else 0.0
    if "stems" in body.effects:
        for ends in body.stems(way, slid):
            heights = start[1] + [body.floor, body.top]
            line = start[0] + ahead * ends
            axis.plot(line, heights, color=style["color"], alpha=0.5, lw=1)
        return ""
    if slid and body.tips:
        outline, motion = body.leaning(slid, fallen=since > LOST_S)
    else:
        outline = body.outline() + np.array([slid, 0.0])
        motion = body.turning(slid)
    axis.fill(*(start + outline * [ahead, 1.0]).T, alpha=0.25, **style)
    return motion


@dataclass(frozen=True)
class _Body:
    """An object seen from the side, in metres from the contact at onset.

    Attributes:
        effects: that move it.
        values: that were drawn for it.
        floor, top: the heights at which it stands, and at which its drawing ends.
        depth: along the push.
    """

    effects: Sequence[str]
    values: Mapping[str, float]
    floor: float
    top: float
    depth: float

    @classmethod
    def of(cls, simulation: Mapping[str, Any], first: Place) -> Self:
        """The object of a simulated recording, touched at a place."""
        values = simulation["values"]
        height = values.get("height_m") or STANDS_M
        width = values.get("width_m") or 0.1
        return cls(
            effects=simulation["effects"],
            values=values,
            floor=-max(height, 0.5 * min(width, 0.6)),
            top=max(min(0.5 * width, first.row0_m), ABOVE_M),
            depth=values.get("base_m") or DEPTH_M,
        )

    @property
    def height(self) -> float:
        """Of the contact above the floor."""
        return self.values.get("height_m") or STANDS_M

    @property
    def tips(self) -> bool:
        """Whether it tips over before it slides."""
        friction = self.values.get("friction_static") or 0.0
        return "tipping" in self.effects and friction > self.depth / (2.0 * self.height)

    def outline(self) -> Floats:
        """(points, 2) its outline where it stood at onset."""
        z = np.linspace(self.floor, self.top, 33)
        radius = self.values.get("radius_m") or math.inf
        face = np.minimum(z * z / (2.0 * radius), self.depth / 2.0)
        back = [[self.depth, self.top], [self.depth, self.floor]]
        return np.vstack([np.column_stack([face, z]), back])

    def stems(self, way: float, slid: float) -> Iterator[Floats]:
        """The foot and the end of each stem, along the push."""
        count = min(int(self.values.get("stem_count") or 12), STEMS)
        spread = self.values.get("stem_spread_m") or 0.06
        for behind in np.linspace(0.0, spread, count):
            # A pot that slides takes its stems along; otherwise they bend as far as
            # pressed.
            pressed = max(way - slid - behind, 0.0)
            bent = pressed * (self.top - self.floor) / -self.floor
            yield slid + behind + np.array([0.0, bent])

    def leaning(self, slid: float, *, fallen: bool) -> tuple[Floats, str]:
        """Its outline as it leans over its far edge, and its motion in words."""
        lean = 0.5 * math.pi if fallen else min(slid / self.height, 0.5 * math.pi)
        edge = np.array([self.depth, self.floor])
        c = math.cos(lean)
        s = math.sin(lean)
        outline = (self.outline() - edge) @ np.array([[c, -s], [s, c]]) + edge
        if fallen:
            return outline, ", has fallen over"
        return outline, f", leans by {math.degrees(lean):.0f} degrees"

    def turning(self, slid: float) -> str:
        """How far it has turned, in words; "" where it does not."""
        aside = self.values.get("aside_m")
        foot = self.values.get("foot_m")
        if "turning" not in self.effects or aside is None or foot is None or not slid:
            return ""
        angle = slid * aside / max((foot / 3.0) ** 2 + aside**2, 1e-12)
        return f", turns by {math.degrees(angle):.0f} degrees"
