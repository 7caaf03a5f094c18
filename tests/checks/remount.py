"""`make remount`: are grasps of a real hand told after it was taken off and put on again?

    python -m tests.checks.remount --recordings sdh2 icub

Half of the recordings of each folder are fitted. The others are decided as they are,
and as a remount leaves them: each joint's zero is off by 2 degrees, its gain by 3 %, or
the clock by 5 %. Neighbouring joints err in opposite directions.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.record.recording import load
from edge.record.saving import find
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.checks.bench.shifts import answers, exported, joints


def off(angles, by):
    """So much for each joint of angles (frames, dof), up and down in turns."""
    return np.resize([by, -by], angles.shape[1])


REMOUNTS = {
    "none": lambda recording: recording,
    "zeros off by 2 degrees": joints(lambda q: q + off(q, np.radians(2.0))),
    "gains off by 3 %": joints(lambda q: q * (1.0 + off(q, 0.03))),
    "clock 5 % slow": lambda recording: replace(recording, t=0.95 * recording.t),
}


def halves(folder):
    """The model of one half of a folder's recordings, and the other half."""
    paths = find([folder])
    return exported(paths[::2]), [*map(load, paths[1::2])]


def measure(recordings):
    """Fit and decide, and write the table."""
    rows = []
    for folder in recordings:
        model, others = halves(folder)
        for remount, change in REMOUNTS.items():
            judged = answers(model, map(change, others))["object"]
            right = judged["right"]
            unusual = judged["flags"].map(lambda flags: "unusual" in flags)
            rows.append(
                {
                    "recordings": Path(folder).name,
                    "remount": remount,
                    "answers": len(judged),
                    "right": right.sum(),
                    "right and unusual": (right & unusual).sum(),
                    "wrong and unusual": (~right & unusual).sum(),
                }
            )
    tables.write("remount", [rows], "make remount")


if __name__ == "__main__":
    start(measure, __doc__, ("--recordings", list, "folders of real recordings"))
