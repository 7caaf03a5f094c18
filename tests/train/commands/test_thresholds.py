"""Thresholds from a skin's own noise."""

from dataclasses import replace

import numpy as np

from edge.recording import save
from train.__main__ import main
from train.commands.thresholds import count_contacts, proposed


def noisy(recording, seed):
    """With noise of up to 40 counts on every taxel."""
    noise = np.random.default_rng(seed).integers(0, 41, recording.frames.shape).astype(np.uint16)
    return replace(recording, frames=np.maximum(recording.frames, noise))


def test_the_proposal_lies_above_the_noise_and_finds_every_contact(make_touch):
    trials = [noisy(make_touch(seed=seed), seed) for seed in range(6)]
    threshold, onset = proposed(trials)
    assert 70 <= threshold <= 80
    assert onset == round(1.5 * threshold)
    assert count_contacts(trials, threshold, onset) == (6, 6)
    assert count_contacts(trials, 60000, 60000) == (0, 0)


def test_a_few_recordings_that_begin_in_contact_do_not_raise_it(make_touch):
    trials = [noisy(make_touch(seed=seed), seed) for seed in range(12)]
    begun = [noisy(make_touch(seed=99, lead_s=0.0), 99)]
    assert proposed(trials + begun)[0] <= 80


def test_the_command_says_what_to_use(make_touch, tmp_path, capsys):
    for seed in range(3):
        save(tmp_path / f"{seed}.npz", noisy(make_touch(seed=seed), seed))
    assert main(["thresholds", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("use: --threshold 8")
    row = next(line for line in lines if line.startswith("proposed"))
    assert row.split()[-1] == "3"
