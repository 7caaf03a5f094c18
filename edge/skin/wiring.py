"""A skin's buses and chips: the `[[bus]]` tables of its file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from edge.bus import tca9548a
from edge.chips.chip import MOST_TAXELS, UNUSED, ChipKind, ChipSpec
from edge.chips.kinds import KINDS
from edge.config import ConfigTable, shown
from edge.errors import InputError
from edge.touch.layout import SkinLayout

FASTEST_MUX_HZ = 400_000
SERIAL_PORT = re.compile(r"(/dev/(tty|serial/|cu\.).*|COM\d+)")


@dataclass(frozen=True)
class BusSpec:
    """One adapter and its chips, in reading order.

    Attributes:
        device: such as `/dev/i2c-1`, or a serial port.
        chips: on it; one on a serial port.
        clock_hz: of the I2C bus, or the serial port's bits per second.
        serial: whether it is a serial port.
    """

    device: str
    chips: tuple[ChipSpec, ...]
    clock_hz: int = 400_000
    serial: bool = False


def read_buses(
    tables: Sequence[ConfigTable], layout: SkinLayout, sign: int | None
) -> tuple[BusSpec, ...]:
    """The buses of a skin.

    Args:
        tables: one for each bus.
        layout: the skin's.
        sign: of chips that give none; their kind's default where None.

    Raises:
        InputError: a value is not allowed, or two chips claim one address or one taxel.
    """
    buses = tuple(_bus(table, layout, sign) for table in tables)
    _check_buses(buses, layout, tables[0].where)
    return buses


def _bus(table: ConfigTable, layout: SkinLayout, sign: int | None) -> BusSpec:
    serial = table.has("serial")
    device, clock_hz = _port(table) if serial else _adapter(table)
    if table.has("kind"):
        _kind(table)
    options = {name for kind in KINDS.values() for name in kind.options}
    keys = ("kind", "mux", "block", *sorted(options))
    shared = {key: table.raw[key] for key in keys if table.has(key)}
    chips = table.tables("chips", f"{table.prefix.rstrip(': ')} chip")
    table.done()
    if serial and len(chips) > 1:
        raise InputError(
            f"{table.called('chips')} has {len(chips)}; a serial port has one"
        )
    specs = []
    for chip in chips:
        kind = _kind(ConfigTable({**shared, **chip.raw}, chip.where, chip.prefix))
        of_others = options - set(kind.options)
        raw = {key: value for key, value in shared.items() if key not in of_others} | {
            **chip.raw
        }
        specs.append(
            _chip(ConfigTable(raw, chip.where, chip.prefix), kind, layout, sign, serial)
        )
    return BusSpec(device, tuple(specs), clock_hz, serial)


def _port(table: ConfigTable) -> tuple[str, int]:
    """A serial port and its bits per second."""
    port = table.text("serial")
    if table.has("device"):
        raise InputError(
            f"{table.called('device')} is an I2C bus; give it or serial, not both"
        )
    return port, table.whole("baud", 115_200, range(1_200, 20_000_001))


def _adapter(table: ConfigTable) -> tuple[str, int]:
    """An I2C bus and its clock in Hz."""
    device = table.get("device", None)
    number = type(device) is int and 0 <= device < 1 << 20
    if not number and not (isinstance(device, str) and device and "\0" not in device):
        form = 'the number of a bus or its path or adapter, like 1, "/dev/i2c-1" or "CP2112"'
        raise table.fail("device", form)
    if isinstance(device, str) and SERIAL_PORT.fullmatch(device):
        raise InputError(
            f"{table.called('device')} {device} is a serial port, not an I2C bus; write serial = "
            f'"{device}" instead, with kind = "block"'
        )
    path = f"/dev/i2c-{device}" if number else str(device)
    return path, table.whole("clock_hz", 400_000, range(1_000, 5_000_001))


def _kind(table: ConfigTable) -> ChipKind:
    name = table.get("kind")
    if not isinstance(name, str) or name not in KINDS:
        kinds = ", ".join(
            f"{kind.name} ({kind.description})" for kind in KINDS.values()
        )
        raise table.fail("kind", f"one of {kinds}")
    return KINDS[name]


def _chip(
    table: ConfigTable,
    kind: ChipKind,
    layout: SkinLayout,
    sign: int | None,
    serial: bool,
) -> ChipSpec:
    table.has("kind")
    if serial and not kind.serial:
        raise InputError(
            f"{table.called('kind')} is {kind.name}; a serial port carries block only"
        )
    if serial and table.has("address"):
        raise InputError(
            f"{table.called('address')} has no meaning on a serial port; leave it out"
        )
    address = (
        0 if serial else table.whole("address", allowed=kind.addresses, form="#04x")
    )
    mux = channel = None
    if table.has("mux"):
        mux = table.whole("mux", allowed=tca9548a.ADDRESSES, form="#04x")
        channel = table.whole("channel", allowed=range(tca9548a.CHANNELS))
    elif table.has("channel"):
        raise InputError(f"{table.called('channel')} needs mux, the address of the mux")
    options = {
        name: table.whole(name, option.default, option.allowed)
        for name, option in kind.options.items()
    }
    taxels = _taxels(table, layout)
    if kind.stages is not None and len(taxels) != kind.stages:
        raise InputError(
            f"{table.called('taxels')} names {len(taxels)} taxels, but an {kind.name.upper()} has "
            f"{kind.stages} stages; write [] for a stage without a taxel"
        )
    if not 1 <= len(taxels) <= MOST_TAXELS:
        limits = f"names {len(taxels)} taxels; a chip serves 1 to {MOST_TAXELS}"
        raise InputError(f"{table.called('taxels')} {limits}")
    default = kind.defaults(options).sign if sign is None else sign
    own_sign = table.whole("sign", default, (1, -1))
    table.done()
    return ChipSpec(kind, address, taxels, mux, channel, own_sign, options)


def _taxels(table: ConfigTable, layout: SkinLayout) -> tuple[int, ...]:
    """Flat indices from `taxels`, or from `first` and `block`, row by row."""
    listed, *block = [table.has(key) for key in ("taxels", "first", "block")]
    key = "taxels" if listed else "first"
    if listed:
        taxels = table.get("taxels")
        if not isinstance(taxels, list):
            raise table.fail("taxels", "a list of [row, col]")
    elif all(block):
        row, col = table.pair("first")
        high, wide = table.pair("block")
        if not (1 <= high <= layout.rows and 1 <= wide <= layout.cols):
            raise table.fail(
                "block", f"[rows, cols] within {layout.rows} x {layout.cols}"
            )
        taxels = [[row + i, col + j] for i in range(high) for j in range(wide)]
    else:
        raise InputError(
            f"{table.called('taxels')} is missing; give it, or first and block"
        )
    pairs = [
        None if taxel == [] else taxel_at(table, key, taxel, layout) for taxel in taxels
    ]
    return tuple(
        UNUSED if pair is None else pair[0] * layout.cols + pair[1] for pair in pairs
    )


def taxel_at(
    table: ConfigTable, key: str, value: object, layout: SkinLayout
) -> tuple[int, int]:
    """Row and column of a taxel that a key names.

    Raises:
        InputError: it is no [row, col], or lies outside of the skin.
    """
    row, col = table.pair(key, value)
    if not (0 <= row < layout.rows and 0 <= col < layout.cols):
        raise InputError(
            f"{table.called(key)} names taxel [{shown(row)}, {shown(col)}], which lies outside of "
            f"{layout.rows} x {layout.cols}"
        )
    return row, col


def _check_buses(buses: Sequence[BusSpec], layout: SkinLayout, where: str) -> None:
    """Raise InputError where two chips claim one address or one taxel."""
    owner: dict[int, str] = {}
    devices = [bus.device for bus in buses]
    for b, bus in enumerate(buses):
        place = f"{where}: bus {b}"
        if bus.device in devices[:b]:
            raise InputError(
                f"{place} has the same device as bus {devices.index(bus.device)}"
            )
        claimed: dict[tuple[int | None, ...], str] = {
            (None, None, chip.mux): "a mux"
            for chip in bus.chips
            if chip.mux is not None
        }
        if claimed and bus.clock_hz > FASTEST_MUX_HZ:
            raise InputError(
                f"{place}: clock_hz is {bus.clock_hz}; a TCA9548A carries at most {FASTEST_MUX_HZ}"
            )
        # While its channel is connected, a chip behind a mux also hears messages to the
        # chips on the bus itself, so these claim their addresses first.
        for c, chip in sorted(
            enumerate(bus.chips), key=lambda entry: entry[1].mux is not None
        ):
            place = f"bus {b} chip {c}"
            route = (chip.mux, chip.channel, chip.address)
            other = claimed.get(route) or claimed.get((None, None, chip.address))
            if other is not None:
                raise InputError(
                    f"{where}: {place} has the same address as {other}, {chip.route}"
                )
            claimed[route] = f"chip {c}"
            for taxel in chip.taxels:
                if taxel in owner and taxel != UNUSED:
                    row, col = divmod(taxel, layout.cols)
                    raise InputError(
                        f"{where}: {place}: taxel [{row}, {col}] belongs to {owner[taxel]} already"
                    )
                owner[taxel] = place
