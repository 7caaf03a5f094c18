"""Touches in another physics engine, MuJoCo: an arm, its skin of sprung pads, and a thing.

The arm is Cody's chain with its masses on gravity-compensated links, driven by an impedance
controller. Each taxel that can meet the thing is a pad on a spring along its normal, and reads
the spring's force. The thing stands on a floor under gravity, or is clamped. A soft thing has an
elastic layer (`mujoco_layer`); a plant is a set of hinged stems.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import mujoco_layer
from bench.mujoco_layer import ABOVE_FLOOR_M, SOLIMP
from edge.recording import Recording
from edge.touch.arm import Chain
from train.simulate.scene import CODY_DAMPING, CODY_SKIN, CODY_STIFFNESS

ARM = Chain.cody()
START_DEG = (-41.0, 4.0, 0.0, 40.0, 0.0)
RATE_DEG_S = 20.0
LEAD_S, TOUCH_S, RATE_HZ, STEP_S = 0.3, 1.8, 100, 0.001
"""Seconds before the arm meets a rigid thing, and after that at the usual speed."""
PLACE_M = 0.10
COUNTS_PER_NEWTON, THRESHOLD_COUNTS, ONSET_COUNTS = 1000.0, 40, 60
RADIUS_M = 0.04604
ROWS = 16
FACING_DEG = 76.0
"""A taxel whose normal lies farther from the push than this cannot meet the thing."""
PAD_M, PAD_FLAT_M, PAD_KG, PAD_LOSS_S = 0.0048, 0.0035, 0.02, 0.0015
"""A pad's radius around the forearm and half its straight part along it (flat over a taxel's 9 mm,
to 0.1 mm); its mass; its damping divided by its stiffness."""
RIGID = "-1e6 -2e3"
"""MuJoCo's contact is SOLIMP / (1 - SOLIMP) times as stiff as solref times the mass."""
RIGID_KINDS = ("box", "drum", "drawer", "door")
FOOT_M = 0.16
"""Length of a thing's foot along the push."""


@dataclass(frozen=True)
class Thing:
    """The thing that is touched.

    Attributes:
        kind: box, drum, drawer, door, foam, cushion, bale, cloth, limb or plant.
        mass_kg, floor, skin: its mass, and its friction on the floor and on the skin.
        height_m, breadth_m: of its face, along the forearm (which hangs) and across it.
        below_m: how far a rigid face reaches below the middle of the contact (default: the floor).
        modulus_pa, thick_m: of a soft layer.
        stems, stem_n_m: a plant's stems, and the stiffness of each at the height of the contact.
        seed: of a plant's shape.
        joint: MuJoCo's joint between a movable thing and the room.
    """

    kind: str
    mass_kg: float = 1.0
    floor: float = 0.4
    skin: float = 0.4
    height_m: float = 0.2
    breadth_m: float = 0.1
    below_m: float = ABOVE_FLOOR_M
    modulus_pa: float = 8e3
    thick_m: float = 0.1
    stems: int = 8
    stem_n_m: float = 10.0
    seed: int = 0
    joint: str = "<freejoint/>"

    @property
    def soft(self) -> bool:
        """Whether it yields."""
        return self.kind not in RIGID_KINDS

    @property
    def layered(self) -> bool:
        """Whether it has an elastic layer."""
        return self.soft and self.kind != "plant"


@dataclass(frozen=True)
class Touch:
    """How the thing is touched; the defaults are those of a perfect machine.

    Attributes:
        start_rad: (dof,) added to the arm's first angles.
        place_m: place of the contact along the forearm, from the wrist.
        aside_m, yaw_rad: the thing's distance beside the push, and its turn.
        slope_rad: slope of the table along the push.
        taxel_n_m: stiffness of the pads.
        speed, stiffness: of the arm, in units of Cody's; its damping ratio stays.
        noise: standard deviation in counts, and its stream.
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
    noise: tuple[float, np.random.Generator] | None = None

    @property
    def pad_n_m(self) -> float:
        """Stiffness of a pad, in series with the layer beneath it where there is a layer."""
        if not self.thing.layered:
            return self.taxel_n_m
        return 1.0 / (1.0 / self.taxel_n_m + 1.0 / mujoco_layer.beneath_n_m(self.thing.modulus_pa))

    @property
    def rate_rad_s(self) -> NDArray[np.float64]:
        """(dof,) speed of the equilibrium point: the first joint swings."""
        return np.eye(ARM.dof)[0] * math.radians(RATE_DEG_S * self.speed)

    @property
    def lag_rad(self) -> NDArray[np.float64]:
        """(dof,) by which each joint trails its equilibrium point in free motion."""
        seconds = np.array(CODY_DAMPING) / np.array(CODY_STIFFNESS) / math.sqrt(self.stiffness)
        return seconds * self.rate_rad_s


@dataclass
class Touched:
    """The recording of a touch, and quantities that the skin cannot see.

    Attributes:
        force: (n,) newtons that the pads bear.
        moved_m: (n,) motion of the thing at the height of the contact.
    """

    recording: Recording
    force: NDArray[np.float64]
    moved_m: NDArray[np.float64]


def arm_xml(facing_deg: float, touch: Touch) -> tuple[str, list[tuple[int, int]]]:
    """The arm's bodies, and the (row, column) of each pad."""
    links = {1: ("0.03 0.09", 2.1, "0 0 -0.13"), 3: ("0.03 0.09", 1.5, "0 0 -0.12")}
    pads, where = "", []
    k, skin = touch.pad_n_m, touch.thing.skin
    contact, dimensions, loss = RIGID, 3, PAD_LOSS_S * k
    if touch.thing.layered:
        contact, dimensions, loss = mujoco_layer.CONTACT, 1, 2.0 * math.sqrt(k * PAD_KG)
    for row in range(ROWS):
        for column, angle in enumerate(CODY_SKIN["column_angles_deg"]):
            if abs((angle - facing_deg + 180.0) % 360.0 - 180.0) > FACING_DEG:
                continue
            out = f"{math.cos(math.radians(angle))} {math.sin(math.radians(angle))} 0"
            x, y = ((RADIUS_M - PAD_M) * float(v) for v in out.split()[:2])
            pads += (
                f'<body name="pad{len(where)}" pos="{x} {y} {0.18432 - 0.0108 * row}"><joint '
                f'name="p{len(where)}" type="slide" axis="{out}" stiffness="{k}" '
                f'damping="{loss}" armature="{PAD_KG}"/>'
                f'<geom type="capsule" size="{PAD_M} {PAD_FLAT_M}" mass="0.0005" contype="1" '
                f'conaffinity="2" solref="{contact}" solimp="{SOLIMP} {SOLIMP} 0.001" '
                f'friction="{skin} 0.005 0.0001" condim="{dimensions}"/></body>'
            )
            where.append((row, column))
    xml, end, at = "", "", "0 0 0"
    for i, joint in enumerate(ARM.joints):
        axis, damping = " ".join(map(str, joint.axis)), CODY_DAMPING[i] * math.sqrt(touch.stiffness)
        size, mass, centre = links.get(i, ("0.02 0.01", 0.05, "0 0 0"))
        xml += (
            f'<body pos="{at}" gravcomp="1"><joint name="j{i}" axis="{axis}" damping="{damping}" '
            f'armature="0.004"/><geom type="capsule" size="{size}" pos="{centre}" mass="{mass}" '
            'contype="0" conaffinity="0"/>'
        )
        end = "</body>" + end
        at = " ".join(map(str, joint.translate))
    return xml + pads + end, where


def stems_xml(thing: Thing, skin: str) -> str:
    """Stems on hinges at the foot, bending along the push."""
    rng = np.random.default_rng(thing.seed)
    hinge = thing.stem_n_m * (ABOVE_FLOOR_M - 0.02) ** 2
    xml = ""
    for _ in range(thing.stems):
        x = 0.012 + rng.uniform(0.0, 0.08)
        y = rng.uniform(-0.5, 0.5) * min(thing.breadth_m, 0.15)
        length = rng.uniform(0.34, 0.5)
        xml += (
            f'<body pos="{x} {y} 0.02"><joint axis="0 1 0" stiffness="{hinge}" '
            f'damping="{0.03 * hinge}" armature="0.0002"/><geom type="capsule" size="0.006 '
            f'{length / 2}" pos="0 0 {length / 2}" mass="0.01" contype="2" conaffinity="1" '
            f"{skin}/></body>"
        )
    return xml


def thing_xml(touch: Touch, face: NDArray[np.float64], push: float) -> tuple[str, str, str]:
    """The thing, its face at `face` and turned by `push` radians about the vertical; the
    springs of a layer; and its face."""
    thing = touch.thing
    x, y, z = face
    base, width = z - ABOVE_FLOOR_M, thing.breadth_m
    half = (thing.below_m + thing.height_m / 2) / 2
    middle = ABOVE_FLOOR_M + thing.height_m / 2 - half
    skin = f'friction="{thing.skin} 0.005 0.0001"'
    floor = f'friction="{thing.floor} 0.005 0.0001"'
    springs, layer, back = "", "", FOOT_M / 2
    if thing.layered:
        upper, springs, layer = mujoco_layer.layer_xml(
            thing.height_m, thing.breadth_m, thing.modulus_pa, thing.thick_m
        )
        back = 0.2
    elif thing.soft:
        upper = stems_xml(thing, skin)
    else:
        shape = (
            f'type="cylinder" size="{width / 2 + 0.08} {half}" pos="{width / 2 + 0.08} 0 {middle}"'
            if thing.kind == "drum"
            else f'type="box" size="{FOOT_M / 2} {width / 2} {half}" pos="{FOOT_M / 2} 0 {middle}"'
        )
        upper = f'<geom {shape} mass="{thing.mass_kg * 0.2}" contype="2" conaffinity="1" {skin}/>'
    free = "" if touch.fixed else thing.joint
    return (
        f'<body name="thing" pos="{x} {y} {base}" axisangle="0 0 1 {push}">{free}<geom type="box" '
        f'size="{FOOT_M / 2} {max(width / 2, 0.08)} 0.004" pos="{back} 0 0.004" '
        f'mass="{thing.mass_kg * 0.8}" contype="4" conaffinity="8" {floor}/>{upper}</body>'
        f'<geom type="plane" size="4 4 0.1" pos="0 0 {base}" contype="8" conaffinity="4" {floor}/>',
        springs,
        layer,
    )


def model_of(touch: Touch) -> tuple[Any, NDArray[np.float64], list[tuple[int, int]]]:
    """MuJoCo's model of a touch, the arm's start (dof,), and where the pads are."""
    # It warns, and writes a file, of each face that only a layer's knots hold.
    mujoco.set_mju_user_warning(lambda text: None)
    start, rate = np.radians(START_DEG) + np.array(touch.start_rad), touch.rate_rad_s
    first = start - touch.lag_rad
    pose, later = ARM.pose(first + rate * LEAD_S), ARM.pose(first + rate * (LEAD_S + 0.01))
    on = np.array([0.0, 0.0, touch.place_m, 1.0])
    point = (pose @ on)[:3]
    speed = (later @ on)[:3] - point
    heading = math.atan2(speed[1], speed[0])
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    across = pose[:3, :3].T @ ahead
    arm, where = arm_xml(math.degrees(math.atan2(across[1], across[0])), touch)
    aside = np.array([-ahead[1], ahead[0], 0.0]) * touch.aside_m
    thing, springs, layer = thing_xml(
        touch, point + ahead * (RADIUS_M + 0.001) + aside, heading + touch.yaw_rad
    )
    gains = "".join(
        f'<position joint="j{i}" kp="{k * touch.stiffness}"/>'
        for i, k in enumerate(CODY_STIFFNESS[: ARM.dof])
    )
    slope, g = touch.slope_rad, 9.81
    fall = (*(g * math.sin(slope) * ahead[:2]), -g * math.cos(slope))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP_S}" integrator="implicitfast" cone="elliptic" '
        f'jacobian="dense" gravity="{" ".join(map(str, fall))}"/><worldbody>{arm}{thing}'
        f"</worldbody>{layer}<tendon>{springs}</tendon><actuator>{gains}</actuator></mujoco>"
    )
    return model, start, where


def simulate(touch: Touch) -> Touched:
    """One touch, as the board would have recorded it."""
    model, start, where = model_of(touch)
    thing, rate, dof = touch.thing, touch.rate_rad_s, ARM.dof
    data = mujoco.MjData(model)
    data.qpos[:dof] = start - touch.lag_rad
    data.qvel[:dof] = rate
    springs = [model.joint(f"p{i}").qposadr[0] for i in range(len(where))]
    row, column = np.array(where).T
    body = model.body("thing").id
    mujoco.mj_forward(model, data)
    rub = mujoco_layer.Rub(model, touch.thing.skin) if touch.thing.layered else None
    frames, joints, forces, places = [], [], [], []
    # A soft thing is felt later, the more so the slower the arm.
    lasts_s = LEAD_S + TOUCH_S + 0.6 * max(1.0 / touch.speed - 1.0, 0.0)
    for _ in range(round(lasts_s * RATE_HZ) + 1):
        loads = np.zeros((ROWS, CODY_SKIN["cols"]))
        loads[row, column] = np.maximum(-touch.pad_n_m * data.qpos[springs], 0.0)
        counts = loads * COUNTS_PER_NEWTON
        if touch.noise is not None:
            size, generator = touch.noise
            counts = counts + generator.normal(0.0, size, loads.shape)
        frames.append(np.where(counts < 35.0, 0.0, np.minimum(counts, 17e3)).astype(np.uint16))
        joints.append(data.qpos[:dof].copy())
        forces.append(loads.sum())
        turned = data.xmat[body].reshape(3, 3)
        places.append(data.xpos[body] + ABOVE_FLOOR_M * turned[:, 2])
        for _ in range(round(1.0 / (RATE_HZ * STEP_S))):
            data.ctrl[:] = start + rate * data.time
            if rub is not None:
                rub.hold(data, np.maximum(-touch.pad_n_m * data.qpos[springs], 0.0))
            mujoco.mj_step(model, data)
    condition = "fixed" if touch.fixed else "movable"
    soft = "soft" if thing.soft else "rigid"
    labels = {"category": f"{soft}-{condition}", "mobility": condition}
    labels |= {"softness": soft, "object": thing.kind}
    skin = {**CODY_SKIN, "counts_per_newton": COUNTS_PER_NEWTON}
    skin |= {"threshold_counts": THRESHOLD_COUNTS, "onset_counts": ONSET_COUNTS}
    source = "MuJoCo, bench/mujoco_touch.py"
    meta = {"labels": labels, "skin": skin, "arm": ARM.to_dict(), "source": source}
    t = np.arange(len(frames)) / RATE_HZ
    recording = Recording(t, np.array(frames), joints=np.array(joints), meta=meta)
    place = np.array(places) - places[0]
    return Touched(recording, np.array(forces), np.hypot(place[:, 0], place[:, 1]))
