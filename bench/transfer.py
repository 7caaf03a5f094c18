"""Does a model trained on a simulated scene hold in another engine? `make transfer`.

MuJoCo makes trials of the paper's kind with parameters of its own, written as recordings, and the
model is scored on them. They are a test: nothing in train/ reads them, and nothing may be tuned
to one set of them; `--seed` makes another.

The arm is Cody's chain with its masses on gravity-compensated links, driven as an impedance
controller drives it; the skin is a row of touch pads for each taxel that can meet the object; the
objects stand on a floor under gravity, or are clamped; what is soft is a wall of sprung blocks that
pull their neighbours along, and a plant is a set of hinged stems.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import edge
from edge.errors import InputError
from edge.recording import Recording, load, save
from edge.touch.arm import Chain
from train.simulate import streams
from train.simulate.scene import CODY_DAMPING, CODY_SKIN, CODY_STIFFNESS, COLUMN_ANGLES_DEG

TASKS = ("category", "mobility", "softness")
START_DEG = (-41.0, 4.0, 0.0, 40.0, 0.0)
RATE_DEG_S = 20.0
LEAD_S, LASTS_S, RATE_HZ, STEP_S = 0.3, 2.1, 100, 0.002
PLACE_M = 0.10
COUNTS_PER_NEWTON = 1000.0
RADIUS_M = 0.04604
ROWS = 16
COLUMNS = range(0, 24)
FACING_DEG = 68.0
"""Taxels whose normal lies farther from the push than this can't meet anything."""


def chain_xml(chain: Chain, facing_deg: float, pad: str) -> tuple[str, list[tuple[int, int]]]:
    """The arm's bodies, and the (row, column) of each pad."""
    masses = {1: (2.1, "0 0 -0.13"), 3: (1.5, "0 0 -0.12")}
    pads, where = [], []
    for row in range(ROWS):
        for column in COLUMNS:
            angle = COLUMN_ANGLES_DEG[column]
            off = (angle - facing_deg + 180.0) % 360.0 - 180.0
            if abs(off) > FACING_DEG:
                continue
            a = math.radians(angle)
            x, y = (RADIUS_M - 0.004) * math.cos(a), (RADIUS_M - 0.004) * math.sin(a)
            z = 0.18432 - 0.0108 * row
            pads.append(f'<geom name="p{len(where)}" pos="{x} {y} {z}" {pad}/>')
            where.append((row, column))
    xml, end, at = "", "", "0 0 0"
    for i, joint in enumerate(chain.joints):
        axis = " ".join(map(str, joint.axis))
        xml += f'<body pos="{at}" gravcomp="1"><joint name="j{i}" axis="{axis}" '
        xml += f'damping="{CODY_DAMPING[i]}" armature="0.004"/>'
        mass, centre = masses.get(i, (0.05, "0 0 0"))
        size = "0.03 0.09" if i in masses else "0.02 0.01"
        xml += f'<geom type="capsule" size="{size}" pos="{centre}" mass="{mass}" '
        xml += 'contype="0" conaffinity="0"/>'
        end = "</body>" + end
        at = " ".join(map(str, joint.translate))
    return xml + "".join(pads) + end, where


def draw_object(rng: np.random.Generator) -> dict[str, Any]:
    """One object's properties, from ranges that are no scene's of train/."""
    kind = str(rng.choice(["box", "drum", "foam", "cushion", "plant", "bale"]))
    soft = {"foam": (3e3, 18e3), "cushion": (1.2e3, 5e3), "bale": (5e3, 12e3)}
    out: dict[str, Any] = {
        "kind": kind,
        "soft": kind not in ("box", "drum"),
        "mass": float(np.exp(rng.uniform(np.log(0.25), np.log(2.2)))),
        "floor": float(rng.uniform(0.25, 0.6)),
        "skin": float(rng.uniform(0.25, 0.65)),
        "height": float(rng.uniform(0.12, 0.45)),
        "breadth": float(rng.uniform(0.06, 0.4)),
        "stems": int(rng.integers(5, 12)),
        "stem": float(np.exp(rng.uniform(np.log(3.0), np.log(25.0)))),
        "thick": float(rng.uniform(0.06, 0.16)),
    }
    low, high = soft.get(kind, (1.0, 2.0))
    out["modulus"] = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    return out


def object_xml(what: dict[str, Any], fixed: bool, face: np.ndarray, push: float) -> str:
    """The object, its face at `face` and turned by `push` radians about the vertical."""
    x, y, z = face
    base = z - 0.30
    depth, width, height = 0.16, what["breadth"], 0.30 + what["height"] / 2
    middle = height / 2
    joint = "" if fixed else "<freejoint/>"
    floor = f'friction="{what["floor"]} 0.005 0.0001"'
    skin = f'friction="{what["skin"]} 0.005 0.0001"'
    turn = f'pos="{x} {y} {base}" axisangle="0 0 1 {push}"'
    foot = f'<geom type="box" size="{depth / 2} {width / 2} 0.004" pos="{depth / 2 + 0.2} 0 0.004" '
    foot += f'mass="{what["mass"] * 0.8}" contype="4" conaffinity="8" {floor}/>'
    parts = ""
    if what["kind"] in ("box", "drum"):
        shape = (
            f'type="box" size="{depth / 2} {width / 2} {middle}" pos="{depth / 2} 0 {middle}"'
            if what["kind"] == "box"
            else f'type="cylinder" size="{width / 2 + 0.08} {middle}" '
            f'pos="{width / 2 + 0.08} 0 {middle}"'
        )
        parts = f'<geom {shape} mass="{what["mass"] * 0.2}" contype="2" conaffinity="1" {skin}/>'
        foot = foot.replace(f"{depth / 2 + 0.2} 0 0.004", f"{depth / 2} 0 0.004")
    elif what["kind"] == "plant":
        rng = np.random.default_rng(int(what["stem"] * 1e6))
        for _ in range(what["stems"]):
            sx, sy = rng.uniform(0.0, 0.08), rng.uniform(-0.03, 0.03)
            length = rng.uniform(0.3, 0.5)
            k = what["stem"] * 0.3**2
            parts += (
                f'<body pos="{sx + 0.012} {sy} 0.02"><joint axis="0 1 0" stiffness="{k}" '
                f'damping="{0.03 * k}" armature="0.0002"/><geom type="capsule" size="0.006 '
                f'{length / 2}" pos="0 0 {length / 2}" mass="0.01" contype="2" conaffinity="1" '
                f"{skin}/></body>"
            )
    else:
        dz, dy = 0.024, 0.02
        rows, cols = round(min(what["height"], 0.22) / dz), round(min(width, 0.14) / dy) | 1
        k = what["modulus"] * dz * dy / what["thick"]
        side = 0.4 * k * (what["thick"] / dy) ** 2 * 0.15
        tendons = ""
        for r in range(rows):
            for c in range(cols):
                py, pz = (c - cols // 2) * dy, 0.30 + (r - (rows - 1) / 2) * dz
                parts += (
                    f'<body pos="0.004 {py} {pz}"><joint name="b{r}_{c}" type="slide" axis="1 0 0" '
                    f'stiffness="{k}" damping="{0.06 * k + 0.2}" range="0 {what["thick"] * 0.9}" '
                    f'limited="true"/><geom type="box" size="0.004 {dy / 2} {dz / 2}" mass="0.004" '
                    f'contype="2" conaffinity="1" {skin}/></body>'
                )
                for r2, c2 in ((r + 1, c), (r, c + 1)):
                    if r2 < rows and c2 < cols:
                        tendons += (
                            f'<fixed stiffness="{side}"><joint joint="b{r}_{c}" coef="1"/>'
                            f'<joint joint="b{r2}_{c2}" coef="-1"/></fixed>'
                        )
        what["tendons"] = tendons
    return (
        f'<body {turn}>{joint}{foot}{parts}</body><geom type="plane" size="4 4 0.1" '
        f'pos="0 0 {base}" contype="8" conaffinity="4" {floor}/>'
    )


def simulate(what: dict[str, Any], fixed: bool, rng: np.random.Generator) -> Recording:
    """One trial, as the board would have recorded it.

    Raises:
        InputError: MuJoCo is not installed.
    """
    try:
        import mujoco
    except ImportError:
        raise InputError("transfer needs MuJoCo: pip install --group bench") from None
    what = dict(what)
    chain = Chain.cody()
    rate = np.zeros(chain.dof)
    rate[0] = math.radians(RATE_DEG_S)
    start = np.radians(START_DEG) + np.radians(rng.normal(0.0, (0.5, 1.0, 1.0, 3.0, 3.0)))
    pose, later = chain.pose(start + rate * LEAD_S), chain.pose(start + rate * (LEAD_S + 0.01))
    on = np.array([0.0, 0.0, PLACE_M + rng.normal(0.0, 0.015), 1.0])
    point = (pose @ on)[:3]
    speed = (later @ on)[:3] - point
    heading = math.atan2(speed[1], speed[0])
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    across = pose[:3, :3].T @ ahead
    facing = math.degrees(math.atan2(across[1], across[0]))
    softness = float(np.exp(rng.uniform(np.log(5e3), np.log(1.5e4))))
    pad = 'type="sphere" size="0.0048" mass="0.002" contype="1" conaffinity="2" '
    pad += f'solref="-{softness} -{softness * 0.004}" friction="{what["skin"]} 0.005 0.0001"'
    arm, where = chain_xml(chain, facing, pad)
    side = np.array([-ahead[1], ahead[0], 0.0]) * rng.normal(0.0, 0.01)
    thing = object_xml(
        what, fixed, point + ahead * (RADIUS_M + 0.001) + side, heading + rng.normal(0.0, 0.03)
    )
    gains = "".join(
        f'<position joint="j{i}" kp="{k}"/>' for i, k in enumerate(CODY_STIFFNESS[: chain.dof])
    )
    tilt = math.radians(rng.normal(0.0, 0.7))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP_S}" integrator="implicitfast" cone="elliptic" '
        f'gravity="{9.81 * math.sin(tilt)} 0 {-9.81 * math.cos(tilt)}"/><worldbody>{arm}{thing}'
        f"</worldbody><tendon>{what.get('tendons', '')}</tendon><actuator>{gains}</actuator>"
        "</mujoco>"
    )
    data = mujoco.MjData(model)
    lag = np.array(CODY_DAMPING) / np.array(CODY_STIFFNESS) * rate
    data.qpos[: chain.dof] = start - lag
    data.qvel[: chain.dof] = rate
    pads = {
        mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"p{i}"): at
        for i, at in enumerate(where)
    }
    frames, joints = [], []
    wrench = np.zeros(6)
    for _ in range(round(LASTS_S * RATE_HZ) + 1):
        loads = np.zeros((ROWS, 24))
        for i in range(data.ncon):
            touch = data.contact[i]
            at = pads.get(int(touch.geom1), pads.get(int(touch.geom2)))
            if at is not None:
                mujoco.mj_contactForce(model, data, i, wrench)
                loads[at] += max(float(wrench[0]), 0.0)
        counts = loads * COUNTS_PER_NEWTON + rng.normal(0.0, 6.0, loads.shape)
        frames.append(np.where(counts < 35.0, 0.0, np.minimum(counts, 17e3)).astype(np.uint16))
        joints.append(data.qpos[: chain.dof].copy())
        for _ in range(round(1.0 / (RATE_HZ * STEP_S))):
            data.ctrl[:] = start + rate * data.time
            mujoco.mj_step(model, data)
    condition, soft = "fixed" if fixed else "movable", "soft" if what["soft"] else "rigid"
    skin = {**CODY_SKIN, "counts_per_newton": COUNTS_PER_NEWTON}
    meta = {
        "labels": {
            "category": f"{soft}-{condition}",
            "mobility": condition,
            "softness": soft,
            "object": what["kind"],
        },
        "skin": {**skin, "threshold_counts": 40, "onset_counts": 60},
        "arm": chain.to_dict(),
        "source": "MuJoCo, bench/transfer.py",
    }
    return Recording(
        t=np.arange(len(frames)) / RATE_HZ,
        frames=np.array(frames),
        joints=np.array(joints),
        valid=None,
        meta=meta,
    )


def make_trials(folder: Path, count: int, seed: int) -> list[Path]:
    """`count` trials of a fifth as many objects, each fixed and movable, into a folder."""
    from tqdm import tqdm

    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number in tqdm(range(count), unit="trial", file=sys.stderr, desc="MuJoCo"):
        index, fixed = number // 6, number % 2 == 0
        what = draw_object(streams.stream(seed, "object", "transfer", index))
        path = folder / f"{what['kind']}-{index:02d}-{'fixed' if fixed else 'movable'}-{number}.npz"
        if not path.exists():
            save(path, simulate(what, fixed, streams.stream(seed, "trial", "transfer", number)))
        paths.append(path)
    return paths


def interval(right: int, count: int) -> tuple[float, float]:
    """95 % of the share `right / count` (Wilson)."""
    p, z = right / count, 1.96
    centre = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return centre - half, centre + half


def score(model: edge.Model, paths: list[Path]) -> dict[str, list[tuple[str, str]]]:
    """{task: (true, decided) of each trial}; a contact that was never decided counts as wrong."""
    told: dict[str, list[tuple[str, str]]] = {
        task: [] for task in TASKS if task in model.info.tasks
    }
    for path in paths:
        recording = load(path)
        decided: dict[str, str] = {}
        for event in edge.Classifier(model).classify(recording):
            if isinstance(event, edge.Decided) and event.task not in decided:
                decided[event.task] = str(event.label)
        for task, pairs in told.items():
            pairs.append((recording.labels[task], decided.get(task, "no decision")))
    return told


def report(told: dict[str, list[tuple[str, str]]]) -> str:
    """Accuracies with intervals, and the confusion of categories."""
    lines = []
    for task, pairs in told.items():
        right = sum(a == b for a, b in pairs)
        low, high = interval(right, len(pairs))
        lines.append(
            f"{task:<10}{100 * right / len(pairs):6.1f} %  ({100 * low:.0f} to {100 * high:.0f}, "
            f"{len(pairs)} trials)"
        )
    for task, pairs in told.items():
        seen = Counter(pairs)
        names = sorted({name for pair in pairs for name in pair})
        lines += ["", f"{task}: true in rows, decided in columns"]
        lines.append(" " * 16 + "".join(f"{n[:14]:>15}" for n in names))
        lines += [
            f"{a:<16}" + "".join(f"{seen[a, b]:>15}" for b in names)
            for a in names
            if any(seen[a, b] for b in names)
        ]
    return "\n".join(lines)


def draw_curves(ours: list[Path], theirs: list[Path], out: Path) -> None:
    """The paper's features over time, both engines side by side, one line a category."""
    from matplotlib.figure import Figure

    from train.dataset import load_trials

    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey="col")
    for row, (name, paths) in enumerate((("our simulator", ours), ("MuJoCo", theirs))):
        data = load_trials([str(p) for p in paths])
        x, labels = data.features(), data.labels("category")
        t = np.linspace(0.0, 1.2, x.shape[1] // 3)
        for category in sorted(set(labels)):
            mean = np.median(x[labels == category], axis=0).reshape(3, -1)
            low, high = (
                np.quantile(x[labels == category], q, axis=0).reshape(3, -1) for q in (0.25, 0.75)
            )
            for axis, m, a, b in zip(axes[row], mean, low, high, strict=True):
                (line,) = axis.plot(t, m, label=category)
                axis.fill_between(t, a, b, color=line.get_color(), alpha=0.15)
        for axis, what in zip(
            axes[row], ("largest force, N", "area, taxels", "motion, m"), strict=True
        ):
            axis.set_ylabel(what)
            axis.set_title(f"{name}")
    for axis in axes[1]:
        axis.set_xlabel("seconds from onset")
    axes[0, 0].legend(fontsize=8)
    figure.suptitle("Median and middle half of the features, by category")
    figure.savefig(out, dpi=110)


def main(arguments: list[str] | None = None) -> int:
    """Make the trials, score the model on them, print and draw."""
    parser = argparse.ArgumentParser(prog="bench.transfer", description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("build/transfer"))
    parser.add_argument("--trials", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--ours", type=Path, help="folder of simulated trials to draw beside")
    told = parser.parse_args(arguments)
    try:
        paths = make_trials(told.out / f"seed{told.seed}", told.trials, told.seed)
        text = report(score(edge.Model(told.model), paths))
    except InputError as error:
        print(f"transfer: {error}", file=sys.stderr)
        return 2
    print(text)
    (told.out / "transfer.txt").write_text(text + "\n")
    if told.ours is not None:
        draw_curves(sorted(told.ours.glob("*.npz")), paths, told.out / "curves.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
