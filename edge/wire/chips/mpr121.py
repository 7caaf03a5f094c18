"""MPR121: 12 capacitive taxels of 10 bits; a touch lowers the value.

Registers have 8 bits behind an 8-bit pointer, with auto-increment. Most take a write
only while the chip is stopped (MPR121 data sheet; application note AN3944 for the
filter).
"""

from collections.abc import Mapping

import numpy as np

from edge.arrays import Bytes
from edge.wire.bus.protocol import Bus
from edge.wire.chips.chip import Chip, ChipSpec, Defaults, Parsed, Script, Step, Traits

ELECTRODES = 12
TOUCH_HIGH = 0x01
RESULTS = 0x04
FILTER = 0x2B
THRESHOLDS = 0x41
CONFIG1 = 0x5C
CONFIG2 = 0x5D
ECR = 0x5E
RESET = 0x80
RESET_KEY = 0x63
RESET_CONFIG2 = 0x24
RESET_WAIT_S = 0.001
RUNNING = 0x8F
"""ECR: baseline from the first reading, twelve electrodes."""
OVER_CURRENT = 0x80
"""Bit of `TOUCH_HIGH`: the current at pin REXT is too high. The data read 0 and ECR
stays 0."""
SATURATED = 1023
SETTINGS: tuple[tuple[int, tuple[int, ...]], ...] = (
    (THRESHOLDS, (12, 6) * ELECTRODES),
    (FILTER, (0x01, 0x01, 0x0E, 0x00, 0x01, 0x05, 0x01, 0x00, 0x00, 0x00, 0x00)),
    (CONFIG1, (0x10, 0x20)),
)
"""(first register, values) to write while stopped: touch and release thresholds;
baseline filter; charge current 16 uA, charge time 0.5 us and 4 samples each 1 ms."""
SET_CONFIG2 = SETTINGS[-1][1][1]


def check(register: int, values: tuple[int, ...], otherwise: str) -> Step:
    """A step that reads registers back."""
    problem = f"register {register:#04x} of the MPR121 {otherwise}"
    return Step(bytes([register]), bytes(values), problem=problem)


RUNS = Step(
    bytes([CONFIG2]),
    bytes([SET_CONFIG2, RUNNING]),
    problem="loses its settings; check its power",
)
"""CONFIG2 and ECR are as they were set; a reset changes both, over-current ECR."""
SCRIPT = Script(
    Step(
        bytes([CONFIG2]),
        bytes([SET_CONFIG2]),
        bytes([0xFF ^ SET_CONFIG2 ^ RESET_CONFIG2]),
        "not an MPR121: register 0x5d reads {:#04x}, not 0x24 or 0x20",
    ),
    [RUNS],
    [
        Step(bytes([RESET, RESET_KEY]), wait_s=RESET_WAIT_S),
        Step(bytes([ECR, 0])),
        check(CONFIG2, (RESET_CONFIG2,), "does not come out of reset"),
        *(Step(bytes([register, *values])) for register, values in SETTINGS),
        *(check(*row, "does not keep what is written") for row in SETTINGS),
        Step(bytes([ECR, RUNNING])),
        Step(
            bytes([TOUCH_HIGH]),
            b"\0",
            bytes([OVER_CURRENT]),
            "reports over-current; check the resistor at its pin REXT (75 kOhm)",
        ),
        RUNS,
    ],
)
"""It has no identity register: CONFIG2 holds our value where it runs, and its own after
a reset. All is written while it is stopped, and read back."""


class MPR121(Chip):
    """One MPR121.

    >>> chip = MPR121(bus, 0x5A)                                 # doctest: +SKIP
    >>> list(chip.settings()); chip.read()                       # doctest: +SKIP
    """

    name = "mpr121"
    addresses = range(0x5A, 0x5E)
    stages = ELECTRODES
    # The charging source is linear from 0.7 V to VDD - 0.7 V (data sheet); at 3.3 V, in
    # steps of VDD / 1024.
    usual_rest = (217, 806)
    fixed = SCRIPT
    frame_pointer = bytes([RESULTS])

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        into: Bytes | int = 2 * ELECTRODES,
    ) -> None:
        """Identify the chip as far as that is possible without a reset.

        Args:
            bus: a bus or a mux's channel.
            address: 0x5A to 0x5D.
            into: (24,) bytes that `read` fills; new ones where it is a number.

        Raises:
            WrongChip: CONFIG2 holds something else.
            BusError: the chip does not answer.
        """
        super().__init__(bus, address, into=into)

    @staticmethod
    def traits(taxels: int, options: Mapping[str, int]) -> Traits:
        """Of the 10 bits of an electrode, a touch takes some tens of counts."""
        defaults = Defaults(-1, 8, 16, 3, 1.0, 200)
        return Traits(2 * ELECTRODES, SATURATED - 1, rest=600, defaults=defaults)

    @staticmethod
    def parse(data: Bytes, spec: ChipSpec) -> Parsed:
        """12 words a chip, low byte first, 10 bits used.

        A word with one of the upper six bits set is damaged. A stopped chip serves 0, and
        1023 is the end of the range: neither is a value.

        Args:
            data: (n, 24) bytes.

        Returns:
            (n, 12) values and which of them are intact.
        """
        values = data.view("<u2").astype(np.uint16)
        return values, (values != 0) & (values < SATURATED)
