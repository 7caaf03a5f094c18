"""A fake skin: a recording or any other scene, played onto the registers of fake
chips."""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Counts, Floats, Integers
from edge.errors import InputError
from edge.interrupt import delayed
from edge.record.recording import Recording, load
from edge.touch.layout import SkinLayout
from edge.wire.bus.serial_bus import serial_bits
from edge.wire.chips import kinds
from edge.wire.chips.chip import MOST_TAXELS, UNUSED, ChipSpec
from edge.wire.chips.three_axes import ZERO, ThreeAxisBlock
from edge.wire.fake.bus import FakeBus, FakeChip, FakeTCA9548A, Sense, wire_bits
from edge.wire.fake.clock import TIME_ROUNDING_S, PacedClock, VirtualClock
from edge.wire.skin import file as skinfile
from edge.wire.skin.file import SkinFile, TaxelCalibration
from edge.wire.skin.skin import Skin
from edge.wire.skin.wiring import BusSpec

FRAMES = 100
"""Frames whose bits are counted together, as some transactions are rare."""
NOISE_FRAMES = 97
NOISE_STEP_S = 0.001
"""The noise is this many frames, repeated, each of which lasts for this many
seconds."""
PAUSES = 2.0
"""Times `release_s` that a looped recording pauses before it starts again."""
NOISE_COUNTS = 0.7
"""Noise of the fake chips of a skin file, as a standard deviation. A skin that is
calibrated with noise and then played without is taken for frozen."""
Scene = Callable[[float], Counts]
"""Counts above baseline (rows, cols) at a time in seconds since the start."""


class Playback:
    """A recording as a scene: each frame lasts until the next.

    >>> recording = Recording(np.array([0.0, 0.01]), np.zeros((2, 4, 4), np.uint16))
    >>> Playback(recording).ends
    0.02
    """

    def __init__(self, recording: Recording, *, loop: bool = False) -> None:
        """Play it once, or over and over.

        Args:
            recording: the contact that the skin feels.
            loop: start again after its end, and after a pause without a touch that
                ends every contact.
        """
        self.recording = recording
        self._frames = list(recording)
        self._t = recording.t - recording.t[0]
        steps = np.diff(self._t)
        last = float(np.median(steps)) if steps.size else 0.01
        self._length = float(self._t[-1]) + last
        if loop:
            last_frame = self._frames[-1]
            counts = np.zeros_like(last_frame.counts)
            shear = last_frame.shear
            untouched = None if shear is None else np.zeros_like(shear)
            self._frames.append(replace(last_frame, counts=counts, shear=untouched))
            self._t = np.append(self._t, self._length)
            self._length += PAUSES * recording.layout.release_s
        self.ends = math.inf if loop else self._length
        """Length in seconds; infinity where it loops."""
        self._last = -1
        """The last frame that was looked at for an onset."""
        self.start = 0.0
        """Start of the playback on the skin's clock."""

    def _index(self, t: float) -> int:
        t -= self.start
        if self.ends == math.inf:
            t %= self._length
        after = np.searchsorted(self._t, t + TIME_ROUNDING_S, side="right")
        return max(0, int(after) - 1)

    def __call__(self, t: float) -> Counts:
        """Counts above baseline (rows, cols) at `t`."""
        return self._frames[self._index(t)].counts

    def shear(self, t: float) -> NDArray[np.int16] | None:
        """Shear (rows, cols, 2) at `t`; None where the recording has none."""
        return self._frames[self._index(t)].shear

    def at(self, t: float) -> Floats | None:
        """Joint angles (dof,) at `t`; None where the recording has none."""
        return self._frames[self._index(t)].joints

    def began(self, t: float) -> bool:
        """Whether a touch has begun since the last call: with the first frame where the
        recording has no onset of its own."""
        index = self._index(t)
        frames = self._frames[self._last + 1 : index + 1]
        is_first = self._last < 0 and not self.recording.onsets_s
        self._last = index
        return is_first or any(frame.onset for frame in frames)


def calibrated(file: SkinFile, noise_counts: float = 0.0) -> SkinFile:
    """The file with its calibration, or with that of fake chips with this noise."""
    calibration = file.calibration
    if calibration is None:
        baseline = np.zeros(file.layout.shape, dtype=np.uint16)
        for chip in file.chips:
            baseline.flat[chip.served] = chip.traits.rest
        calibration = TaxelCalibration(baseline, np.full(baseline.shape, noise_counts))
    if file.layout.axes and calibration.shear_baseline is None:
        shape = *file.layout.shape, 2
        calibration = replace(
            calibration,
            shear_baseline=np.full(shape, ZERO, dtype=np.uint16),
            shear_noise=np.full(shape, noise_counts),
        )
    return replace(file, calibration=calibration)


def fake_buses(
    file: SkinFile,
    scene: Scene,
    clock: VirtualClock,
    *,
    timed: bool = False,
    noise_counts: float = 0.0,
    seed: int = 0,
    make: Callable[..., FakeBus] = FakeBus,
) -> list[FakeBus]:
    """Fake chips on fake buses, as the skin's file lays them out.

    Args:
        file: the wiring; the chips rest at its calibration, if it has one.
        scene: the counts that the chips feel.
        clock: shared by the buses.
        timed: the clock advances with the bits on the wire, and conversions take their
            time.
        noise_counts: standard deviation of the noise on raw values.
        seed: of the noise, and of the registers that power-up leaves undefined.
        make: makes a bus.
    """
    calibration = calibrated(file).calibration
    assert calibration is not None
    buses = []
    for b, spec in enumerate(file.buses):
        bits = wire_bits
        if spec.serial:
            bits = serial_bits
        bus = make(
            spec.device,
            clock=clock,
            clock_hz=spec.clock_hz,
            timed=timed,
            timeout_s=file.reading.timeout_s,
            count=bits,
        )
        shape = NOISE_FRAMES if noise_counts else 1, calibration.baseline.size
        with delayed():  # numpy imports its generators at their first use
            normal = np.random.default_rng([seed, b]).standard_normal(shape)
        noise = np.rint(noise_counts * normal).astype(np.int64)
        for c, chip in enumerate(spec.chips):
            power_up = random.Random(f"power-up/{seed}/{b}/{c}")
            sense = _sense(chip, scene, calibration, noise)
            fake: type[FakeChip] = kinds.load(kinds.KINDS[chip.kind.name].model)
            model = fake.of(chip, sense, timed=timed, power_up=power_up)
            chips = bus.chips
            if chip.mux is not None and chip.channel is not None:
                mux = chips.setdefault(chip.mux, FakeTCA9548A())
                assert isinstance(mux, FakeTCA9548A)
                chips = mux.channels[chip.channel]
            chips[chip.address] = model
        buses.append(bus)
    return buses


def _sense(
    chip: ChipSpec,
    scene: Scene,
    calibration: TaxelCalibration,
    noise: Integers,
) -> Sense:
    """The function that gives a chip its raw values: rest values, and the scene with
    its sign and noise. A stage without a taxel rests."""
    taxels = np.array(chip.taxels)
    wired = taxels != UNUSED
    rest = calibration.baseline.ravel()[taxels]
    at_rest = np.where(wired, rest, chip.traits.rest).astype(np.int64)

    def noise_at(t: float, shift: int = 0) -> Integers:
        step = int((t + TIME_ROUNDING_S) / NOISE_STEP_S)
        return np.asarray(noise[(step + shift) % len(noise)][taxels])

    def normal(t: float) -> Counts:
        counts = scene(t).reshape(-1)[taxels].astype(np.int64)
        raw = at_rest + wired * (chip.sign * counts + noise_at(t))
        return np.asarray(np.clip(raw, 1, chip.traits.highest), dtype=np.uint16)

    if calibration.shear_baseline is None:
        return normal
    shear_rest = calibration.shear_baseline.reshape(-1, 2)[taxels].astype(np.int64)
    shear_of = getattr(scene, "shear", lambda t: None)

    def three_axes(t: float) -> Counts:
        # Other rows of the noise than the normal axis has.
        raw = shear_rest + np.column_stack([noise_at(t, 31), noise_at(t, 62)])
        shear = shear_of(t)
        if shear is not None:
            raw += shear.reshape(-1, 2)[taxels]
        three = np.column_stack([normal(t), np.clip(raw, 0, chip.traits.highest)])
        return three.reshape(-1).astype(np.uint16)

    return three_axes


def fake_skin(
    file: SkinFile,
    scene: Scene,
    *,
    clock: VirtualClock | None = None,
    timed: bool = False,
    noise_counts: float = 0.0,
) -> Skin:
    """A started skin over fake buses; see `fake_buses`."""
    clock = clock or VirtualClock()
    file = calibrated(file, noise_counts)
    buses = fake_buses(file, scene, clock, timed=timed, noise_counts=noise_counts)
    skin = Skin(file, buses, clock=clock)
    skin.start()
    return skin


def still(file: SkinFile) -> Skin:
    """A fake skin without contact."""
    silence = np.zeros(file.layout.shape, dtype=np.uint16)
    return fake_skin(file, lambda t: silence)


def play(
    file: SkinFile,
    recording: Recording,
    *,
    loop: bool = False,
    **options: Any,
) -> tuple[Skin, Playback]:
    """A fake skin that feels a recording, with further options of `fake_skin`.

    Raises:
        InputError: the recording's shape is not the skin's.
    """
    if recording.frames.shape[1:] != file.layout.shape:
        rows, cols = recording.frames.shape[1:]
        raise InputError(
            f"the recording has {rows} x {cols} taxels, the skin {file.name!r} "
            f"{file.layout.rows} x {file.layout.cols}; name its own skin file"
        )
    scene = Playback(recording, loop=loop)
    skin = fake_skin(file, scene, **options)
    scene.start = skin.clock.now()
    return skin, scene


def play_file(
    path: str,
    file: SkinFile | None,
    *,
    joint_names: Sequence[str] | None = None,
    loop: bool = False,
    real_time: bool = False,
) -> tuple[Skin, Playback]:
    """A fake skin that feels the recording in a file.

    Args:
        path: of the recording.
        file: the skin's; None chooses chips that suit the recording, without noise.
        joint_names: the joints whose angles are wanted, in their order.
        loop: see `Playback`.
        real_time: play it at its original speed.

    Raises:
        InputError: the recording cannot be used, or its shape is not the skin's.
    """
    recording = load(path)
    noise_counts = NOISE_COUNTS
    if joint_names is not None:
        recording = recording.for_joints(joint_names, path)
    if file is None:
        # Nobody calibrates, and the chips serve the recording as it is.
        file = skin_file(recording.layout)
        noise_counts = 0.0
    clock = PacedClock() if real_time else VirtualClock()
    return play(file, recording, loop=loop, clock=clock, noise_counts=noise_counts)


def frame_bits(file: SkinFile, overhead_s: float = 0.0) -> list[float]:
    """Bits on the wire of each bus for a frame, as a mean over some, counted while the
    drivers send them.

    The software's time of each transaction counts as the bits that the wire would carry
    in it.
    """
    # Fake chips make no noise, so that a calibrated one would count as frozen.
    with still(replace(file, calibration=None)) as skin:
        buses = [
            reader.bus for reader in skin.readers if isinstance(reader.bus, FakeBus)
        ]
        for bus in buses:
            bus.bits = bus.transactions = 0
        for _ in range(FRAMES):
            skin.read()
        return [
            (bus.bits + bus.transactions * overhead_s * bus.clock_hz) / FRAMES
            for bus in buses
        ]


def frame_rate(file: SkinFile, overhead_s: float = 0.0) -> float:
    """Frames a second that the skin's buses carry side by side, with the software's time
    of each transaction."""
    bits = frame_bits(file, overhead_s)
    clocks = [bus.clock_hz for bus in file.buses]
    return 1.0 / max(count / hz for count, hz in zip(bits, clocks, strict=True))


def skin_file(layout: SkinLayout) -> SkinFile:
    """Fake wiring for a skin that has only a layout: Cody's chips where its shape is
    Cody's.

    Else microcontrollers that serve 16-bit frames, one for each 4000 values.
    """
    cody = skinfile.load(skinfile.shipped("cody"))
    if layout.shape == cody.layout.shape and not layout.axes:
        return replace(cody, name="fake", layout=layout)
    kind = kinds.driver("block")
    if layout.axes:
        kind = ThreeAxisBlock
    most = MOST_TAXELS // (layout.axes or 1)
    taxels = range(layout.rows * layout.cols)
    chips = tuple(
        ChipSpec(kind, 0x08 + i, tuple(taxels[first : first + most]))
        for i, first in enumerate(taxels[::most])
    )
    return SkinFile("fake", layout, (BusSpec("fake", chips, clock_hz=1_000_000),))
