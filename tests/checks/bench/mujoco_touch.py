"""Touches in another physics engine, MuJoCo: an arm, its skin of sprung pads, and a
object.

The arm is Cody's chain with its masses on gravity-compensated links, driven by an
impedance controller. Each taxel that can meet the object is a pad on a spring along its
normal, and reads the spring's force. The object stands on a floor under gravity, or is
clamped. A soft object has an elastic layer (`mujoco_layer`); a plant is a set of hinged
stems.
"""

import math
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from string import Template

import mujoco
import numpy as np

from edge.record.recording import Recording
from edge.touch.arm import Chain
from tests.checks.bench import mujoco_layer
from tests.checks.bench.mujoco_layer import ABOVE_FLOOR_M
from train.simulate.scene import CODY_DAMPING, CODY_SKIN, CODY_STIFFNESS

MODEL = Template(Path(__file__).with_name("touch.xml").read_text())
ARM = Chain.cody()
START_DEG = (-41.0, 4.0, 0.0, 40.0, 0.0)
RATE_DEG_S = 20.0
LEAD_S = 0.3
TOUCH_S = 1.8
RATE_HZ = 100
"""Seconds before the arm meets a rigid object, and after that at the usual speed."""
G_M_S2 = 9.81
PLACE_M = 0.10
COUNTS_PER_NEWTON = 1000.0
THRESHOLD_COUNTS = 40
ONSET_COUNTS = 60
LEAST_COUNTS = 35.0
MOST_COUNTS = 17e3
"""The electronics shows less as nothing, and no more."""
NOISE_COUNTS = 6.0
"""Standard deviation."""
RADIUS_M = 0.04604
ROWS = 16
FACING_DEG = 76.0
"""A taxel whose normal lies farther from the push than this cannot meet the object."""
PAD_M = 0.0048
PAD_KG = 0.02
PAD_LOSS_S = 0.0015
"""A pad's radius around the forearm; its mass; its damping divided by its stiffness."""
RIGID = "-1e6 -2e3"
"""Where solimp is s, a contact is s / (1 - s) times as stiff as solref times the
mass."""
STEP_S = 0.001
STEMS_STEP_S = 0.00025
"""Stems of 10 g hop in steps as long as the contact's time constant."""
RIGID_KINDS = ("box", "drum")
HALF_M = 0.08
"""Half the length of an object's foot along the push, and at least half its breadth."""


@dataclass(frozen=True)
class Thing:
    """The object that is touched.

    Attributes:
        kind: box, drum, foam, cushion, bale or plant.
        mass_kg, floor, skin: its mass, and its friction on the floor and on the skin.
        height_m, breadth_m: of its face, along the forearm (which hangs) and across it.
        modulus_pa, thick_m: of a soft layer.
        stems, stem_n_m: a plant's stems, and the stiffness of each at the height of the
            contact.
        seed: of a plant's shape.
    """

    kind: str
    mass_kg: float = 1.0
    floor: float = 0.4
    skin: float = 0.4
    height_m: float = 0.2
    breadth_m: float = 0.1
    modulus_pa: float = 8e3
    thick_m: float = 0.1
    stems: int = 8
    stem_n_m: float = 10.0
    seed: int = 0

    @property
    def soft(self):
        """Whether it yields."""
        return self.kind not in RIGID_KINDS

    @property
    def layered(self):
        """Whether it has an elastic layer."""
        return self.soft and self.kind != "plant"


@dataclass(frozen=True)
class Touch:
    """How the object is touched; the defaults are those of a perfect machine.

    Attributes:
        start_rad: (dof,) added to the arm's first angles.
        place_m: place of the contact along the forearm, from the wrist.
        aside_m, yaw_rad: the object's distance beside the push, and its turn.
        slope_rad: slope of the table along the push.
        taxel_n_m: stiffness of the pads.
        speed, stiffness: of the arm, in units of Cody's; its damping ratio stays.
        elbow: speed of the elbow, in units of the shoulder's.
        noise: the stream of the readings' noise, if they have any.
    """

    thing: Thing
    fixed: bool
    start_rad: tuple[float, ...] = (0.0,) * 5
    place_m: float = PLACE_M
    aside_m: float = 0.0
    yaw_rad: float = 0.0
    slope_rad: float = 0.0
    taxel_n_m: float = 10e3
    speed: float = 1.0
    stiffness: float = 1.0
    elbow: float = 0.0
    noise: np.random.Generator | None = None

    @property
    def pad_n_m(self):
        """Stiffness of a pad, in series with the layer beneath it where there is a
        layer."""
        if not self.thing.layered:
            return self.taxel_n_m
        beneath_n_m = mujoco_layer.beneath_n_m(self.thing.modulus_pa)
        return 1.0 / (1.0 / self.taxel_n_m + 1.0 / beneath_n_m)

    @property
    def equilibrium_rad(self):
        """(dof,) the arm's equilibrium point at the beginning."""
        return np.radians(START_DEG) + self.start_rad

    @property
    def rate_rad_s(self):
        """(dof,) speed of the equilibrium point: the first joint swings."""
        directions = np.array([1.0, 0.0, 0.0, self.elbow, 0.0])
        return directions * math.radians(RATE_DEG_S * self.speed)

    @property
    def begin_rad(self):
        """(dof,) the arm's angles at the beginning: each joint trails its equilibrium
        point as in free motion."""
        lag_s = np.divide(CODY_DAMPING, CODY_STIFFNESS) / math.sqrt(self.stiffness)
        return self.equilibrium_rad - lag_s * self.rate_rad_s

    @property
    def labels(self):
        """The labels of a recording."""
        mobility = "fixed" if self.fixed else "movable"
        softness = "soft" if self.thing.soft else "rigid"
        return {
            "category": f"{softness}-{mobility}",
            "mobility": mobility,
            "softness": softness,
            "object": self.thing.kind,
        }


def joined(numbers):
    """Numbers as MuJoCo reads them."""
    return " ".join(map(str, numbers))


def arm_xml(facing_deg, touch):
    """The arm's bodies, and the (row, column) of each pad."""
    links = {1: ("0.03 0.09", 2.1, "0 0 -0.13"), 3: ("0.03 0.09", 1.5, "0 0 -0.12")}
    angles = np.array(CODY_SKIN["column_angles_deg"])
    facing = np.abs((angles - facing_deg + 180.0) % 360.0 - 180.0) <= FACING_DEG
    where = list(product(range(ROWS), np.flatnonzero(facing).tolist()))
    pads = ""
    for number, (row, column) in enumerate(where):
        angle = math.radians(angles[column])
        out = math.cos(angle), math.sin(angle)
        place = *((RADIUS_M - PAD_M) * v for v in out), 0.18432 - 0.0108 * row
        pads += (
            f'<body name="pad{number}" pos="{joined(place)}" '
            f'childclass="pad"><joint axis="{joined(out)} 0"/><geom/></body>'
        )
    xml = ""
    at = "0 0 0"
    for i, joint in enumerate(ARM.joints):
        size, mass, centre = links.get(i, ("0.02 0.01", 0.05, "0 0 0"))
        loss = CODY_DAMPING[i] * math.sqrt(touch.stiffness)
        xml += (
            f'<body pos="{at}" gravcomp="1" childclass="link"><joint name="j{i}" '
            f'axis="{joined(joint.axis)}" damping="{loss}"/>'
            f'<geom size="{size}" pos="{centre}" mass="{mass}"/>'
        )
        at = joined(joint.translate)
    return xml + pads + "</body>" * ARM.dof, where


def stems_xml(thing):
    """The stems of a plant, which bend along the push."""
    rng = np.random.default_rng(thing.seed)
    hinge = thing.stem_n_m * (ABOVE_FLOOR_M - 0.02) ** 2
    xml = ""
    for _ in range(thing.stems):
        x = 0.012 + rng.uniform(0.0, 0.08)
        y = rng.uniform(-0.5, 0.5) * min(thing.breadth_m, 0.15)
        half = rng.uniform(0.34, 0.5) / 2
        xml += (
            f'<body pos="{x} {y} 0.02" childclass="stem"><joint stiffness="{hinge}" '
            f'damping="{0.03 * hinge}"/><geom size="0.006 {half}" pos="0 0 '
            f'{half}"/></body>'
        )
    return xml


def upper_xml(thing):
    """What stands on the object's foot, and the springs and the face of a layer."""
    if thing.layered:
        return mujoco_layer.layer_xml(thing)
    if thing.soft:
        return stems_xml(thing), ""
    half = (ABOVE_FLOOR_M + thing.height_m / 2) / 2
    across = thing.breadth_m / 2
    deep = HALF_M
    shape = f'type="box" size="{HALF_M} {across} {half}"'
    if thing.kind == "drum":
        deep = across + HALF_M
        shape = f'type="cylinder" size="{deep} {half}"'
    place = f'pos="{deep} 0 {ABOVE_FLOOR_M + thing.height_m / 2 - half}"'
    return f'<geom class="face" {shape} {place} mass="{thing.mass_kg * 0.2}"/>', ""


def meeting(touch):
    """The arm's pose (4, 4) as it meets the object, the point where it does (3,), and
    the heading of that point in radians."""
    pose = ARM.pose(touch.begin_rad + touch.rate_rad_s * LEAD_S)
    later = ARM.pose(touch.begin_rad + touch.rate_rad_s * (LEAD_S + 0.01))
    on = np.array([0.0, 0.0, touch.place_m, 1.0])
    point = (pose @ on)[:3]
    speed = (later @ on)[:3] - point
    return pose, point, math.atan2(speed[1], speed[0])


def model_of(touch):
    """MuJoCo's model of a touch, and the (row, column) of each pad."""
    # It warns, and writes a file, of each face that only a layer's knots hold.
    mujoco.set_mju_user_warning(lambda text: None)
    thing = touch.thing
    k = touch.pad_n_m
    pose, point, heading = meeting(touch)
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    across = pose[:3, :3].T @ ahead
    arm, where = arm_xml(math.degrees(math.atan2(across[1], across[0])), touch)
    aside = np.array([-ahead[1], ahead[0], 0.0]) * touch.aside_m
    x, y, z = point + ahead * (RADIUS_M + 0.001) + aside
    upper, layer = upper_xml(thing)
    motors = (
        f'<position joint="j{i}" kp="{stiffness * touch.stiffness}"/>'
        for i, stiffness in enumerate(CODY_STIFFNESS)
    )
    slope = touch.slope_rad
    gravity = *(G_M_S2 * math.sin(slope) * ahead[:2]), -G_M_S2 * math.cos(slope)
    words = {
        **vars(thing),
        "pad_n_m": k,
        "pad_kg": PAD_KG,
        "pad_loss": PAD_LOSS_S * k,
        "contact": RIGID,
        "step_s": STEMS_STEP_S if thing.kind == "plant" else STEP_S,
        "dimensions": 3,
        "foot_x": HALF_M,
        "x": x,
        "y": y,
        "floor_m": z - ABOVE_FLOOR_M,
        "gravity": joined(gravity),
        "turn_rad": heading + touch.yaw_rad,
        "foot_m": f"{HALF_M} {max(thing.breadth_m / 2, HALF_M)}",
        "foot_kg": thing.mass_kg * 0.8,
        "motors": "".join(motors),
        "arm": arm,
        "upper": upper,
        "layer": layer,
        "joint": "" if touch.fixed else "<freejoint/>",
    }
    if thing.layered:
        words |= {"contact": mujoco_layer.CONTACT, "dimensions": 1, "foot_x": 0.2}
        words["pad_loss"] = 2.0 * math.sqrt(k * PAD_KG)
    return mujoco.MjModel.from_xml_string(MODEL.substitute(words)), where


def simulate(touch):
    """One touch, as the board would have recorded it.

    Returns:
        The recording, and (n,) metres that the object has moved at the height of the
        contact, which the skin cannot see.
    """
    model, where = model_of(touch)
    row, column = np.array(where).T
    pads = [model.body(f"pad{number}").id for number in range(len(where))]
    rub = mujoco_layer.Rub(
        model,
        pads,
        touch.thing.skin if touch.thing.layered else 0.0,
    )
    data = mujoco.MjData(model)
    data.qpos[: ARM.dof] = touch.begin_rad
    data.qvel[: ARM.dof] = touch.rate_rad_s
    mujoco.mj_forward(model, data)
    pushed = data.qpos[ARM.dof : ARM.dof + len(pads)]
    """The pads' joints, which follow the arm's, in a view."""

    def felt():
        return np.maximum(-touch.pad_n_m * pushed, 0.0)

    # A soft object is felt later, the more so the slower the arm.
    lasts_s = LEAD_S + TOUCH_S + 0.6 * max(1.0 / touch.speed - 1.0, 0.0)
    t = np.arange(round(lasts_s * RATE_HZ) + 1) / RATE_HZ
    loads = np.zeros((len(t), ROWS, CODY_SKIN["cols"]))
    joints = np.zeros((len(t), ARM.dof))
    places = np.zeros((len(t), 3))
    body = data.body("thing")
    for i in range(len(t)):
        loads[i, row, column] = felt()
        joints[i] = data.qpos[: ARM.dof]
        places[i] = body.xpos + ABOVE_FLOOR_M * body.xmat[2::3]
        for _ in range(round(1.0 / (RATE_HZ * model.opt.timestep))):
            data.ctrl[:] = touch.equilibrium_rad + touch.rate_rad_s * data.time
            rub.hold(data, felt())
            mujoco.mj_step(model, data)
    skin = {**CODY_SKIN, "counts_per_newton": COUNTS_PER_NEWTON}
    skin |= {"threshold_counts": THRESHOLD_COUNTS, "onset_counts": ONSET_COUNTS}
    meta = {"labels": touch.labels, "skin": skin, "arm": ARM.to_dict()}
    meta["source"] = "MuJoCo, tests/checks/bench/mujoco_touch.py"
    moved_m = np.hypot(*(places - places[0])[:, :2].T)
    return Recording(t, readings(touch, loads), joints=joints, meta=meta), moved_m


def readings(touch, loads):
    """The counts (n, rows, cols) that an electronics of these newtons gives, with
    noise."""
    counts = loads * COUNTS_PER_NEWTON
    if touch.noise is not None:
        counts += touch.noise.normal(0.0, NOISE_COUNTS, counts.shape)
    shown = np.where(counts < LEAST_COUNTS, 0.0, counts.clip(0.0, MOST_COUNTS))
    return shown.astype(np.uint16)
