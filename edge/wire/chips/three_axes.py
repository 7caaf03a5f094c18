"""A microcontroller that serves frames of three axes: a `block` whose taxels have three
values each.

The highest bit of the identity's bits per taxel says so; firmware of one axis never
sets it. A taxel is three signed numbers of 16 bits: its normal force, and its shear
along the rows (elbow to wrist) and around the columns.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from edge.arrays import Bytes, Counts
from edge.config import ConfigTable
from edge.errors import InputError
from edge.wire.chips.block import THREE_AXES, Block, data_bytes, unpack
from edge.wire.chips.chip import MOST_TAXELS, Chip, ChipSpec, Option, Parsed, Traits

AXES = 3
BITS = 16
ZERO = 1 << 15
"""Added to a signed number, so that raw values are from 0 to 65535 on every chip."""


class ThreeAxisBlock(Block):
    """One microcontroller of three axes."""

    options: ClassVar[Mapping[str, Option]] = {"bits": Option(BITS, (BITS,))}
    rests_at_zero = False
    axes = AXES
    flags = THREE_AXES

    @staticmethod
    def traits(taxels: int, options: Mapping[str, int]) -> Traits:
        """Every signed number of 16 bits may be a taxel's.

        Raises:
            InputError: the frame of so many taxels does not fit into a message.
        """
        if AXES * taxels > MOST_TAXELS:
            raise InputError(
                f"a block of three axes serves at most {MOST_TAXELS // AXES} taxels, "
                f"not {taxels}; use several"
            )
        size = 4 + data_bytes(AXES * taxels, BITS)
        return Traits(size, (1 << BITS) - 1, rest=ZERO)

    @staticmethod
    def parse(data: Bytes, spec: ChipSpec) -> Parsed:
        """Normal values of n microcontrollers; see `Block.parse`."""
        values = axes(data, len(spec.taxels))[:, :, 0]
        return values, np.ones(values.shape, np.bool_)


def axes(data: Bytes, taxels: int) -> Counts:
    """(n, taxels, 3) raw values of n frames (n, bytes): normal, along, around."""
    numbers = unpack(data[:, 2:-2], AXES * taxels, BITS)
    return (numbers ^ ZERO).astype(np.uint16).reshape(len(data), taxels, AXES)


def three_axes(kind: type[Chip], table: ConfigTable) -> type[Chip]:
    """The driver that reads three axes of a kind of chip.

    Raises:
        InputError: the kind has one axis.
    """
    if kind is Block:
        return ThreeAxisBlock
    raise InputError(
        f"{table.key_name('kind')} is {kind.name}, which gives one axis; axes = 3 needs "
        'kind = "block"'
    )
