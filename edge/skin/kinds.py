"""The kinds of chips that a skin file may name, and the defaults that follow from them."""

from __future__ import annotations

from collections.abc import Mapping

from edge.i2c import ad7147, block, mpr121
from edge.i2c.chip import ChipKind, Defaults

KINDS: dict[str, ChipKind] = {kind.name: kind for kind in (ad7147.KIND, mpr121.KIND, block.KIND)}
"""Descriptors by name. A further chip is added here, and nowhere else outside its module."""


def defaults_of(raw: Mapping[str, object]) -> Defaults:
    """Defaults for the chips of a skin file; for chips that differ, those of no kind.

    Args:
        raw: the file's tables, unchecked.
    """
    defaults = []
    buses = raw.get("bus")
    for bus in buses if isinstance(buses, list) else []:
        chips = bus.get("chips") if isinstance(bus, Mapping) else None
        for chip in chips if isinstance(chips, list) else []:
            if not isinstance(chip, Mapping):
                continue
            merged = {**bus, **chip}  # a key of a bus holds for all its chips
            name = merged.get("kind")
            kind = KINDS.get(name) if isinstance(name, str) else None
            if kind is not None:
                given = {key: merged.get(key, opt.default) for key, opt in kind.options.items()}
                if all(isinstance(value, int) for value in given.values()):
                    defaults.append(kind.defaults(given))
    return defaults[0] if defaults and all(d == defaults[0] for d in defaults) else Defaults()
