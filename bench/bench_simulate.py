"""Trials a second of the simulator and of MuJoCo, in processor time of the same run.

Trials have all effects that they call for, and end with recordings that are not written. MuJoCo
steps a forearm with as many taxels against a fixed, a movable or a soft box, which has far less
physics. Both trials last 2 s and more, with frames of 384 taxels at 100 Hz. `python -m train
simulate --explain` prints the cost of each effect.
"""

import math
from pathlib import Path

import mujoco
import pytest

from train.simulate.run import batches_of, simulate_trials
from train.simulate.scene import CODY_SKIN, load

SCENES = Path(__file__).parents[1] / "train" / "scenes"
PEERS = {
    "fixed": ("", ""),
    "movable": ("", '<joint type="slide" axis="1 0 0" frictionloss="3.4"/>'),
    "soft": ('solref="-3000 -50"', ""),
}
"""{box: (stiffness of its contact, its joint)}."""
FASTER = {"cody18": 1.5, "household": 2.0}
"""{scene: how many times MuJoCo's trials a second}: more where more trials run side by side."""


def mujoco_trial(solref, joint):
    """A function that runs a trial in MuJoCo: 384 touch geoms on a slide with the arm's stiffness,
    against a box."""
    taxels, sensors = "", ""
    for row in range(16):
        for column, degrees in enumerate(CODY_SKIN["column_angles_deg"]):
            angle = math.radians(degrees)
            x, y, z = 0.043 * math.cos(angle), 0.043 * math.sin(angle), (7.5 - row) * 0.0108
            taxels += (
                f'<geom type="sphere" size="0.0045" pos="{x} {y} {z}" mass="0.004" contype="1" '
                f'conaffinity="2"/><site name="t{row}_{column}" size="0.006" pos="{x} {y} {z}"/>'
            )
            sensors += f'<touch site="t{row}_{column}"/>'
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.01" integrator="implicitfast" gravity="0 0 0"/><worldbody>
        <body><joint name="reach" type="slide" axis="1 0 0" damping="6"/>{taxels}</body>
        <body pos="0.13 0 0">{joint}<geom type="box" size="0.05 0.15 0.05" mass="1" contype="2"
        conaffinity="1" {solref}/></body></worldbody><actuator><position joint="reach" kp="115"/>
        </actuator><sensor>{sensors}</sensor></mujoco>"""
    )

    def trial():
        data, highest = mujoco.MjData(model), 0.0
        for frame in range(200):
            data.ctrl[0] = 0.15 * frame * 0.01
            mujoco.mj_step(model, data)
            highest = max(highest, data.sensordata.copy().max())
        assert highest > 0.1

    return trial


@pytest.mark.parametrize("name", FASTER)
def bench_simulate(against, note, name):
    scene = load(SCENES / f"{name}.toml")
    batches = batches_of(scene)
    trials = [trial for batch in batches for trial in batch]
    kinds = [t.condition if t.object.family == "rigid" else "soft" for t in trials]
    peers = {kind: mujoco_trial(*peer) for kind, peer in PEERS.items()}

    def ours():
        assert sum(1 for batch in batches for _ in simulate_trials(scene, batch)) == len(trials)

    def theirs():
        for kind in kinds:
            peers[kind]()

    most = {"MuJoCo": 1.0 / FASTER[name]}
    seconds = against(ours, {"MuJoCo": theirs}, most=most, calls=1, rounds=3)
    note("trials a second of one core", len(trials) / seconds, "-")
