"""A skin's buses and chips: the `[[bus]]` tables of its file."""

from collections.abc import Sequence
from dataclasses import dataclass

from edge.config import ConfigTable
from edge.errors import InputError
from edge.touch.layout import SkinLayout
from edge.wire.bus import tca9548a
from edge.wire.chips.chip import MOST_TAXELS, UNUSED, Chip, ChipSpec
from edge.wire.chips.kinds import KINDS, driver
from edge.wire.chips.three_axes import three_axes

FASTEST_MUX_HZ = 400_000


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
    tables: Sequence[ConfigTable],
    layout: SkinLayout,
    sign: int | None,
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
    if serial:
        device = table.text("serial")
        clock_hz = table.whole("baud", 115_200, range(1_200, 20_000_001))
    else:
        device, clock_hz = _adapter(table)
    chips = table.tables("chips", f"{table.prefix.rstrip(': ')} chip")
    if serial and len(chips) > 1:
        raise InputError(
            f"{table.key_name('chips')} has {len(chips)}; a serial port has one"
        )
    specs = tuple(_chip(chip, table, layout, sign, serial) for chip in chips)
    options = {name for spec in specs for name in spec.kind.options}
    for key in ("kind", "mux", "block", *options):
        table.has(key)
    table.refuse_unknown()
    return BusSpec(device, specs, clock_hz, serial)


def _shared(chip: ConfigTable, bus: ConfigTable, keys: Sequence[str]) -> ConfigTable:
    """A chip's table with the keys that its bus gives for all chips."""
    shared = {key: bus.raw[key] for key in keys if key in bus.raw}
    return ConfigTable({**shared, **chip.raw}, chip.where, chip.prefix)


def _adapter(table: ConfigTable) -> tuple[str, int]:
    """An I2C bus and its clock in Hz."""
    device = table.get("device", None)
    number = type(device) is int and 0 <= device < 1 << 20
    if not number and not (isinstance(device, str) and device and "\0" not in device):
        form = 'the number of a bus or its path or adapter, like 1, "/dev/i2c-1" or "CP2112"'
        raise table.fail("device", form)
    path = f"/dev/i2c-{device}" if number else str(device)
    return path, table.whole("clock_hz", 400_000, range(1_000, 5_000_001))


def _chip(
    chip: ConfigTable,
    bus: ConfigTable,
    layout: SkinLayout,
    sign: int | None,
    serial: bool,
) -> ChipSpec:
    name = _shared(chip, bus, ("kind",)).choice("kind", tuple(KINDS))
    kind = driver(name)
    if layout.axes:
        kind = three_axes(kind, bus)
    table = _shared(chip, bus, ("kind", "mux", "block", *kind.options))
    table.has("kind")
    address = _address(table, kind, serial)
    mux = channel = None
    if table.has("mux"):
        mux = table.whole("mux", allowed=tca9548a.ADDRESSES, form="#04x")
        channel = table.whole("channel", allowed=range(tca9548a.CHANNELS))
    elif table.has("channel"):
        raise InputError(
            f"{table.key_name('channel')} needs mux, the address of the mux"
        )
    options = {
        name: table.whole(name, option.default, option.allowed)
        for name, option in kind.options.items()
    }
    taxels = _taxels(table, layout)
    _check_taxels(table, kind, taxels)
    if sign is None:
        sign = kind.traits(len(taxels), options).defaults.sign
    sign = table.whole("sign", sign, (1, -1))
    table.refuse_unknown()
    return ChipSpec(kind, address, taxels, mux, channel, sign, options)


def _address(table: ConfigTable, kind: type[Chip], serial: bool) -> int:
    """The address of a chip, 0 on a serial port."""
    if not serial:
        return table.whole("address", allowed=kind.addresses, form="#04x")
    if not kind.serial:
        raise InputError(
            f"{table.key_name('kind')} is {kind.name}; a serial port carries block only"
        )
    return 0


def _check_taxels(
    table: ConfigTable,
    kind: type[Chip],
    taxels: tuple[int, ...],
) -> None:
    if kind.stages is not None and len(taxels) != kind.stages:
        raise InputError(
            f"{table.key_name('taxels')} names {len(taxels)} taxels, but an "
            f"{kind.name.upper()} has {kind.stages} stages; write [] for a stage "
            "without a taxel"
        )
    if not 1 <= len(taxels) <= MOST_TAXELS:
        raise InputError(
            f"{table.key_name('taxels')} names {len(taxels)} taxels; a chip serves 1 to "
            f"{MOST_TAXELS}"
        )


def _taxels(table: ConfigTable, layout: SkinLayout) -> tuple[int, ...]:
    """Flat indices from `taxels`, or from `first` and `block`, row by row."""
    # Each key is asked for, so that none of them counts as unknown.
    listed = table.has("taxels")
    is_rectangle = all([table.has("first"), table.has("block")])
    if not (listed or is_rectangle):
        raise InputError(
            f"{table.key_name('taxels')} is missing; give it, or first and block"
        )
    key = "taxels" if listed else "first"
    taxels = table.get("taxels") if listed else _rectangle(table, layout)
    if not isinstance(taxels, list):
        raise table.fail("taxels", "a list of [row, col]")
    indices = []
    for taxel in taxels:
        if taxel == []:
            indices.append(UNUSED)
        else:
            row, col = taxel_at(table, key, taxel, layout)
            indices.append(row * layout.cols + col)
    return tuple(indices)


def _rectangle(table: ConfigTable, layout: SkinLayout) -> list[list[int]]:
    """[row, col] of the taxels of `first` and `block`, row by row."""
    row, col = table.pair("first")
    high, wide = table.pair("block")
    if not (1 <= high <= layout.rows and 1 <= wide <= layout.cols):
        raise table.fail("block", f"[rows, cols] within {layout.rows} x {layout.cols}")
    return [[row + i, col + j] for i in range(high) for j in range(wide)]


def taxel_at(
    table: ConfigTable,
    key: str,
    value: object,
    layout: SkinLayout,
) -> tuple[int, int]:
    """Row and column of a taxel that a key names.

    Raises:
        InputError: it is no [row, col], or lies outside of the skin.
    """
    row, col = table.pair(key, value)
    if not (0 <= row < layout.rows and 0 <= col < layout.cols):
        inside = f"[row, col] within {layout.rows} x {layout.cols}"
        raise table.fail(key, inside, value)
    return row, col


def _check_buses(buses: Sequence[BusSpec], layout: SkinLayout, where: str) -> None:
    """Raise InputError where two chips claim one address or one taxel."""
    owners: dict[int, str] = {}
    devices = [bus.device for bus in buses]
    for number, bus in enumerate(buses):
        place = f"{where}: bus {number}"
        former = devices.index(bus.device)
        if former < number:
            raise InputError(f"{place} has the same device as bus {former}")
        _check_addresses(bus, place)
        for index, chip in enumerate(bus.chips):
            for taxel in chip.served:
                if taxel in owners:
                    row, col = divmod(taxel, layout.cols)
                    raise InputError(
                        f"{place} chip {index}: taxel [{row}, {col}] belongs to "
                        f"{owners[taxel]} already"
                    )
                owners[taxel] = f"bus {number} chip {index}"


def _check_addresses(bus: BusSpec, place: str) -> None:
    muxes = {chip.mux for chip in bus.chips} - {None}
    if muxes and bus.clock_hz > FASTEST_MUX_HZ:
        raise InputError(
            f"{place}: clock_hz is {bus.clock_hz}; a TCA9548A carries at most "
            f"{FASTEST_MUX_HZ}"
        )
    # While its channel is connected, a chip behind a mux also hears messages to the
    # chips on the bus itself, so these claim their addresses first.
    order = sorted(enumerate(bus.chips), key=lambda item: item[1].mux is not None)
    claimed: dict[tuple[int | None, ...], str] = {
        (None, None, mux): "a mux" for mux in muxes
    }
    for index, chip in order:
        route = (chip.mux, chip.channel, chip.address)
        owner = claimed.get(route) or claimed.get((None, None, chip.address))
        if owner is not None:
            raise InputError(
                f"{place} chip {index} has the same address as {owner}, {chip.route}"
            )
        claimed[route] = f"chip {index}"
