"""Write the demo that the wheel carries: a model, four touches new to it, and golden
outputs.

    python tests/board/demo_data.py build/demo-data

reads `model.onnx`, `known/` and `unseen/` from that folder (see `make demo-data`), and
replaces `edge/demo/` and `tests/golden/demo.npz`.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.decide.model import Model
from edge.decide.verify import first_series
from edge.record.recording import load
from edge.record.saving import save_arrays
from export import golden
from train.data.dataset import Measurement, load_trials

CHECKOUT = Path(__file__).resolve().parents[2]
TOUCHES = (
    "cardboard-box-fixed",
    "cardboard-box-movable",
    "foam-block-fixed",
    "pillow-movable",
)
META = ("labels", "skin", "source", "trial")
"""The model knows the arm."""
EVERY = 4
COUNT_STEP = 8
ENCODER_STEPS = 2**13
"""Every fourth frame takes a quarter of the bytes; features are sampled in time. Counts
are multiples of 8, as of a coarser converter: their noise is most of the files. An
encoder of 16 bits a turn has about so many steps a radian."""


def main(folder):
    """Write the files."""
    demo = CHECKOUT / "edge" / "demo"
    golden_file = CHECKOUT / "tests" / "golden" / "demo.npz"
    (demo / "model.onnx").write_bytes((folder / "model.onnx").read_bytes())
    model = Model(demo / "model.onnx")
    for touch in TOUCHES:
        recording = load(folder / "unseen" / f"{touch}-00.npz")
        contact = first_series(recording, model)
        assert contact is not None, f"{touch} touches nothing"
        short = golden.trimmed(replace(recording, valid=None), contact[0], model)
        # The last one is past the window.
        fourths = slice((len(short.t) - 1) % EVERY, None, EVERY)
        arrays = {
            "t": short.t[fourths] - short.t[fourths][0],
            "frames": short.frames[fourths] // COUNT_STEP * COUNT_STEP,
            "joints": np.rint(short.joints[fourths] * ENCODER_STEPS) / ENCODER_STEPS,
        }
        meta = {key: short.meta[key] for key in META}
        save_arrays(demo / f"{touch}.npz", arrays, meta)
    features = model.info.features
    X = load_trials([folder / "known"], Measurement(features)).features(
        model.info.window_s, model.info.samples
    )
    golden.write(golden_file, model, load_trials([demo], Measurement(features)), X)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
