"""`skin.toml`: which chip stage is which taxel, and what its counts mean."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge.config import Table
from edge.errors import InputError
from edge.i2c import ad7147, block, mpr121, tca9548a
from edge.i2c.bus import device_path
from edge.touch.layout import SkinLayout

KINDS = ("ad7147", "mpr121", "block")
UNUSED = -1
"""A stage that is no taxel."""
FASTEST_MUX_HZ = 400_000


@dataclass(frozen=True)
class ChipSpec:
    """One chip: where it is, and which taxel each of its stages is.

    Attributes:
        kind: a driver's name.
        address: 7 bits.
        taxels: flat index (row * cols + col) of each stage, `UNUSED` for none.
        mux, channel: the way to it, or None where it hangs on the bus itself.
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        decimation: of an AD7147.
        bits: of a block's taxel.
    """

    kind: str
    address: int
    taxels: tuple[int, ...]
    mux: int | None = None
    channel: int | None = None
    sign: int = 1
    decimation: int = 64
    bits: int = 16

    @property
    def route(self) -> str:
        """The way to it as a person reads it: mux, channel and address."""
        way = "" if self.mux is None else f"mux {self.mux:#04x} channel {self.channel} "
        return f"{way}address {self.address:#04x}"


@dataclass(frozen=True)
class BusSpec:
    """One adapter and its chips, in the order in which they are read."""

    device: str
    chips: tuple[ChipSpec, ...]
    clock_hz: int = 400_000


@dataclass(frozen=True)
class Signal:
    """From raw values to counts above baseline.

    Attributes:
        dead_band_sigma: counts under so many standard deviations of the noise are 0.
        dead_band_counts: and so are counts under this.
        drift_counts_per_s: how fast the baseline follows while nothing touches.
        drift_limit_counts: how far from the calibration it may go.
        settle_s: how long after a contact it stays frozen.
        dead: taxels never to be used, (row, col).
    """

    dead_band_sigma: float = 6.0
    dead_band_counts: int = 0
    drift_counts_per_s: float = 20.0
    drift_limit_counts: int = 2000
    settle_s: float = 0.5
    dead: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Reading:
    """How the skin is read.

    Attributes:
        rate_hz: of frames.
        timeout_s: what a hung chip costs at most; adapters round it up to 10 ms.
        verify_mux: read a mux's control byte back after each selection.
        recheck_frames: on each bus one chip's settings are read again every so many frames.
        stuck_frames: a chip whose bytes do not change for so many frames is invalid; only
            where the calibration has seen it make noise.
        region_of_interest: read the chips near the contact at full rate, the rest in turn.
    """

    rate_hz: float = 100.0
    timeout_s: float = 0.02
    verify_mux: bool = True
    recheck_frames: int = 4
    stuck_frames: int = 100
    region_of_interest: bool = False


@dataclass(frozen=True)
class TaxelCalibration:
    """What `edge-classify calibrate` measured with nothing touching.

    Attributes:
        baseline: (rows, cols) raw counts, rounded means; 0 where a taxel could not be read.
        noise: (rows, cols) raw counts, standard deviations.
        taken: when, in universal time, or None where unknown.
    """

    baseline: NDArray[np.uint16]
    noise: NDArray[np.float64]
    taken: datetime | None = None


@dataclass(frozen=True)
class SkinFile:
    """A skin as its file describes it."""

    name: str
    layout: SkinLayout
    buses: tuple[BusSpec, ...]
    signal: Signal = field(default_factory=Signal)
    reading: Reading = field(default_factory=Reading)
    calibration: TaxelCalibration | None = None
    path: str = "skin"

    @property
    def chips(self) -> list[ChipSpec]:
        """All chips, bus by bus."""
        return [chip for bus in self.buses for chip in bus.chips]

    @property
    def uncovered(self) -> int:
        """How many taxels no chip serves."""
        served = {t for chip in self.chips for t in chip.taxels} - {UNUSED}
        return self.layout.rows * self.layout.cols - len(served)


def load(path: str | os.PathLike[str]) -> SkinFile:
    """Read a skin's file.

    Raises:
        InputError: it cannot be read or makes no sense; the sentence names file and key.
    """
    return parse(read_text(path), os.fspath(path))


def shipped(name: str = "cody") -> Path:
    """Path of a skin file that comes with the package: `cody` or `mpr121`."""
    return Path(__file__).parents[1] / "skins" / f"{name}.toml"


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file.

    Raises:
        InputError: it cannot be read.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{os.fspath(path)}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{os.fspath(path)}: not UTF-8 text: {error.reason}") from None


def parse(text: str, where: str = "skin") -> SkinFile:
    """Read the text of a skin's file; `where` is what errors call it.

    Raises:
        InputError: it makes no sense.
    """
    try:
        raw = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{where}: not TOML: {error}") from None
    top = Table(raw, where)
    skin = dict(Table(top.get("skin", {}), f"{where}: [skin]").raw)
    name = skin.pop("name", Path(where).stem)
    if not isinstance(name, str):
        raise InputError(f"{where}: skin.name must be text, not {name!r}")
    known = [f.name for f in fields(SkinLayout)]
    unknown = sorted(set(skin) - set(known))
    if unknown:
        raise InputError(
            f"{where}: [skin] has an unknown key {unknown[0]!r}; allowed: name, {', '.join(known)}"
        )
    layout = SkinLayout.from_dict(skin, where=where)
    signal, sign = _signal(Table(top.get("signal", {}), f"{where}: [signal]"), layout)
    reading = _reading(Table(top.get("read", {}), f"{where}: [read]"))
    entries = top.get("bus")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{where}: no [[bus]] given")
    buses = tuple(_bus(entry, i, layout, sign, where) for i, entry in enumerate(entries))
    _check_buses(buses, layout, where)
    calibration = top.get("calibration")
    if calibration is not None:
        calibration = _calibration(Table(calibration, f"{where}: [calibration]"), layout)
    top.done()
    return SkinFile(name, layout, buses, signal, reading, calibration, where)


def _signal(table: Table, layout: SkinLayout) -> tuple[Signal, int]:
    sign = table.whole("sign", 1, (1, -1))
    dead = table.get("dead", [])
    if not isinstance(dead, list):
        raise table.fail("dead", "a list of [row, col]")
    pairs = [table.pair("dead", entry) for entry in dead]
    for row, col in pairs:
        if not (0 <= row < layout.rows and 0 <= col < layout.cols):
            raise InputError(
                f"{table.where}: dead names taxel [{row}, {col}] outside of "
                f"{layout.rows} x {layout.cols}"
            )
    signal = Signal(
        dead_band_sigma=table.number("dead_band_sigma", 6.0, 0.0, 100.0),
        dead_band_counts=table.whole("dead_band_counts", 0, range(65536)),
        drift_counts_per_s=table.number("drift_counts_per_s", 20.0, 0.0, 65535.0),
        drift_limit_counts=table.whole("drift_limit_counts", 2000, range(65536)),
        settle_s=table.number("settle_s", 0.5, 0.0, 60.0),
        dead=tuple(pairs),
    )
    table.done()
    return signal, sign


def _reading(table: Table) -> Reading:
    reading = Reading(
        rate_hz=table.number("rate_hz", 100.0, 0.1, 10_000.0),
        timeout_s=table.number("timeout_s", 0.02, 0.001, 10.0),
        verify_mux=table.flag("verify_mux", True),
        recheck_frames=table.whole("recheck_frames", 4, range(1, 100_001)),
        stuck_frames=table.whole("stuck_frames", 100, range(2, 1_000_001)),
        region_of_interest=table.flag("region_of_interest", False),
    )
    table.done()
    return reading


def _bus(entry: object, index: int, layout: SkinLayout, sign: int, where: str) -> BusSpec:
    table = Table(entry, f"{where}: bus {index}")
    device = table.get("device")
    if isinstance(device, bool) or not isinstance(device, int | str) or device == "":
        raise table.fail("device", 'a bus\'s number or its path, like 1 or "/dev/i2c-1"')
    clock_hz = table.whole("clock_hz", 400_000, range(1_000, 5_000_001))
    common = {key: table.get(key) for key in ("kind", "mux", "block", "bits", "decimation")}
    chips = table.get("chips")
    if not isinstance(chips, list) or not chips:
        raise InputError(f"{table.where}: chips are missing; give a list of tables")
    table.done()
    given = {key: value for key, value in common.items() if value is not None}
    specs = []
    for i, chip in enumerate(chips):
        place = f"{where}: bus {index} chip {i}"
        if not isinstance(chip, Mapping):
            raise InputError(f"{place} must be a table, not {chip!r}")
        specs.append(_chip(Table({**given, **chip}, place), layout, sign))
    return BusSpec(device_path(device), tuple(specs), clock_hz)


def _chip(table: Table, layout: SkinLayout, sign: int) -> ChipSpec:
    kind = table.get("kind")
    if kind not in KINDS:
        raise table.fail("kind", f"one of {', '.join(KINDS)}")
    addresses = {"ad7147": ad7147.ADDRESSES, "mpr121": mpr121.ADDRESSES}
    address = table.whole("address", None, addresses.get(kind, range(0x08, 0x78)))
    mux = table.get("mux")
    channel = table.get("channel")
    if mux is not None:
        mux = table.whole("mux", None, tca9548a.ADDRESSES)
        channel = table.whole("channel", None, range(tca9548a.CHANNELS))
    elif channel is not None:
        raise InputError(f"{table.where}: channel needs mux, the mux's address")
    bits = table.whole("bits", 16, block.BITS)
    decimation = table.whole("decimation", 64, tuple(ad7147.DECIMATION))
    taxels = _taxels(table, layout)
    stages = {"ad7147": ad7147.STAGES, "mpr121": mpr121.ELECTRODES}.get(kind, len(taxels))
    if len(taxels) != stages:
        raise InputError(
            f"{table.where}: names {len(taxels)} taxels, an {kind.upper()} has {stages} stages; "
            "write [] for a stage that is none"
        )
    if not 1 <= len(taxels) <= block.MOST_TAXELS:
        raise InputError(f"{table.where}: names {len(taxels)} taxels, at most {block.MOST_TAXELS}")
    own = table.whole("sign", sign, (1, -1))
    table.done()
    return ChipSpec(kind, address, taxels, mux, channel, own, decimation, bits)


def _taxels(table: Table, layout: SkinLayout) -> tuple[int, ...]:
    """Flat indices from `taxels`, or from `first` and `block`, row by row."""
    listed, first, extent = table.get("taxels"), table.get("first"), table.get("block")
    places: list[tuple[int, int] | None] = []
    if listed is not None:
        if not isinstance(listed, list):
            raise table.fail("taxels", "a list of [row, col]")
        places += [None if entry == [] else table.pair("taxels", entry) for entry in listed]
    elif first is not None and extent is not None:
        row, col = table.pair("first", first)
        high, wide = table.pair("block", extent)
        if not (1 <= high <= layout.rows and 1 <= wide <= layout.cols):
            raise table.fail("block", f"[rows, cols] within {layout.rows} x {layout.cols}")
        places += [(row + i, col + j) for i in range(high) for j in range(wide)]
    else:
        raise InputError(f"{table.where}: taxels are missing; give first and block, or taxels")
    flat = []
    for place in places:
        if place is None:
            flat.append(UNUSED)
            continue
        row, col = place
        if not (0 <= row < layout.rows and 0 <= col < layout.cols):
            raise InputError(
                f"{table.where}: taxel [{row}, {col}] lies outside of {layout.rows} x {layout.cols}"
            )
        flat.append(row * layout.cols + col)
    return tuple(flat)


def _check_buses(buses: Sequence[BusSpec], layout: SkinLayout, where: str) -> None:
    """Raise InputError where two chips claim one place or one taxel."""
    owner: dict[int, str] = {}
    devices: dict[str, int] = {}
    for b, bus in enumerate(buses):
        if bus.device in devices:
            raise InputError(f"{where}: bus {b} has the device of bus {devices[bus.device]}")
        devices[bus.device] = b
        direct = {c.address for c in bus.chips if c.mux is None}
        muxes = {c.mux for c in bus.chips if c.mux is not None}
        if muxes and bus.clock_hz > FASTEST_MUX_HZ:
            raise InputError(
                f"{where}: bus {b}: clock_hz {bus.clock_hz} is more than a TCA9548A carries, "
                f"{FASTEST_MUX_HZ}"
            )
        if direct & muxes:
            raise InputError(
                f"{where}: bus {b}: {min(direct & muxes):#04x} is a mux's address and a chip's"
            )
        seen: dict[tuple[int | None, int | None, int], int] = {}
        for c, chip in enumerate(bus.chips):
            place = (chip.mux, chip.channel, chip.address)
            if place in seen:
                raise InputError(
                    f"{where}: bus {b} chip {c} has the same address as chip {seen[place]}, "
                    f"{chip.route}"
                )
            if chip.mux is not None and chip.address in direct | muxes:
                raise InputError(
                    f"{where}: bus {b} chip {c}: {chip.address:#04x} answers before the mux too"
                )
            seen[place] = c
            for taxel in chip.taxels:
                if taxel == UNUSED:
                    continue
                if taxel in owner:
                    row, col = divmod(taxel, layout.cols)
                    raise InputError(
                        f"{where}: bus {b} chip {c}: taxel [{row}, {col}] is {owner[taxel]}'s too"
                    )
                owner[taxel] = f"bus {b} chip {c}"


def _calibration(table: Table, layout: SkinLayout) -> TaxelCalibration:
    arrays: dict[str, NDArray[np.float64]] = {}
    for key in ("baseline", "noise"):
        value = table.get(key)
        rows = value if isinstance(value, list) else []
        flat = [x for row in rows if isinstance(row, list) for x in row]
        shaped = len(rows) == layout.rows and all(
            isinstance(row, list) and len(row) == layout.cols for row in rows
        )
        wanted = (int,) if key == "baseline" else (int, float)
        if not shaped or any(isinstance(x, bool) or not isinstance(x, wanted) for x in flat):
            raise InputError(
                f"{table.where}: {key} must be {layout.rows} rows of {layout.cols} "
                f"{'whole ' if key == 'baseline' else ''}numbers; calibrate again"
            )
        try:
            array = np.array(rows, dtype=np.float64)
        except OverflowError:  # a whole number beyond all floats
            array = np.array(np.inf)
        if not (np.isfinite(array).all() and (array >= 0).all() and (array <= 65535).all()):
            raise InputError(f"{table.where}: {key} has a value outside of 0 to 65535")
        arrays[key] = array
    taken = table.get("taken")
    if taken is not None and not isinstance(taken, datetime):
        raise table.fail("taken", "a date and time")
    table.done()
    return TaxelCalibration(arrays["baseline"].astype(np.uint16), arrays["noise"], taken)


def frame_rate(bits: Sequence[float], clocks: Sequence[int]) -> float:
    """Frames a second that buses carry side by side, each with its bits a frame."""
    return 1.0 / max(b / hz for b, hz in zip(bits, clocks, strict=True))
