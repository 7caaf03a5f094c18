"""The kinds of chips that a skin file may name, and the defaults that follow from
them."""

from collections.abc import Sequence

from edge.chips import ad7147, block, mpr121
from edge.chips.chip import ChipKind, ChipSpec, Defaults

KINDS: dict[str, ChipKind] = {
    kind.name: kind for kind in (ad7147.KIND, mpr121.KIND, block.KIND)
}
"""Descriptors by name. A further chip is added here, and nowhere else outside its
module."""


def defaults_of(chips: Sequence[ChipSpec]) -> Defaults:
    """Defaults for the chips of a skin file; for chips that differ, those of no
    kind."""
    first, *rest = (chip.kind.defaults(chip.options) for chip in chips)
    return first if all(defaults == first for defaults in rest) else Defaults()
