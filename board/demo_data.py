"""Write the demo that the wheel carries: a model, four touches new to it, and golden outputs.

    python board/demo_data.py build/demo-data

reads `model.onnx`, `known/` and `unseen/` from that folder (see `make demo-data`), and replaces
`edge/demo/` and `tests/golden/demo.npz`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load, save_arrays
from export import golden
from train.dataset import load_trials

CHECKOUT = Path(__file__).resolve().parents[1]
TOUCHES = ("cardboard-box-fixed", "cardboard-box-movable", "foam-block-fixed", "pillow-movable")
META = ("arm", "labels", "skin", "source", "trial")
COUNT_STEP = 8
"""Counts are multiples of this, as of a coarser converter: their noise is most of the files."""
ENCODER_STEPS = 2**17
"""Steps of a radian: an encoder of 20 bits a turn is about as fine, and such angles pack well."""


def main(folder: Path) -> None:
    """Write the files."""
    demo = CHECKOUT / "edge" / "demo"
    for old in (*demo.glob("*.npz"), *demo.glob("*.onnx")):
        old.unlink()
    (demo / "model.onnx").write_bytes((folder / "model.onnx").read_bytes())
    model = Model(demo / "model.onnx")
    for touch in TOUCHES:
        recording = load(folder / "unseen" / f"{touch}-00.npz")
        contact = first_series(recording, model)
        assert contact is not None, f"{touch} touches nothing"
        short = golden.trimmed(replace(recording, valid=None), contact[0], model)
        # Every other frame takes half the bytes; features are sampled in time.
        frames = short.frames[::2] // COUNT_STEP * COUNT_STEP
        arrays = {"t": (short.t - short.t[0])[::2], "frames": frames}
        if short.joints is not None:
            arrays["joints"] = np.rint(short.joints[::2] * ENCODER_STEPS) / ENCODER_STEPS
        meta = {key: short.meta[key] for key in META if key in short.meta}
        save_arrays(demo / f"{touch}.npz", arrays, meta, compress=True)
    info = model.info
    known = load_trials([folder / "known"], features=info.features)
    golden.write(
        CHECKOUT / "tests" / "golden" / "demo.npz",
        model,
        load_trials([demo], features=info.features),
        known.features(info.window_s, info.samples),
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
