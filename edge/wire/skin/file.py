"""`skin.toml`: the taxel of each chip stage, and the meaning of its counts."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

import numpy as np

from edge.arrays import Booleans, Counts, Floats
from edge.config import ConfigTable, limited, parse_toml
from edge.errors import InputError
from edge.files import read_text
from edge.touch.layout import SkinLayout
from edge.wire.chips.chip import ChipSpec, Defaults
from edge.wire.skin.wiring import BusSpec, read_buses, taxel_at


@dataclass(frozen=True)
class Signal:
    """From raw values to counts above baseline.

    Attributes:
        dead_band_sigma: counts under this many standard deviations of the noise become
            0.
        dead_band_counts: counts under this become 0 too.
        drift_counts_per_s: how fast the baseline follows while nothing touches.
        drift_limit_counts: how far from the calibration it may move.
        settle_s: how long after a contact it stays frozen.
        saturation_counts: no touch takes a taxel further from its baseline; a value
            beyond it is a fault of the wire.
        dead: broken taxels, (row, col).
    """

    dead_band_sigma: float = limited(6.0, low=0.0, high=100.0)
    dead_band_counts: int = limited(0, allowed=range(65536))
    drift_counts_per_s: float = limited(20.0, low=0.0, high=65535.0)
    drift_limit_counts: int = limited(2000, allowed=range(65536))
    settle_s: float = limited(0.5, low=0.0, high=60.0)
    saturation_counts: int = limited(65535, allowed=range(1, 65536))
    dead: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Reading:
    """How to read the skin.

    Attributes:
        rate_hz: of frames.
        timeout_s: what a hung transfer costs; adapters round it up to 10 ms.
        verify_mux: read a mux's control byte back after each selection.
        recheck_frames: number of frames between two checks of a chip's settings on each
            bus.
        stuck_frames: a chip whose bytes do not change for this many frames, or for as
            few as its noise proves, is invalid, if it made noise during calibration.
    """

    rate_hz: float = limited(100.0, low=0.1, high=10_000.0)
    timeout_s: float = limited(0.02, low=0.001, high=10.0)
    verify_mux: bool = True
    recheck_frames: int = limited(4, allowed=range(1, 100_001))
    stuck_frames: int = limited(100, allowed=range(2, 1_000_001))


@dataclass(frozen=True)
class TaxelCalibration:
    """Rest values and noise as `edge-classify calibrate` measured them.

    Attributes:
        baseline: (rows, cols) raw counts, rounded means; 0 where a taxel could not be
            read.
        noise: (rows, cols) raw counts, standard deviations.
        shear_baseline, shear_noise: (rows, cols, 2) likewise of both tangential axes;
            None on a skin of one axis.
    """

    baseline: Counts
    noise: Floats
    shear_baseline: Counts | None = None
    shear_noise: Floats | None = None


@dataclass(frozen=True)
class SkinFile:
    """A skin as its file describes it."""

    name: str
    layout: SkinLayout
    buses: tuple[BusSpec, ...]
    signal: Signal = Signal()
    reading: Reading = Reading()
    calibration: TaxelCalibration | None = None
    path: str = "skin"
    labels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """{task: the labels that a person may choose from}."""

    def __post_init__(self) -> None:
        """Refuse a skin of which nothing works."""
        if not self.working.any():
            raise InputError(f"{self.path}: all taxels that have a chip are dead")

    @property
    def chips(self) -> list[ChipSpec]:
        """All chips, bus by bus."""
        return [chip for bus in self.buses for chip in bus.chips]

    @property
    def served(self) -> list[int]:
        """The flat indices of the taxels that have a chip."""
        return [taxel for chip in self.chips for taxel in chip.served]

    @property
    def working(self) -> Booleans:
        """(rows, cols), True on the taxels that have a chip and are not dead."""
        has_chip = np.zeros(self.layout.shape, dtype=np.bool_)
        has_chip.flat[self.served] = True
        for taxel in self.signal.dead:
            has_chip[taxel] = False
        return has_chip & self.layout.alive


def load(path: str | os.PathLike[str]) -> SkinFile:
    """Read a skin's file.

    Raises:
        InputError: it cannot be read, or a value is not allowed.
    """
    return parse(read_text(path), os.fspath(path))


def shipped(name: str = "cody") -> Path:
    """Path of a skin file that comes with the package: `cody` or `mpr121`."""
    return Path(__file__).parents[2] / "skins" / f"{name}.toml"


def parse(text: str, where: str = "skin") -> SkinFile:
    """Read the text of a skin's file; errors call it `where`.

    Raises:
        InputError: a value is not allowed.
    """
    top = parse_toml(text, where)
    skin = top.table("skin", {})
    name = skin.text("name", Path(where).stem or "skin")
    for key in fields(SkinLayout):
        skin.has(key.name)
    skin.refuse_unknown()
    layout = SkinLayout.from_dict(skin.raw, where=where)
    signals = top.table("signal", {})
    sign = signals.whole("sign", allowed=(1, -1)) if signals.has("sign") else None
    table = top.table("read", {})
    reading = Reading(**table.values(Reading))
    table.refuse_unknown()
    buses = read_buses(top.tables("bus", "bus"), layout, sign)
    chips = [chip for bus in buses for chip in bus.chips]
    defaults = _defaults(chips)
    signal = _signal(signals, layout, defaults)
    if not skin.has("threshold_counts") and defaults.threshold_counts:
        layout = SkinLayout.from_dict({**asdict(defaults), **skin.raw}, where=where)
    calibration = None
    if top.has("calibration"):
        calibration = _calibration(top.table("calibration"), layout, chips)
    named = top.table("labels", {})
    labels = {task: named.texts(task) for task in named.raw}
    top.refuse_unknown()
    return SkinFile(name, layout, buses, signal, reading, calibration, where, labels)


def _defaults(chips: Sequence[ChipSpec]) -> Defaults:
    """The defaults of the chips; for chips that differ, those of no kind."""
    kinds = {chip.traits.defaults for chip in chips}
    return kinds.pop() if len(kinds) == 1 else Defaults()


def _signal(table: ConfigTable, layout: SkinLayout, defaults: Defaults) -> Signal:
    dead = table.get("dead", [])
    if not isinstance(dead, list):
        raise table.fail("dead", "a list of [row, col]")
    keys = Signal.__dataclass_fields__.keys() & asdict(defaults).keys()
    table.raw = {**{key: getattr(defaults, key) for key in keys}, **table.raw}
    places = tuple(taxel_at(table, "dead", entry, layout) for entry in dead)
    signal = Signal(**table.values(Signal, dead=places))
    table.refuse_unknown()
    return signal


def _calibration(
    table: ConfigTable,
    layout: SkinLayout,
    chips: list[ChipSpec],
) -> TaxelCalibration:
    baseline = _array(table, "baseline", layout, "whole numbers").astype(np.uint16)
    noise = _array(table, "noise", layout, "numbers")
    table.has("taken")  # for people
    shear_rest = shear_noise = None
    if layout.axes:
        shear_rest = _array(table, "shear_baseline", layout, "pairs").astype(np.uint16)
        shear_noise = _array(table, "shear_noise", layout, "pairs")
    table.refuse_unknown()
    for chip in chips:
        highest = max(baseline.flat[chip.served], default=0)
        if highest > chip.traits.highest:
            # The skin had other chips when it was calibrated.
            raise InputError(
                f"{table.key_name('baseline')} is {highest} for a taxel of a "
                f"{chip.kind.name}, which tells at most {chip.traits.highest}; delete "
                "[calibration], and calibrate again"
            )
    return TaxelCalibration(baseline, noise, shear_rest, shear_noise)


def _array(
    table: ConfigTable,
    key: str,
    layout: SkinLayout,
    numbers: str,
) -> Floats:
    """A value for each taxel, from 0 to 65535."""
    try:
        array = np.array(table.get(key), dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)  # no numbers, or rows of different lengths
    shape = (*layout.shape, 2) if numbers == "pairs" else layout.shape
    allowed = (array >= 0) & (array <= 65535)
    if numbers == "whole numbers":
        allowed &= array == np.floor(array)
    if array.shape != shape or not allowed.all():
        raise InputError(
            f"{table.key_name(key)} must be {layout.rows} rows of {layout.cols} {numbers} "
            "from 0 to 65535; delete [calibration], and calibrate again"
        )
    return array
