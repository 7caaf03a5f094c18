"""Thresholds from noise, and lower ones where touches are missed."""

from dataclasses import replace

import numpy as np

from train.data.parts import part
from train.data.thresholds import count_contacts, proposed


def noisy(recording, seed):
    """With noise of up to 40 counts on every taxel."""
    noise = (
        np.random.default_rng(seed)
        .integers(0, 41, recording.frames.shape)
        .astype(np.uint16)
    )
    return replace(recording, frames=np.maximum(recording.frames, noise))


def weaker(recording, share, **skin):
    """With a share of its force, and other thresholds; an entry of None is taken
    out."""
    skin = {**recording.meta["skin"], **skin}
    present = {key: value for key, value in skin.items() if value is not None}
    frames = (recording.frames * share).astype(np.uint16)
    return replace(recording, frames=frames, meta={**recording.meta, "skin": present})


def test_the_proposal_lies_above_the_noise_and_finds_every_contact(make_touch):
    trials = [noisy(make_touch(seed=seed), seed) for seed in range(6)]
    proposal = proposed(trials)
    assert 70 <= proposal.threshold <= 80
    assert proposal.onset == round(1.5 * proposal.threshold)
    assert count_contacts(trials, proposal.threshold, proposal.onset) == (6, 6)
    assert proposal.source == "the noise before contact"
    assert count_contacts(trials, 60000, 60000) == (0, 0)


def labelled(recording):
    meta = {**recording.meta, "labels": {"object": "box"}}
    return replace(recording, meta=meta)


def begun(make_touch, seed):
    """A touch whose recording begins in its middle."""
    touch = labelled(noisy(make_touch(seed=seed), seed))
    return part(touch, slice(len(touch.t) // 2, None))


def test_recordings_that_begin_in_contact_give_no_noise_and_are_counted(make_touch):
    quiet = [labelled(noisy(make_touch(seed=seed), seed)) for seed in range(12)]
    late = [begun(make_touch, seed) for seed in range(20, 28)]
    proposal = proposed(quiet + late)
    assert 70 <= proposal.threshold <= 80
    assert "8 of 20 begin in contact and give none" in proposal.source


def test_without_an_untouched_part_the_quietest_taxels_give_the_threshold(make_touch):
    late = [begun(make_touch, seed) for seed in range(8)]
    proposal = proposed(late)
    assert 10 <= proposal.threshold <= 40
    assert "no recording has a part without contact" in proposal.source
    assert count_contacts(late, proposal.threshold, proposal.onset)[0] == 8


def test_where_every_taxel_is_pressed_throughout_the_threshold_is_0(make_touch):
    rng = np.random.default_rng(0)
    pressed = []
    for seed in range(6):
        touch = labelled(make_touch(seed=seed))
        frames = rng.integers(900, 1000, touch.frames.shape).astype(np.uint16)
        pressed.append(replace(touch, frames=frames))
    proposal = proposed(pressed)
    assert count_contacts(pressed, proposal.threshold, proposal.onset)[0] == 6
    assert "no recording has a part without contact" in proposal.source


def test_a_proposal_that_misses_touches_is_as_high_as_the_noise(make_touch):
    trials = []
    for seed in range(4):
        touch = make_touch(seed=seed)
        soft = weaker(touch, 70.0 / touch.frames.max())
        trials.append(noisy(labelled(soft), seed))
    weak = proposed(trials)
    assert weak.threshold == 40
    assert weak.onset == 60  # the touch peaks at 70
    strong = [noisy(make_touch(seed=seed), seed) for seed in range(4)]
    assert proposed(strong).threshold == 80
