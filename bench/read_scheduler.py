"""Reading only what matters, against reading everything: do features and decisions agree?

`python -m bench.read_scheduler --model build/model.onnx RECORDINGS` plays recordings onto Cody's 32
chips, timed by the bits on the wire, and follows each contact three ways: three buses at 100 Hz
(all of the skin), one bus at 100 Hz that reads the chips near the contact and the rest in turn,
and one bus that reads all of the skin as often as it can (47 Hz). It prints how far the features
of the last two are from those of the first, and how often the decisions agree.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from edge.fake.player import Playback, fake_skin
from edge.model.model import Model
from edge.recording import Recording, find, load
from edge.skin import file as skinfile
from edge.skin.file import SkinFile
from edge.skin.loop import Loop
from edge.skin.wiring import BusSpec
from edge.touch.arm import Chain
from edge.touch.contact import Contact
from edge.touch.features import FEATURES, SAMPLES, feature_vector
from edge.touch.track import ContactTracker

WINDOW_S = 1.2


def one_bus(cody: SkinFile) -> SkinFile:
    """Cody's 32 chips on one bus: eight channels of one mux."""
    chips, channel = [], 0
    for bus in cody.buses:
        chips += [replace(chip, channel=channel + (chip.channel or 0)) for chip in bus.chips]
        channel += 1 + max(chip.channel or 0 for chip in bus.chips)
    return replace(cody, buses=(BusSpec("one bus", tuple(chips)),))


@dataclass(frozen=True)
class Followed:
    """A contact as one way of reading saw it.

    Attributes:
        vector: (3 * samples,) features, or None where no contact was seen.
        onset_s: when it began.
        missed: ticks that the wire could not keep.
    """

    vector: np.ndarray | None
    onset_s: float
    missed: int


def follow(
    file: SkinFile,
    recording: Recording,
    *,
    region: bool = False,
    rate_hz: float = 100.0,
    chain: Chain | None = None,
    window_s: float = WINDOW_S,
    samples: int = SAMPLES,
) -> Followed:
    """The first contact of a recording, read by a skin."""
    reading = replace(file.reading, rate_hz=rate_hz, region_of_interest=region)
    file = replace(file, layout=recording.layout, reading=reading)
    playback = Playback(recording)
    skin = fake_skin(file, playback, timed=True)
    playback.start = skin.clock.now()
    tracker = ContactTracker(recording.layout, chain=chain, horizon_s=window_s)
    contact: Contact | None = None
    with skin:
        loop = Loop(skin, lasts_s=playback.ends, joints=playback if chain else None)
        for frame in loop.frames():
            contact = next(iter(tracker.push(frame)), contact)
            if contact is not None and frame.t - contact.onset_s > window_s + 0.05:
                break
    if contact is None:
        return Followed(None, float("nan"), loop.schedule.missed)
    vector = feature_vector(contact.series(), window_s, samples)
    return Followed(vector, contact.onset_s - playback.start, loop.schedule.missed)


@dataclass(frozen=True)
class Agreement:
    """One way of reading against reading everything.

    Attributes:
        onset_ms: differences of onset, (trials,).
        errors: root mean square difference of each feature over its range in the full reading,
            (trials, features).
        same: decisions that agree, and of how many.
        missed: ticks that the wire could not keep.
    """

    onset_ms: np.ndarray
    errors: np.ndarray
    same: tuple[int, int]
    missed: int


def compare(
    recordings: Sequence[Recording],
    *,
    region: bool,
    rate_hz: float,
    model: Model | None = None,
) -> Agreement:
    """Follow each recording on three buses and on one, and compare."""
    cody = skinfile.load(skinfile.shipped("cody"))
    single = one_bus(cody)
    chain = None if model is None else model.info.chain
    window = WINDOW_S if model is None else model.info.window_s
    onsets, errors, same, decided, missed = [], [], 0, 0, 0
    for recording in recordings:
        full = follow(cody, recording, chain=chain, window_s=window)
        part = follow(
            single, recording, region=region, rate_hz=rate_hz, chain=chain, window_s=window
        )
        if full.vector is None or part.vector is None:
            raise ValueError(f"{recording.meta.get('trial')}: a reading saw no contact")
        onsets.append(1e3 * (part.onset_s - full.onset_s))
        ours = part.vector.reshape(len(FEATURES), -1)
        theirs = full.vector.reshape(len(FEATURES), -1)
        span = np.maximum(theirs.max(axis=1) - theirs.min(axis=1), 1e-9)
        errors.append(np.sqrt(((ours - theirs) ** 2).mean(axis=1)) / span)
        missed += part.missed
        if model is not None:
            a, b = model.decide(full.vector), model.decide(part.vector)
            same += sum(a[task].label == b[task].label for task in a)
            decided += len(a)
    return Agreement(np.array(onsets), np.array(errors), (same, decided), missed)


def table(rows: dict[str, Agreement]) -> str:
    """Markdown."""
    heads = " | ".join(f"{name}, % of range (worst)" for name in FEATURES)
    lines = [
        f"| one bus | {heads} | onset, ms (worst) | decisions that agree | ticks left out |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, row in rows.items():
        cells = [
            f"{100 * np.median(row.errors[:, i]):.2f} ({100 * row.errors[:, i].max():.2f})"
            for i in range(len(FEATURES))
        ]
        worst = row.onset_ms[np.argmax(np.abs(row.onset_ms))]
        onset = f"{np.median(row.onset_ms):+.1f} ({worst:+.1f})"
        agree = f"{row.same[0]} of {row.same[1]}"
        lines.append(f"| {name} | {' | '.join(cells)} | {onset} | {agree} | {row.missed} |")
    return "\n".join(lines)


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--most", type=int, default=100, help="recordings at most")
    parser.add_argument("recordings", nargs="+")
    arguments = parser.parse_args()
    model = Model(arguments.model)
    recordings = [load(path) for path in find(arguments.recordings)[: arguments.most]]
    rows = {
        "near the contact at 100 Hz": compare(recordings, region=True, rate_hz=100.0, model=model),
        "all of the skin at 47 Hz": compare(recordings, region=False, rate_hz=47.0, model=model),
    }
    print(table(rows))


if __name__ == "__main__":
    main()
