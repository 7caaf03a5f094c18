"""`skin.toml`: which chip stage is which taxel, and what its counts mean."""

from __future__ import annotations

import os
import re
import shutil
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.bus import device_path
from edge.chips import ad7147, block, mpr121, tca9548a
from edge.errors import InputError
from edge.files import write_whole
from edge.layout import SkinLayout

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
    def place(self) -> str:
        """Where it is, for a person."""
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
class Calibration:
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
    calibration: Calibration | None = None
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


class _Table:
    """A TOML table whose keys are taken one by one; what is left over is unknown."""

    def __init__(self, raw: object, where: str) -> None:
        if not isinstance(raw, Mapping):
            raise InputError(f"{where} must be a table, not {raw!r}")
        self._raw, self.where = raw, where
        self._known: list[str] = []

    def get(self, key: str, default: Any = None) -> Any:
        self._known.append(key)
        return self._raw.get(key, default)

    def fail(self, key: str, wanted: str) -> InputError:
        return InputError(f"{self.where}: {key} must be {wanted}, not {self._raw.get(key)!r}")

    def whole(self, key: str, default: int | None, allowed: Sequence[int] | range) -> int:
        value = self.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value not in allowed:
            if key not in self._raw:
                raise InputError(f"{self.where}: {key} is missing")
            if isinstance(allowed, range) and allowed[0] >= 0x20 and allowed[-1] < 0x78:
                wanted = f"{allowed[0]:#04x} to {allowed[-1]:#04x}"
            elif isinstance(allowed, range):
                wanted = f"a whole number of {allowed[0]} to {allowed[-1]}"
            else:
                wanted = f"one of {', '.join(map(str, allowed))}"
            raise self.fail(key, wanted)
        return value

    def number(self, key: str, default: float, low: float, high: float) -> float:
        value = self.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fail(key, "a number")
        if not low <= value <= high:
            raise self.fail(key, f"a number of {low:g} to {high:g}")
        return float(value)

    def flag(self, key: str, default: bool) -> bool:
        value = self.get(key, default)
        if not isinstance(value, bool):
            raise self.fail(key, "true or false")
        return value

    def pair(self, key: str, value: object) -> tuple[int, int]:
        if (
            not isinstance(value, list)
            or len(value) != 2
            or any(isinstance(x, bool) or not isinstance(x, int) for x in value)
        ):
            raise InputError(f"{self.where}: {key} must be [row, col], not {value!r}")
        return value[0], value[1]

    def done(self) -> None:
        unknown = sorted(set(self._raw) - set(self._known))
        if unknown:
            raise InputError(
                f"{self.where}: unknown key {unknown[0]!r}; allowed: {', '.join(self._known)}"
            )


def load(path: str | os.PathLike[str]) -> SkinFile:
    """Read a skin's file.

    Raises:
        InputError: it cannot be read or makes no sense; the sentence names file and key.
    """
    return parse(_text(path), os.fspath(path))


def shipped(name: str = "cody") -> Path:
    """Path of a skin file that comes with the package: `cody` or `mpr121`."""
    return Path(__file__).parent / "skins" / f"{name}.toml"


def _text(path: str | os.PathLike[str]) -> str:
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
    top = _Table(raw, where)
    skin = dict(_Table(top.get("skin", {}), f"{where}: [skin]")._raw)
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
    signal, sign = _signal(_Table(top.get("signal", {}), f"{where}: [signal]"), layout)
    reading = _reading(_Table(top.get("read", {}), f"{where}: [read]"))
    entries = top.get("bus")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{where}: no [[bus]] given")
    buses = tuple(_bus(entry, i, layout, sign, where) for i, entry in enumerate(entries))
    _check_buses(buses, layout, where)
    calibration = top.get("calibration")
    if calibration is not None:
        calibration = _calibration(_Table(calibration, f"{where}: [calibration]"), layout)
    top.done()
    return SkinFile(name, layout, buses, signal, reading, calibration, where)


def _signal(table: _Table, layout: SkinLayout) -> tuple[Signal, int]:
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


def _reading(table: _Table) -> Reading:
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
    table = _Table(entry, f"{where}: bus {index}")
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
        specs.append(_chip(_Table({**given, **chip}, place), layout, sign))
    return BusSpec(device_path(device), tuple(specs), clock_hz)


def _chip(table: _Table, layout: SkinLayout, sign: int) -> ChipSpec:
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


def _taxels(table: _Table, layout: SkinLayout) -> tuple[int, ...]:
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
                    f"{where}: bus {b} chip {c} has the place of chip {seen[place]}, {chip.place}"
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


def _calibration(table: _Table, layout: SkinLayout) -> Calibration:
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
        array = np.array(rows, dtype=np.float64)
        if not (np.isfinite(array).all() and (array >= 0).all() and (array <= 65535).all()):
            raise InputError(f"{table.where}: {key} has a value outside of 0 to 65535")
        arrays[key] = array
    taken = table.get("taken")
    if taken is not None and not isinstance(taken, datetime):
        raise table.fail("taken", "a date and time")
    table.done()
    return Calibration(arrays["baseline"].astype(np.uint16), arrays["noise"], taken)


def calibration_text(calibration: Calibration) -> str:
    """The `[calibration]` table as TOML, a line a row of the skin."""

    def rows(values: Iterable[Iterable[object]]) -> Iterator[str]:
        for row in values:
            yield f"  [{', '.join(map(str, row))}],\n"

    lines = ["[calibration]\n"]
    if calibration.taken is not None:
        lines.append(f"taken = {calibration.taken.isoformat(timespec='seconds')}\n")
    lines += ["baseline = [\n", *rows(calibration.baseline.tolist()), "]\n"]
    noise = [[round(float(x), 3) for x in row] for row in calibration.noise]
    lines += ["noise = [\n", *rows(noise), "]\n"]
    return "".join(lines)


def with_calibration(text: str, calibration: Calibration, where: str = "skin") -> str:
    """The file's text with its `[calibration]` replaced; all else, comments too, stays.

    Raises:
        InputError: the file writes its calibration in a way that cannot be replaced.
    """
    before = parse(text, where)
    table = re.compile(
        r"^[ \t]*\[calibration\][ \t]*(#.*)?\n(?:(?![ \t]*\[\[?[ \t]*[A-Za-z_\"']).*\n?)*", re.M
    )
    rest = table.sub("", text if text.endswith("\n") else text + "\n").rstrip("\n")
    out = f"{rest}\n\n{calibration_text(calibration)}"
    after = parse(out, where)
    kept = all(
        getattr(before, f.name) == getattr(after, f.name)
        for f in fields(SkinFile)
        if f.name != "calibration"
    )
    if not kept or after.calibration is None:
        raise InputError(f"{where}: write [calibration] as a table of its own, at the end")
    return out


def save_calibration(path: str | os.PathLike[str], calibration: Calibration) -> Path:
    """Put a calibration into a skin's file, whole or not at all; the old file stays beside it.

    Returns:
        Path of the old file, `skin.toml.bak`.

    Raises:
        InputError: the file cannot be read or written.
    """
    target = Path(path)
    text = with_calibration(_text(target), calibration, os.fspath(path))
    backup = target.with_name(f"{target.name}.bak")
    with write_whole(backup) as file, open(target, "rb") as old:
        shutil.copyfileobj(old, file)
    with write_whole(target) as file:
        file.write(text.encode())
    return backup


def dead_band(skin: SkinFile) -> NDArray[np.int32]:
    """(rows * cols,) counts under which a taxel reads 0; at least 1, so that none is negative."""
    floor = max(1, skin.signal.dead_band_counts)
    if skin.calibration is None:
        return np.full(skin.layout.rows * skin.layout.cols, floor, dtype=np.int32)
    sigma = skin.signal.dead_band_sigma * skin.calibration.noise.ravel()
    return np.maximum(floor, np.ceil(np.minimum(sigma, 65535.0))).astype(np.int32)


def frame_rate(bits: Sequence[float], clocks: Sequence[int]) -> float:
    """Frames a second that buses carry side by side, each with its bits a frame."""
    return 1.0 / max(b / hz for b, hz in zip(bits, clocks, strict=True))
