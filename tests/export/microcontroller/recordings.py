"""Recordings that are hard for a model in C."""

from dataclasses import replace

import numpy as np

from edge.record.recording import Recording


def damaged(recording, rng):
    """A recording with jitter, repeated times, lift-offs, frames that are lost, taxels
    that cannot be read and poses that are not known."""
    n = len(recording.t)
    stays = rng.random(n) < 0.9
    stays[0] = True
    t = recording.t + rng.uniform(-0.004, 0.004, n)
    t[rng.random(n) < 0.05] = np.nan
    t = np.maximum.accumulate(np.where(np.isnan(t), recording.t[0], t))
    frames = recording.frames.copy()
    frames[rng.random(n) < 0.05] = 0
    joints = recording.joints
    if joints is not None:
        joints = np.where(rng.random((n, 1)) < 0.05, np.nan, joints)[stays]
    valid = rng.random(frames.shape) > 0.01
    return replace(
        recording, t=t[stays], frames=frames[stays], joints=joints, valid=valid[stays]
    )


def recordings_for(layout, count, rng):
    """Noisy touches that wander over a skin, up to the largest counts."""
    rows, cols = np.indices(layout.shape)
    recordings = []
    for _ in range(count):
        n = int(rng.integers(30, 150))
        frames = rng.integers(0, layout.threshold_counts + 1, (n, *layout.shape))
        for _ in range(rng.integers(1, 4)):
            row, col = rng.uniform(0, layout.shape)
            force = rng.choice([300, 3000, 60000])
            begin = int(rng.integers(0, n // 2))
            for i in range(begin, int(rng.integers(begin + 3, n + 1))):
                row, col = (row, col) + rng.normal(size=2) * (0.1, 0.4)
                aside = np.abs(cols - col) % layout.cols
                around = (
                    np.minimum(aside, layout.cols - aside) if layout.wraps else aside
                )
                frames[i] += (force * np.exp(-((rows - row) ** 2 + around**2))).astype(
                    int
                )
        t = np.arange(n) / 100.0 + rng.uniform(0, 50)
        turns = rng.choice([0.05, 1e4])
        joints = turns * rng.normal(size=(n, 5)).cumsum(axis=0)
        frames = np.minimum(frames, 65535).astype(np.uint16)
        meta = {"skin": layout.to_dict()}
        recordings.append(damaged(Recording(t, frames, joints, meta=meta), rng))
    return recordings


def on_the_edges(layout):
    """Contacts that stand on the edge of a comparison, from 0 s on."""
    count = layout.onset + 100
    frames = np.zeros((9, 140, *layout.shape), np.uint16)
    t = np.tile(np.arange(140) / 100, (9, 1))
    frames[0, :10, 2, 1] = layout.onset
    frames[0, 10:, 2, 1] = layout.onset + 1
    frames[1, :, 1, 1] = frames[1, :, 5, 3] = count  # equal regions
    frames[1, 21:, 5, 3] += 1  # after a frame without contact
    frames[2, :, 2, [0, 1, -1]] = count  # about the seam
    frames[3, ::4, 2, 0] = frames[3, 1::4, 2, 0] = count  # half-way around and back
    frames[3, 2::4, 2, layout.cols // 2] = frames[3, 3::4, 2, layout.cols // 2] = count
    growing = count + np.arange(140)[:, None] * (3, 5, 7)
    frames[4, :, [0, 3, 6], [0, 1, 2]] = growing.T  # on a line
    frames[5:, :, 2, 1:3] = growing[:, 1:]
    frames[5, [30, 60, 120]] = 0  # lifted off as a window ends
    frames[[1, 6], 20] = 0  # as it is released
    t[6, 20:] += layout.release_s - 0.01 - 5e-7
    t[7, 1:] = np.arange(1, 140) * 0.6 / 39 + 5e-7  # as kernels are taken
    t[8, 1:] += 0.04  # a step as long as it may be without a flag
    joints = np.linspace(0, [2e5, -3e4, 1, 2, 3], 141)
    # The frame before says that the touch was not under way.
    t = np.insert(t, 0, -0.01, axis=1)
    frames = np.insert(frames, 0, 0, axis=1)
    valid = np.ones(frames[0].shape, bool)
    valid[:, 0, 3] = False
    more = {"joints": joints, "valid": valid, "meta": {"skin": layout.to_dict()}}
    return [Recording(*of, **more) for of in zip(t, frames, strict=True)]
