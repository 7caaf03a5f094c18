"""The command that proposes thresholds."""

from dataclasses import replace

import numpy as np

from edge.recording import save
from train.__main__ import main


def noisy(recording, seed):
    """With noise of up to 40 counts on every taxel."""
    noise = np.random.default_rng(seed).integers(0, 41, recording.frames.shape).astype(np.uint16)
    return replace(recording, frames=np.maximum(recording.frames, noise))


def test_the_command_says_what_to_use(make_touch, tmp_path, capsys):
    for seed in range(3):
        save(tmp_path / f"{seed}.npz", noisy(make_touch(seed=seed), seed))
    assert main(["thresholds", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("use: --threshold 8")
    row = next(line for line in lines if line.startswith("proposed"))
    assert row.split()[-1] == "3"


def test_the_command_says_what_its_proposal_hides(make_touch, tmp_path, capsys):
    for seed, peak in enumerate((900.0, 900.0, 70.0, 50.0)):
        touch = make_touch(seed=seed)
        frames = (touch.frames * (peak / touch.frames.max())).astype(np.uint16)
        save(tmp_path / f"{seed}.npz", noisy(replace(touch, frames=frames), seed))
    assert main(["thresholds", str(tmp_path)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("other thresholds show a contact in 1 more of the recordings")
