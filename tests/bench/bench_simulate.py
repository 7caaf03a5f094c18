"""Trials a second of the simulator and of MuJoCo, in processor time of the same run.

Trials have all effects that they call for, and end with recordings that are not
written. MuJoCo steps a forearm with as many taxels against a fixed, a movable or a soft
box, which has far less physics. Both trials last 2 s and more, with frames of 384
taxels at 100 Hz. `python -m train simulate --explain` prints the cost of each effect.
"""

from pathlib import Path
from string import Template

import mujoco
import pytest

from tests.bench import tables
from train.simulate.run import batches_of, simulate_trials
from train.simulate.scene import load

PEERS = {
    "fixed": ("", ""),
    "movable": ("", '<joint type="slide" axis="1 0 0" frictionloss="3.4"/>'),
    "soft": ('solref="-3000 -50"', ""),
}
"""{box: (stiffness of its contact, its joint)}."""
FASTER = {"cody18": 1.5, "household": 2.0}
"""{scene: how many times MuJoCo's trials a second}: more where more trials run side by
side."""


FOREARM = Template(Path(__file__).with_name("forearm.xml").read_text())


def mujoco_trial(solref, joint):
    """A function that runs a trial of the forearm against a box in MuJoCo."""
    xml = FOREARM.substitute(solref=solref, joint=joint)
    model = mujoco.MjModel.from_xml_string(xml)
    assert model.nsensor == 384

    def trial():
        data = mujoco.MjData(model)
        highest = 0.0
        for frame in range(200):
            data.ctrl[0] = 0.15 * frame * 0.01
            mujoco.mj_step(model, data)
            highest = max(highest, data.sensordata.copy().max())
        assert highest > 0.1

    return trial


@pytest.mark.parametrize("name", FASTER)
def bench_simulate(against, note, name):
    scene = load(tables.SCENES / f"{name}.toml")
    batches = batches_of(scene)
    trials = [trial for batch in batches for trial in batch]
    kinds = [t.condition if t.object.family == "rigid" else "soft" for t in trials]
    peers = {kind: mujoco_trial(*peer) for kind, peer in PEERS.items()}

    def ours():
        recordings = [r for batch in batches for r in simulate_trials(scene, batch)]
        assert len(recordings) == len(trials)

    def theirs():
        for kind in kinds:
            peers[kind]()

    rival = {"MuJoCo": (theirs, 1.0 / FASTER[name])}
    seconds = against(ours, rival, calls=1, rounds=3)
    note("trials a second of one core", len(trials) / seconds, "-")
