"""Parts of a recording."""

from dataclasses import replace
from typing import Any

from edge.record.recording import Recording


def part(recording: Recording, frames: slice, **changes: Any) -> Recording:
    """The recording of some of its frames, with changes of its other fields."""
    fields = ["t", "frames", "joints", "shear"]
    if recording.valid is not None and recording.valid.ndim == 3:
        fields.append("valid")
    values = {name: getattr(recording, name) for name in fields}
    arrays = {name: v[frames] for name, v in values.items() if v is not None}
    return replace(recording, **arrays, **changes)
