"""AD7147-1: 12 capacitive taxels of 16 bits.

Registers have 16 bits behind a 16-bit pointer, both big-endian, with auto-increment
(AD7147 data sheet). The start sequence is that of robotology/icub-firmware and of
Linux's driver ad714x.
"""

from collections.abc import Mapping
from itertools import cycle

import numpy as np

from edge.arrays import Bytes
from edge.wire.bus.protocol import Bus, read, write
from edge.wire.chips.chip import Chip, ChipSpec, Defaults, Parsed, Script, Step, Traits

STAGES = 12
FRAME_BYTES = 2 * STAGES + 2
"""Bytes of the results and of the identity, which follows them."""
IDENTIFIED_EVERY = 16
"""The identity is read in every so many frames."""
STAGE_REGISTERS = 8
SYSTEM = 0x00
STATUS = 0x08
RESULTS = 0x0B
DEVICE_ID = 0x17
IDENTITY = 0x147
"""Of the device id; the last digit is the chip's revision."""
STAGE_BANK = 0x80
REST = 20946
"""Cody's real skin rests there."""
REFRESH_S = 0.009216
"""Time of a conversion of 12 stages at a decimation of 64; slower ones miss 100 Hz."""
WRITTEN_AT_ONCE = 3 * STAGE_REGISTERS
"""Some adapters carry at most 61 bytes a transfer (CP2112)."""
DETECTION = (0x2626, 1600, 1600, 1600, 1600)
"""Sensitivity and offsets of the chip's own touch detection, as in Linux's board files.
No result depends on them, but power-up leaves them undefined."""

Row = tuple[int, tuple[int, ...]]
"""First register and the values from there on."""


def stage_bank(stage: int) -> tuple[int, ...]:
    """The eight registers of a stage: its own input on the positive side, no offset.

    >>> [hex(value) for value in stage_bank(7)[:3]]
    ['0xffff', '0x1ffe', '0x0']
    """
    if stage < 7:
        connection = (0xFFFF ^ (1 << 2 * stage), 0x1FFF)
    else:
        connection = (0xFFFF, 0x1FFF ^ (1 << 2 * (stage - 7)))
    return (*connection, 0, *DETECTION)


BANKS = sum(map(stage_bank, range(STAGES)), ())
"""The registers of all stages, from `STAGE_BANK` on."""
CONNECTIONS = np.array(BANKS).reshape(STAGES, STAGE_REGISTERS)[:, :3]
"""(12, 3) registers that connect inputs to each stage."""
SYSTEM_ROW: Row = (SYSTEM, (0x02B0, 0x0FFF, 0, 0, 0, 0, 0, 0x0400))
"""PWR_CONTROL (full power, 12 stages, decimation of 64), calibration of all stages, and
ambient compensation and interrupts, all off."""


def rows(step: int, length: int) -> list[Row]:
    """Rows of `length` registers, one every `step` registers of all stages, and the
    system row."""
    starts = range(0, len(BANKS), step)
    return [*((STAGE_BANK + i, BANKS[i : i + length]) for i in starts), SYSTEM_ROW]


START_ROWS = rows(WRITTEN_AT_ONCE, WRITTEN_AT_ONCE)
"""The rows to write, in order."""
CHECK_ROWS = rows(STAGE_REGISTERS, CONNECTIONS.shape[1])
"""The rows to read back: the connections of each stage, and last the system registers.
A reset changes each of them, so that any one row tells a chip that has lost its
settings."""


def words(values: tuple[int, ...]) -> bytes:
    """Registers as bytes on the wire."""
    return np.array(values, ">u2").tobytes()


CHECKS = [
    Step(
        words((register,)),
        words(values),
        problem=f"register {register:#04x} of the AD7147 does not keep what is written",
    )
    for register, values in CHECK_ROWS
]
SCRIPT = Script(
    Step(
        words((DEVICE_ID,)),
        words((IDENTITY << 4,)),
        words((0xFFF0,)),
        "not an AD7147: its identity reads {:#06x}, not 0x147x",
    ),
    CHECKS,
    [
        *(Step(words((register, *values))) for register, values in START_ROWS),
        Step(words((STATUS,)), bytes(6), bytes(6)),
        *CHECKS,
    ],
)
"""All rows are written, the status registers read, which clears them, and the rows read
back."""


class AD7147(Chip):
    """One AD7147-1.

    >>> chip = AD7147(bus, 0x2C)                                 # doctest: +SKIP
    >>> list(chip.settings()); chip.read()                       # doctest: +SKIP
    """

    name = "ad7147"
    addresses = range(0x2C, 0x30)
    stages = STAGES
    # Our choice: the middle half of 16 bits, in which `REST` lies. Without an offset of
    # its own, a taxel rests where its wiring puts it.
    usual_rest = (0x4000, 0xC000)
    fixed = SCRIPT
    frame_pointer = words((RESULTS,))

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        into: Bytes | int = FRAME_BYTES,
    ) -> None:
        """Identify the chip.

        Args:
            bus: a bus or a mux's channel.
            address: 0x2C to 0x2F.
            into: (26,) bytes that `read` fills; new ones where it is a number.

        Raises:
            WrongChip: the identity register does not read 0x147x.
            BusError: the chip does not answer.
        """
        super().__init__(bus, address, into=into)
        results = read(address, self.frame.buffer[:-2])
        bare = bus.prepare(write(address, self.frame_pointer), results)
        self._frames = cycle([self.frame] + [bare] * (IDENTIFIED_EVERY - 1))

    @staticmethod
    def traits(taxels: int, options: Mapping[str, int]) -> Traits:
        """A word of 16 bits for each stage; 0xFFFF is the end of its range."""
        defaults = Defaults(threshold_counts=40, onset_counts=60)
        return Traits(FRAME_BYTES, highest=0xFFFE, rest=REST, defaults=defaults)

    @staticmethod
    def parse(data: Bytes, spec: ChipSpec) -> Parsed:
        """12 big-endian words a chip.

        No converting stage reads 0: a chip without settings serves it, or converts stage 0
        alone. Words of 0xFFFF up to the end of a frame come from a bus that nothing drives
        any more; the word before them is damaged too where it ends in 0xFF. A chip with
        another identity gives no value.

        Args:
            data: (n, 26) bytes.

        Returns:
            (n, 12) values and which of them are intact.
        """
        registers = data.view(">u2").astype(np.uint16)
        values = registers[:, :-1]
        intact = (values != 0) & (registers[:, -1:] >> 4 == IDENTITY)
        intact[:, 0] &= intact[:, 1:].any(axis=1)
        for row in np.flatnonzero(values[:, -1] == 0xFFFF).tolist():
            driven = np.flatnonzero(data[row, :-2] != 0xFF)
            intact[row, (int(driven[-1]) + 1 if driven.size else 0) // 2 :] = False
        return values, intact

    def read(self) -> None:
        """Read all taxels, now and then with the identity, and once more where the last
        byte is 0xFF.

        Such a byte may be a value, or a transfer that broke off before it; the words
        carry no check that could tell. A burst during which a conversion ends mixes
        words of two conversions, each of them a value of its own. Reading the status
        first would not prevent that, since a conversion may end after it. That a single
        word is never mixed is assumed; the data sheet does not say.
        """
        transfer = next(self._frames)
        self.bus.transfer(transfer)
        if transfer.buffer[-1] == 0xFF:
            self.bus.transfer(transfer)
