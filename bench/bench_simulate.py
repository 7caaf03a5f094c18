"""Trials a second of the simulator, beside MuJoCo in the same run: on the same three scenes, and
on whole scenes with all that they call for.

A trial is 2 s with full frames of 384 taxels at 100 Hz, a batch has 256. Writing and each effect's
cost have rows of their own.
"""

from __future__ import annotations

import math
import statistics
import time
from pathlib import Path

import pytest

from edge import recording
from train.simulate.engine import run_batch
from train.simulate.explain import costs
from train.simulate.run import kinds, parts, simulate_trials
from train.simulate.scene import COLUMN_ANGLES_DEG, from_dict, load
from train.simulate.scene_model import TrialSpec
from train.simulate.schema import EFFECTS

FILES = Path(__file__).parents[1] / "train" / "scenes"
BATCH = 256
MOVES = {"mass_kg": 1.0, "friction_static": 0.4, "friction_kinetic": 0.35}
SCENES = {
    "fixed box": ("rigid", "fixed"),
    "movable box": ("rigid", "movable"),
    "soft block": ("foam", "fixed"),
}


def make(family, condition, *add, count=BATCH):
    thing = {"name": "thing", "family": family, "conditions": [condition], "width_m": 0.1, **MOVES}
    return from_dict(
        {
            "trials": {"count": count, "lead_s": 0.2, "after_s": 1.8},
            "step_s": {"base": 0.01, "sliding": 0.005},
            "spread": {"place_m": 0.01, "roll_deg": 4.0, "friction": 0.1},
            "effects": {"add": list(add)},
            "object": [thing],
        }
    )


def peer_model(family, condition):
    """A forearm of 384 touch geoms on a slide of the arm's stiffness, against a box."""
    taxels, sensors = [], []
    for row in range(16):
        for column, degrees in enumerate(COLUMN_ANGLES_DEG):
            angle = math.radians(degrees)
            x, y = 0.043 * math.cos(angle), 0.043 * math.sin(angle)
            z = (7.5 - row) * 0.0108
            name = f"t{row}_{column}"
            taxels.append(
                f'<geom type="sphere" size="0.0045" pos="{x} {y} {z}" mass="0.004" '
                f'contype="1" conaffinity="2"/>'
                f'<site name="{name}" type="sphere" size="0.006" pos="{x} {y} {z}"/>'
            )
            sensors.append(f'<touch site="{name}"/>')
    soft = 'solref="-3000 -50"' if family == "foam" else ""
    free = '<joint type="slide" axis="1 0 0" frictionloss="3.4"/>' if condition == "movable" else ""
    return f"""<mujoco><worldbody>
      <body name="arm"><joint name="reach" type="slide" axis="1 0 0" damping="6"/>
        {"".join(taxels)}</body>
      <body pos="0.13 0 0">{free}<geom type="box" size="0.05 0.15 0.05" mass="1"
        contype="2" conaffinity="1" {soft}/></body></worldbody>
      <actuator><position joint="reach" kp="115"/></actuator>
      <option timestep="0.01" integrator="implicitfast" gravity="0 0 0"/>
      <sensor>{"".join(sensors)}</sensor></mujoco>"""


def mujoco_trial(name):
    """A trial in MuJoCo, as a function; None where it is not installed."""
    try:
        import mujoco
    except ImportError:
        return None
    model = mujoco.MjModel.from_xml_string(peer_model(*SCENES[name]))

    def trial():
        data = mujoco.MjData(model)
        frames = []
        for frame in range(200):
            data.ctrl[0] = 0.15 * frame * 0.01
            mujoco.mj_step(model, data)
            frames.append(data.sensordata.copy())
        assert max(f.max() for f in frames) > 0.1
        return frames

    return trial


@pytest.mark.parametrize("tilt", [(), ("tilt",)], ids=["plain", "tilt"])
@pytest.mark.parametrize("name", SCENES)
def bench_simulate(benchmark, note, name, tilt):
    family, condition = SCENES[name]
    scene = make(family, condition, *tilt)
    trials = tuple(next(iter(kinds(scene).values())))
    peer = mujoco_trial(name)
    peers = []

    def peer_first():
        if peer is not None:
            began = time.perf_counter()
            peer()
            peers.append(time.perf_counter() - began)

    def ours():
        batch = run_batch(scene, trials)
        assert batch.counts.shape == (BATCH, 201, 16, 24)

    ours()
    benchmark.pedantic(ours, setup=peer_first, rounds=5, iterations=1)
    rate = BATCH / benchmark.stats.stats.median
    note("trials a second", rate, "-" if tilt else "at least 1000")
    if peers:
        note("times MuJoCo's trials a second", rate * statistics.median(peers), "at least 40")


def bench_write(benchmark, note, tmp_path):
    """Recordings of one batch to files, beside simulating them."""
    scene = make("rigid", "fixed")
    trials = tuple(next(iter(kinds(scene).values())))
    simulated, files = [], []

    def simulate():
        began = time.perf_counter()
        files[:] = simulate_trials(scene, trials)
        simulated.append(time.perf_counter() - began)

    runs = iter(range(100))

    def write():
        folder = tmp_path / str(next(runs))
        for name, trial in files:
            recording.save(folder / name, trial)

    benchmark.pedantic(write, setup=simulate, rounds=3, iterations=1)
    mine = benchmark.stats.stats.median
    note("us a trial", mine / BATCH * 1e6, "-")
    note("simulating the same", mine / statistics.median(simulated), "at most 1")


def peer_of(trial):
    """The name of MuJoCo's scene that stands for a trial: it has far less of physics in it."""
    if trial.object.family != "rigid":
        return "soft block"
    return f"{trial.condition} box"


@pytest.mark.parametrize("name", [path.stem for path in sorted(FILES.glob("*.toml"))])
def bench_scene(benchmark, note, name):
    """Every trial of a scene with all that it calls for, as recordings, without writing them, and
    as many trials of MuJoCo, fixed, movable and soft as the scene's are."""
    scene = load(FILES / f"{name}.toml")
    work = parts(scene)
    peers = {name: mujoco_trial(name) for name in SCENES}
    seconds = {name: [] for name in peers}

    def peers_first():
        for name, peer in peers.items():
            if peer is not None:
                began = time.process_time()
                peer()
                seconds[name].append(time.process_time() - began)

    spent = []

    def ours():
        began = time.process_time()
        count = sum(1 for trials in work for _ in simulate_trials(scene, trials))
        spent.append((time.process_time() - began) / count)

    ours()
    benchmark.pedantic(ours, setup=peers_first, rounds=3, iterations=1)
    mine = statistics.median(spent[1:])
    note("trials a second of one core", 1.0 / mine, "at least 1000")
    if all(seconds.values()):
        each = [statistics.median(seconds[peer_of(trial)]) for part in work for trial in part]
        note("times MuJoCo's trials a second", statistics.mean(each) / mine, "at least 40")


FULL = {
    "skin_friction": 0.4,
    "cover_n_m": 2600.0,
    "stribeck_m_s": 0.05,
    "base_m": 0.1,
    "height_m": 0.3,
    "foot_m": 0.2,
    "aside_m": 0.02,
    "slope_deg": 1.0,
}


@pytest.mark.parametrize("effect", EFFECTS)
def bench_effect(benchmark, note, effect):
    """Microseconds a trial of each effect, in a movable trial of a family that supports it."""
    info = EFFECTS[effect]
    family = info.families[0] if info.families else "rigid"
    keys = {k: FULL[k] for k in info.keys}
    thing = {"name": "thing", "family": family, "conditions": ["movable"], **MOVES, **keys}
    table = {
        "trials": {"count": 1, "lead_s": 0.2, "after_s": 1.8},
        "step_s": {"base": 0.01},
        "effects": {"add": [effect]},
        "object": [thing],
    }
    scene = from_dict(table)
    trials = tuple(TrialSpec(scene.objects[0], "movable", k) for k in range(64))
    found = benchmark.pedantic(costs, (scene, trials), rounds=1, iterations=1)
    note("us a trial", found[effect], "-")
