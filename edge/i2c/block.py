"""A microcontroller that serves whole frames: sequence number, taxels, CRC-16.

| pointer | bytes | register |
|---|---|---|
| 0x00 | 10 | identity: `TAXL`, version 1, bits per taxel (8, 12 or 16), taxels (16 bits), CRC-16 |
| 0x10 | 2 + data + 2 | frame: sequence number (16 bits), taxels, CRC-16 |

docs/block-protocol.md describes the protocol for whoever writes the firmware, and
examples/firmware/ has one.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from edge.i2c.bus import Bus, fetch, read, write
from edge.i2c.chip import Parsed, wrong_chip

IDENTITY, FRAME = b"\x00", b"\x10"
MAGIC = b"TAXL\x01"
BITS = (8, 12, 16)
MOST_TAXELS = 4000
"""A frame then stays under the 8192 bytes of one message."""


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return crc_hqx(data, 0xFFFF)


def data_bytes(taxels: int, bits: int) -> int:
    """Bytes that the taxels of one frame take."""
    return (taxels * bits + 7) // 8


def pack(values: NDArray[np.uint16], bits: int) -> bytes:
    """Taxels as they travel; the inverse of `unpack`.

    Args:
        values: (taxels,), each below 2 ** bits.
        bits: 8, 12 or 16.
    """
    if bits == 8:
        return values.astype(np.uint8).tobytes()
    if bits == 16:
        return values.astype(">u2").tobytes()
    even = np.zeros(len(values) + len(values) % 2, dtype=np.uint16)
    even[: len(values)] = values
    a, b = even[0::2], even[1::2]
    packed = np.stack([a >> 4, (a & 15) << 4 | b >> 8, b & 255], axis=1).astype(np.uint8)
    return packed.tobytes()[: data_bytes(len(values), 12)]


def unpack(data: NDArray[np.uint8], taxels: int, bits: int) -> NDArray[np.uint16]:
    """Taxels (n, taxels) from their bytes (n, data_bytes)."""
    if bits == 8:
        return data.astype(np.uint16)
    if bits == 16:
        return np.ascontiguousarray(data).view(">u2").astype(np.uint16)
    full = np.zeros((len(data), (taxels + 1) // 2 * 3), dtype=np.uint16)
    full[:, : data.shape[1]] = data
    high, mixed, low = full[:, 0::3], full[:, 1::3], full[:, 2::3]
    out = np.empty((len(data), (taxels + 1) // 2 * 2), dtype=np.uint16)
    out[:, 0::2] = high << 4 | mixed >> 4
    out[:, 1::2] = (mixed & 15) << 8 | low
    return out[:, :taxels]


def sealed(data: bytes) -> bytes:
    """Bytes with their CRC."""
    return data + crc16(data).to_bytes(2, "big")


class Block:
    """One microcontroller.

    >>> chip = Block(bus, 0x28, taxels=384, bits=8)              # doctest: +SKIP
    """

    kind: ClassVar[str] = "block"

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        taxels: int,
        bits: int = 16,
        into: NDArray[np.uint8] | None = None,
    ) -> None:
        """Check that it serves what the skin file says.

        Args:
            bus: a bus or a mux's channel.
            address: its 7-bit address.
            taxels: how many it serves.
            bits: of one taxel, 8, 12 or 16.
            into: (4 + data_bytes,) bytes that `frame` reads into; its own where None.

        Raises:
            WrongChip: it serves something else.
            BusError: it does not answer.
        """
        self.bus, self.address = bus, address
        self.taxels, self.bits = taxels, bits
        self.bytes = 4 + data_bytes(taxels, bits)
        buffer = np.zeros(self.bytes, dtype=np.uint8) if into is None else into
        self.frame = bus.prepare(write(address, FRAME), read(address, buffer))
        self._expected = sealed(MAGIC + bytes([bits]) + taxels.to_bytes(2, "big"))
        self._identity = bus.prepare(write(address, IDENTITY), read(address, 10))
        found = fetch(bus, address, IDENTITY, 10)
        if found != self._expected:
            if found[:5] == MAGIC and found == sealed(found[:8]):
                served = f"serves {int.from_bytes(found[6:8], 'big')} taxels of {found[5]} bits"
                raise wrong_chip(bus, address, f"{served}, not {taxels} of {bits}")
            raise wrong_chip(bus, address, "not a microcontroller that serves frames")

    def parse(self, data: NDArray[np.uint8]) -> Parsed:
        """Taxels whose CRC holds.

        Args:
            data: (n, 4 + data_bytes) bytes.

        Returns:
            (n, taxels) values and which of them are whole: all of a frame or none.
        """
        whole = np.array([[crc16(row.tobytes()) == 0] for row in data])  # a CRC over itself is 0
        values = unpack(data[:, 2:-2], self.taxels, self.bits)
        return values, np.broadcast_to(whole, values.shape)

    def settings(self) -> Iterator[None]:
        """Nothing: the microcontroller knows its own."""
        return iter(())

    def healthy(self) -> bool:
        """Whether it still serves what it did."""
        self.bus.transfer(self._identity)
        return self._identity.buffer.tobytes() == self._expected
