"""The kinds of chips that a skin file may name, and what the file need not say about each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

KINDS = {
    "ad7147": "a capacitance-to-digital converter",
    "mpr121": "a capacitive touch controller",
    "block": "a microcontroller that serves frames",
}


@dataclass(frozen=True)
class Usual:
    """What holds for a kind of chip unless the skin file says otherwise.

    Attributes:
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        threshold_counts, onset_counts: see `edge.touch.layout.SkinLayout`; 0 where the kind does
            not tell them.
        dead_band_counts, drift_counts_per_s, drift_limit_counts: see `edge.skin.file.Signal`.
    """

    sign: int = 1
    threshold_counts: int = 0
    onset_counts: int = 0
    dead_band_counts: int = 0
    drift_counts_per_s: float = 20.0
    drift_limit_counts: int = 2000


USUAL = {
    ("ad7147", 16): Usual(threshold_counts=40, onset_counts=60),
    # Its values have 10 bits, of which a touch takes some tens.
    ("mpr121", 16): Usual(-1, 8, 16, 3, drift_counts_per_s=1.0, drift_limit_counts=200),
    # The drift of 16 bits, scaled to their range.
    ("block", 12): Usual(drift_counts_per_s=1.25, drift_limit_counts=125),
    ("block", 8): Usual(drift_counts_per_s=0.08, drift_limit_counts=8),
}
"""Defaults by kind and bits per taxel."""


def usual_of(kind: str, bits: int) -> Usual:
    """What holds for a kind of chip."""
    return USUAL.get((kind, bits), Usual())


def usual(raw: Mapping[str, object]) -> Usual:
    """What holds for the chips of a skin file; where they differ, what holds for any.

    Args:
        raw: the file's tables, unchecked.
    """
    found = set()
    entries = raw.get("bus")
    for entry in entries if isinstance(entries, list) else []:
        chips = entry.get("chips") if isinstance(entry, Mapping) else None
        for chip in chips if isinstance(chips, list) else []:
            if isinstance(chip, Mapping):
                merged = {**entry, **chip}  # what a bus says holds for all its chips
                kind, bits = merged.get("kind"), merged.get("bits", 16)
                if isinstance(kind, str) and isinstance(bits, int):
                    found.add((kind, bits))
    return usual_of(*found.pop()) if len(found) == 1 else Usual()
