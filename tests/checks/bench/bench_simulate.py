"""Time of a trial in the simulator and in MuJoCo, in processor time of the same run.

Trials have all effects that they call for, and end with recordings that are not
written. MuJoCo pushes a rigid, fixed box with the same arm and skin
(`tests/checks/bench/mujoco_touch.py`), which has far less physics. Both trials last 2 s and
more, with frames at 100 Hz. `python -m train simulate --explain` prints the cost of each
effect.
"""

import pytest

from tests.checks.bench import mujoco_touch, tables
from tests.checks.bench.mujoco_touch import Thing, Touch
from train.simulate.run import batches_of, simulate_trials
from train.simulate.scene import load

FASTER = {"cody18": 50.0, "household": 200.0}
"""{scene: how many times as fast as MuJoCo}: more where more trials run side by
side."""


@pytest.mark.parametrize("name", FASTER)
def bench_simulate(against, note, name):
    scene = load(tables.SCENES / f"{name}.toml")
    trials = batches_of(scene)[0]

    def ours():
        assert len(list(simulate_trials(scene, trials))) == len(trials)

    def theirs():
        mujoco_touch.simulate(Touch(Thing("box"), fixed=True))

    seconds = against(ours, {}, calls=1, rounds=3) / len(trials)
    their_s = against(theirs, {}, calls=1, rounds=3)
    bound = f"at most {1.0 / FASTER[name]:.3g}"
    note("a trial in MuJoCo", seconds / their_s, bound, seconds, their_s)
