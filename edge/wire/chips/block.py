"""A microcontroller that serves whole frames: sequence number, taxels, CRC-16.

| pointer | bytes | register |
|---|---|---|
| 0x00 | 10 | identity: `TAXL`, version 1, bits per taxel (8, 12 or 16), taxels (16 bits), CRC-16 |
| 0x10 | 2 + data + 2 | frame: sequence number (16 bits), taxels, CRC-16 |

docs/block-protocol.md describes the protocol for whoever writes the firmware, and
docs/examples/firmware/ has one.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from edge.arrays import Bytes, Counts
from edge.wire.bus.crc import crc16, sealed
from edge.wire.bus.protocol import Bus, BusFault, Transfer, read, write
from edge.wire.chips.chip import (
    Chip,
    ChipSpec,
    Defaults,
    Option,
    Parsed,
    Script,
    Step,
    Traits,
)

IDENTITY = b"\x00"
FRAME = b"\x10"
MAGIC = b"TAXL\x01"
BITS = (8, 12, 16)
THREE_AXES = 0x80
"""The bit of the identity's bits per taxel that says that a taxel has three values, see
`edge.wire.chips.three_axes`."""
UNCHANGED_FRAMES = 25
"""Readings with one sequence number after which the microcontroller hangs."""
REST = 20946
"""Raw value at rest of a fake chip, where its bits can hold it."""
DEFAULTS = {
    16: Defaults(),
    12: Defaults(drift_counts_per_s=1.25, drift_limit_counts=125),
    8: Defaults(drift_counts_per_s=0.08, drift_limit_counts=8),
}
"""By bits: the drift of 16 bits, scaled to their range."""


def data_bytes(taxels: int, bits: int) -> int:
    """Bytes of the taxels of one frame."""
    return (taxels * bits + 7) // 8


def pack(values: Counts, bits: int) -> bytes:
    """Taxels as bytes on the wire, highest bit first; the inverse of `unpack`.

    Args:
        values: (taxels,), each below 2 ** bits.
        bits: 8, 12 or 16.
    """
    digits = np.unpackbits(values.astype(">u2").view(np.uint8)).reshape(-1, 16)
    return np.packbits(digits[:, 16 - bits :]).tobytes()


def unpack(data: Bytes, taxels: int, bits: int) -> Counts:
    """Taxels (n, taxels) from their bytes (n, data_bytes)."""
    digits = np.zeros((len(data), taxels, 16), dtype=np.uint8)
    packed = np.unpackbits(data, axis=1, count=taxels * bits)
    digits[:, :, 16 - bits :] = packed.reshape(len(data), taxels, bits)
    return np.packbits(digits, axis=2).view(">u2")[:, :, 0].astype(np.uint16)


def identity(taxels: int, bits: int) -> bytes:
    """The identity register of a microcontroller."""
    return sealed(MAGIC + bytes([bits]) + taxels.to_bytes(2, "big"))


def described(identity: bytes) -> str:
    """The taxels of an identity register in words."""
    taxels = int.from_bytes(identity[6:8], "big")
    axes = " on three axes" if identity[5] & THREE_AXES else ""
    return f"{taxels} taxels of {identity[5] & ~THREE_AXES} bits{axes}"


class Block(Chip):
    """One microcontroller.

    >>> chip = Block(bus, 0x28, taxels=384, bits=8)              # doctest: +SKIP
    """

    name = "block"
    axes: ClassVar[int] = 1
    """Numbers of a frame for each taxel."""
    flags: ClassVar[int] = 0
    """Bits of the identity beside the number of bits per taxel."""
    options: ClassVar[Mapping[str, Option]] = {"bits": Option(16, BITS)}
    unchanged_frames = UNCHANGED_FRAMES
    frame_pointer = FRAME
    serial = True
    rests_at_zero = True

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        taxels: int,
        bits: int = 16,
        into: Bytes | None = None,
    ) -> None:
        """Check that the microcontroller serves the taxels of the skin file.

        Args:
            bus: a bus, a mux's channel or a serial port.
            address: 7 bits.
            taxels: number of taxels that it serves.
            bits: of one taxel, 8, 12 or 16.
            into: (4 + data_bytes,) bytes that `read` fills; new ones where None.

        Raises:
            WrongChip: it serves something else.
            BusError: it does not answer.
        """
        size = 4 + data_bytes(self.axes * taxels, bits)
        script = self.script(taxels, {"bits": bits})
        super().__init__(
            bus, address, into=size if into is None else into, script=script
        )

    @classmethod
    def of(cls, bus: Bus, spec: ChipSpec, into: Bytes) -> Self:
        """The driver of a skin's chip, which reads frames into these bytes."""
        bits = spec.option("bits")
        return cls(bus, spec.address, taxels=len(spec.taxels), bits=bits, into=into)

    @classmethod
    def script(cls, taxels: int, options: Mapping[str, int]) -> Script:
        """There are no settings; the identity tells what it serves."""
        step = Step(IDENTITY, identity(taxels, options["bits"] | cls.flags))
        return Script(step, [step])

    @staticmethod
    def traits(taxels: int, options: Mapping[str, int]) -> Traits:
        """Every value of its bits may be a taxel's."""
        bits = options["bits"]
        full = 1 << bits
        defaults = DEFAULTS[bits]
        size = 4 + data_bytes(taxels, bits)
        return Traits(size, full - 1, rest=min(REST, full // 2), defaults=defaults)

    @staticmethod
    def parse(data: Bytes, spec: ChipSpec) -> Parsed:
        """Taxels of n microcontrollers; all are intact, since `read` checks the CRC.

        Args:
            data: (n, 4 + data_bytes) bytes.
            spec: of one of them.

        Returns:
            (n, taxels) values and which of them are intact.
        """
        values = unpack(data[:, 2:-2], len(spec.taxels), spec.option("bits"))
        return values, np.ones(values.shape, np.bool_)

    def ask(self, step: Step) -> bytes:
        """The register at a pointer, whose CRC is right."""
        pointer = write(self.address, step.out)
        transfer = self.bus.prepare(pointer, read(self.address, len(step.answer)))
        self._receive(transfer)
        return transfer.buffer.tobytes()

    def problem(self, step: Step, answer: bytes) -> str:
        """What it serves, and what it should."""
        return f"serves {described(answer)}, not {described(step.answer)}"

    def read(self) -> None:
        """Read all taxels.

        Raises:
            BusError: the transaction failed, or the CRC of the frame is wrong.
        """
        self._receive(self.frame)

    def _receive(self, transfer: Transfer) -> None:
        """Read a register, and again where its CRC is wrong, as a broken transfer."""
        for _ in range(1 + BusFault.retries):
            self.bus.transfer(transfer)
            # The CRC over bytes with their own CRC is 0.
            if crc16(transfer.buffer.tobytes()) == 0:
                return
        raise self.wrong(
            "serves no frames, or damaged ones; check the firmware and the cable"
        )
