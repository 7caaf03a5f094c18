"""A look at recordings before they are written: rows as understood, and contacts."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from edge.record.recording import Recording
from train.data.thresholds import count_felt

ROWS = 5
TAXELS = 6
FEW = 0.5
"""Share of the recordings with a contact below which a reason is given."""


def rows_of(recording: Recording) -> list[str]:
    """The first rows: time, first taxels in counts, joint angles, and the label."""
    counts = recording.frames.reshape(len(recording.t), -1)[:ROWS]
    shown = pd.DataFrame({"time (s)": recording.t[:ROWS]})
    for taxel, column in enumerate(counts.T[:TAXELS], 1):
        shown[f"taxel {taxel}"] = column
    if counts.shape[1] > TAXELS:
        shown["..."] = f"{counts.shape[1]} taxels"
    if recording.joints is not None:
        names = recording.joint_names or range(1, recording.joints.shape[1] + 1)
        for name, angles in zip(names, recording.joints[:ROWS].T, strict=True):
            shown[f"joint {name} (rad)"] = angles
    for task, label in recording.labels.items():
        shown[task] = label
    return list(shown.to_string(index=False).splitlines())


def contacts_in(recordings: Sequence[Recording]) -> str:
    """How many recordings have a contact, and if few, why, and what to type."""
    contacts = [count_felt([r], r.layout.onset) for r in recordings]
    text = f"{sum(contacts)} of {len(recordings)} have a contact"
    if sum(contacts) >= FEW * len(recordings):
        return text
    peaks = [
        int(recording.frames.max())
        for recording, is_felt in zip(recordings, contacts, strict=True)
        if not is_felt
    ]
    return (
        f"{text}, as half of the others stay at or below {np.median(peaks):g} counts: "
        "where they were touched, give --scale for weak values, or --threshold N --onset "
        "N with each later command; `python -m train thresholds DIR` counts contacts at "
        "others"
    )
