"""A model as C99 for a microcontroller: `model.h` and `model.c` beside the files of
`export/c`, which hold no number of the model."""

from __future__ import annotations

import os
import shutil
import string
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import ceil, prod
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.early import stopping_rules
from edge.errors import InputError
from edge.model.info import ModelInfo, StoppingRule
from edge.model.model import Model
from edge.touch import measures, transforms
from edge.touch.cells import KERNEL_CELLS, Cells
from edge.touch.contact import feature_types
from edge.touch.feature import Feature
from edge.touch.kernels import BIASES, KernelTable, mixes
from edge.touch.layout import SkinLayout
from edge.touch.zones import Zones
from export.c_graph import CompiledGraph

ROOMS = Path(__file__).parent / "c"
RATE_HZ = 120.0
"""Frames a second for which there is room."""
CODE_BYTES = 16 * 1024
"""Of all rooms, by gcc 12 with -O2 for a Cortex-M0+."""
LARGEST = 2**63
"""No product of a frame's sums may reach it."""
MOST_SUMMED = 128
"""Samples beyond which numpy sums up in halves."""
ALONE = {*measures.ALONE.values(), ("contact", "area")} - {("skin", "stiffness")}
"""(zone, quantity) that need no sums of a zone."""
TYPES_IN_C = {
    "int8": "int8_t",
    "int16": "int16_t",
    "int32": "int32_t",
    "float32": "float",
    "float64": "double",
}
ENDS = "label scores distances neighbours label_distances".split()
OF_LAYOUT = "rows cols wraps threshold_counts onset release_s radius_m row0_z_m".split()
OF_INFO = "debounce window_s width joints dof".split()
"""Attributes that are constants of the preprocessor, by their names."""


def write(
    model: Model,
    folder: str | os.PathLike[str],
    error: float | None = None,
    frames: int | None = None,
) -> Source:
    """Write a model's C.

    Args:
        model: the model.
        folder: that is made.
        error: the accepted share of wrong decisions, for early ones; None decides at
            the full window, and leaves out the tables of the other decision points.
        frames: the most frames of a contact within the window; `RATE_HZ` where None.

    Returns:
        What was written, with its size.

    Raises:
        InputError: C lacks something that the model needs, or the error rate is not
            certified.
    """
    for reason in lacks(model.info):
        raise InputError(f"{model.path}: cannot be written in C, as {reason}")
    frames = frames or ceil(model.info.window_s * RATE_HZ) + 4
    last = len(model.decision_points_s) - 1
    points = [last] if error is None else [*range(last + 1)]
    source = Source()
    scratch = _features(source, model.info, frames)
    _kernels(source, model.info)
    least = model.info.width + scratch
    graph = CompiledGraph(model, points, least)
    source.ram = 8 * graph.arena
    source.define("ARENA", graph.arena)
    _skin(source, model.info, frames)
    _geometry(source, model.info)
    _graph(source, graph)
    windows_s = [model.decision_points_s[point] for point in points]
    source.define("POINTS", len(points))
    source.array("const double", "ec_windows_s", floats(windows_s))
    rules = {} if error is None else stopping_rules(model, error)
    _tasks(source, model.info, graph.places, points, rules)
    _limits(source, model.info, points)
    source.define("EARLY", error is not None)
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for file in ROOMS.iterdir():
        shutil.copy(file, target)
    (target / "model.h").write_text(source.header())
    (target / "model.c").write_text(source.text())
    return source


def export(
    model: Model,
    folder: str | os.PathLike[str],
    error: float | None,
    flash_kb: int | None,
) -> str:
    """Write a model's C, and say how large it is, and what was left out for that.

    Args:
        model: the model.
        folder: that is made.
        error: as for `write`.
        flash_kb: kilobytes that tables and code may take.

    Raises:
        InputError: as `write`; or it is larger even without early decisions.
    """
    left_out = ""
    source = write(model, folder, error)
    limit = 1024 * flash_kb if flash_kb else source.flash
    if source.flash > limit and error is not None:
        left_out = "; early decisions are left out to fit --flash"
        source = write(model, folder, None)
    if source.flash > limit:
        raise InputError(
            f"{model.path}: takes {source.flash / 1024:.0f} kB of flash in C, above "
            "--flash; export fewer features or recordings"
        )
    millions = source.work / 1e6
    return (
        f"{os.fspath(folder)}: {source.flash / 1024:.0f} kB of flash, "
        f"{source.ram / 1024:.0f} kB of RAM, a decision in about {millions:.1f} million "
        f"instructions of a Cortex-M4F ({millions / 0.064:.0f} ms at 64 MHz) or "
        f"{2.2 * millions:.1f} million of a Cortex-M0+ ({2.2 * millions / 0.133:.0f} ms "
        f"at 133 MHz){left_out}"
    )


class Source:
    """Definitions of a model in C.

    Attributes:
        flash: bytes of code and tables.
        ram: bytes.
        work: instructions of a decision on a Cortex-M4F, about.
    """

    def __init__(self) -> None:
        self.defines: dict[str, str] = {}
        self.lines: list[str] = []
        self.flash = CODE_BYTES
        self.ram = 0
        self.work = 0

    def define(self, name: str, value: object) -> None:
        """A constant of the preprocessor."""
        self.defines[f"EC_{name}"] = literal(value)

    def array(self, kind: str, name: str, values: Iterable[object]) -> None:
        """A constant array; it has one element where it would have none."""
        inside = ", ".join(map(literal, values)) or "0"
        self.lines.append(f"{kind} {name}[] = {{{inside}}};")

    def header(self) -> str:
        """The text of `model.h`."""
        lines = [f"#define {name} {value}" for name, value in self.defines.items()]
        return "\n".join(
            ["#ifndef EC_MODEL_H", "#define EC_MODEL_H", *lines, "#endif", ""]
        )

    def text(self) -> str:
        """The text of `model.c`."""
        return "\n".join(['#include "internal.h"', "", *self.lines, ""])


def literal(value: object) -> str:
    """A value in C: hexadecimal floats hold every bit."""
    if isinstance(value, str):
        return value
    if isinstance(value, float | np.floating):
        if np.isinf(value):
            return "(double)INFINITY"
        return float(value).hex() + "f" * isinstance(value, np.float32)
    if isinstance(value, Iterable):
        return f"{{{', '.join(map(literal, value))}}}"
    return str(int(value))  # type: ignore[call-overload]


def lacks(info: ModelInfo) -> Iterable[str]:
    """What C lacks for a model, as sentences."""
    layout = info.layout
    types = feature_types(info.features)
    if layout.axes or any(f.quantity in measures.SHEAR for f in types):
        yield "it takes no shear"
    total = layout.rows * layout.cols * 65535
    if (total * max(2 * layout.cols, layout.rows)) ** 2 >= LARGEST:
        yield f"the sums of {layout.rows} x {layout.cols} taxels exceed 64 bits"
    for feature in types:
        summed = feature.summary in ("mean", "deviation", "roughness")
        if summed and (feature.samples or info.samples) > MOST_SUMMED:
            yield f"{feature.name} sums up more than {MOST_SUMMED} samples"


def _features(source: Source, info: ModelInfo, frames: int) -> int:
    """The features; how many doubles they are measured in."""
    layout = info.layout
    types = feature_types(info.features)
    rows = []
    largest = 0
    for feature, width in zip(types, info.widths, strict=True):
        samples = feature.kernels or feature.samples or info.samples
        summed = feature.summary not in ("", "rate")
        count = width if summed else width // samples
        largest = max(largest, summed * count * samples)
        rows.append(_feature(feature, layout, samples, count))
    source.define("FEATURES", len(rows))
    source.array("const ec_feature", "ec_features", rows)
    return largest + (len(measures.QUANTITIES) + 4) * frames


def _kernels(source: Source, info: ModelInfo) -> None:
    """The tables of the features that are made of kernels."""
    for name in ("taxel_kernels", "zone_kernels"):
        table = info.kernels.get(name, KernelTable((), ()))
        channels = len(table.shifts)
        flat = []
        for mix in mixes(channels) if channels else ():
            flat += [int(mix.sum()), *np.flatnonzero(mix).tolist()]
        source.array("static const int8_t", f"shifts_of_{name}", table.shifts)
        source.array("static const int32_t", f"biases_of_{name}", table.biases)
        source.array("static const uint8_t", f"mixes_of_{name}", flat)
        parts = [f"{part}_of_{name}" for part in ("shifts", "biases", "mixes")]
        fields = [*parts, channels, BIASES.get(len(table.biases), (0,))]
        source.lines.append(f"const ec_kernels ec_{name} = {literal(fields)};")


def _feature(
    feature: Feature, layout: SkinLayout, samples: int, rows: int
) -> list[Any]:
    """The `ec_feature` of a feature."""
    alone = (feature.zone, feature.quantity) in ALONE
    of_region = "REGION_" * (alone and feature.zone == "contact")
    quantity = f"EC_Q_{of_region}{feature.quantity.upper()}"
    zone = "EC_NO_ZONE" if alone else f"EC_{feature.zone.upper()}"
    kinds = [f"EC_T_{kind.upper()}" for kind in (*feature.transforms, *["none"] * 3)]
    floor = float(transforms.floor_of(feature, layout))
    summary = f"EC_S_{feature.summary.upper()}"
    return [floor, samples, rows, zone, quantity, kinds[:3], summary]


def _skin(source: Source, info: ModelInfo, frames: int) -> None:
    """The skin, and what is measured in every frame."""
    layout = info.layout
    types = feature_types(info.features)
    quantities = {feature.quantity for feature in types}
    zones = Zones(layout, types).names
    cells = Cells(layout)
    kernel_cells = Cells(layout, KERNEL_CELLS)
    pooled = cells.count * ("taxel_force" in quantities)
    pooled_for_kernels = kernel_cells.count * ("taxel_kernels" in quantities)
    spreads = not quantities.isdisjoint(measures.QUANTITIES[6:])
    row = 72 + 64 * max(len(zones), 1) + 8 * info.joints
    row += 4 * (pooled + pooled_for_kernels)
    source.ram += frames * row + 8 * layout.alive.size + 2048
    source.work += (12000 if spreads else 4000) * frames * len(zones)
    source.work += 2500 * info.width
    source.define("FRAMES", frames)
    source.define("ZONES", len(zones))
    source.define("CELLS", pooled)
    source.define("KERNEL_CELLS", pooled_for_kernels)
    source.define("MOTION", "motion" in quantities)
    source.define("SPREADS", spreads)
    by_force = quantities & {"force_motion", "stiffness"}
    source.define("FORCE_MOTION", bool(by_force))
    zone_names = [f"EC_{name.upper()}" for name in (*zones, "no_zone")]
    source.array("const uint8_t", "ec_zone_names", zone_names)
    numbers = _of_taxels(layout, cells)
    source.array("const int16_t", "ec_cell_of_taxel", numbers)
    numbers = _of_taxels(layout, kernel_cells)
    source.array("const int16_t", "ec_kernel_cell_of_taxel", numbers)


def _geometry(source: Source, info: ModelInfo) -> None:
    """Where the taxels lie, on which arm, and the scale of their counts."""
    layout = info.layout
    for owner, names in ((layout, OF_LAYOUT), (info, OF_INFO)):
        for name in names:
            source.define(name.upper(), getattr(owner, name) or 0)
    along, around = layout.pitch
    source.define("ALONG", float(along))
    source.define("AROUND", float(around))
    source.define("SCALE", float(layout.counts_per_newton or 1.0))
    source.define("FORCE_FLOOR", float(transforms.force_floor(layout)))
    source.define("LENGTH_FLOOR", float(transforms.length_floor(layout)))
    source.array("const bool", "ec_alive", layout.alive.reshape(-1))
    angles = layout.column_angles_deg or (0.0,)
    steps = [(b - a + 180.0) % 360.0 - 180.0 for a, b in pairwise([*angles, angles[0]])]
    source.define("COLUMN_ANGLES", len(angles) > 1)
    source.array("const ec_angle", "ec_angles", zip(angles, steps, strict=True))
    rows = []
    for kind, axis, step, after in info.chain.links if info.chain else ():
        name = {"fixed": "FIXED", "prismatic": "PRISMATIC"}.get(kind, "REVOLUTE")
        rows.append(floats([axis, np.ravel(step), after, f"EC_{name}"]))
    source.define("LINKS", len(rows))
    source.array("const ec_link", "ec_links", rows or ["{{0}, {0}, {0}, 0}"])


def _of_taxels(layout: SkinLayout, cells: Cells) -> Array:
    """(taxels,) the cell that each belongs to; -1 where it has no living taxel."""
    rows, cols = np.indices(layout.shape) // cells.side
    blocks = (rows * layout.cols + cols).reshape(-1)
    living = np.unique(blocks[layout.alive.reshape(-1)])
    numbers = living.searchsorted(blocks)
    return np.where(np.isin(blocks, living), numbers, -1)


def _graph(source: Source, graph: CompiledGraph) -> None:
    """The steps and the tables of the graph."""
    tables = []
    for i, table in enumerate(graph.tables):
        kind = table.dtype.name
        source.array(f"static const {TYPES_IN_C[kind]}", f"t{i}", table.reshape(-1))
        source.flash += table.nbytes
        by_point = table.ndim - 1
        tables.append([f"t{i}", table.shape[-1], f"EC_{kind.upper()}", by_point])
    steps = []
    for s in graph.steps:
        steps.append([f"EC_{s.operator.upper()}", s.inputs, s.outputs, s.sizes])
        is_product = s.operator == "Gemm"
        source.work += 16 * prod(s.sizes[:2]) if is_product else 400 * max(s.sizes)
    source.flash += 44 * len(steps)
    source.define("STEPS", len(steps))
    source.array("const ec_table", "ec_tables", tables)
    source.array("const ec_step", "ec_steps", steps)


def _tasks(
    source: Source,
    info: ModelInfo,
    places: Mapping[str, int],
    points: Sequence[int],
    rules: Mapping[str, StoppingRule | None],
) -> None:
    """The tasks, their labels and their calibration."""
    names = list(info.tasks)
    rows = []
    for i, name in enumerate(names):
        labels = map(quoted, info.tasks[name].labels)
        source.array("static const char *const", f"labels_of_{i}", labels)
        row = [*_calibration(source, info, name, points), *_rule(rules.get(name))]
        places_of_task = [places.get(f"{name}_{end}", 0) for end in ENDS]
        rows.append([*row, places_of_task, *_product(source, info, name)])
    source.array("const ec_task", "ec_tasks", rows)
    source.define("TASKS", len(names))
    source.define("MOST_LABELS", max(len(task.labels) for task in info.tasks.values()))
    for output in ("out_of_range", "novelty", "remoteness"):
        source.define(f"PLACE_{output.upper()}", places.get(output, 0))
    order = sorted(range(len(names)), key=lambda i: bool(info.tasks[names[i]].factors))
    source.array("const uint8_t", "ec_order", order)
    lists = [f"labels_of_{i}" for i in range(len(names))]
    source.array("const char *const *const", "ec_labels", lists)
    source.array("const char *const", "ec_task_names", map(quoted, names))


def _rule(rule: StoppingRule | None) -> list[Any]:
    return [0.0, 0, False] if rule is None else [rule.confidence, rule.last, True]


def _product(source: Source, info: ModelInfo, name: str) -> list[Any]:
    """Of a task: its size, its factors, and their label of each of its labels."""
    names = list(info.tasks)
    task = info.tasks[name]
    arrays = []
    for j, indices in enumerate((*task.factors.values(), (), ())[:2]):
        arrays.append(f"indices_{j}_of_{names.index(name)}")
        source.array("static const uint8_t", arrays[-1], indices)
    factors = [*map(names.index, task.factors), 0, 0][:2]
    return [len(task.labels), task.k, arrays, factors, bool(task.factors)]


def _calibration(
    source: Source,
    info: ModelInfo,
    name: str,
    points: Sequence[int],
) -> list[Any]:
    """The curves of a task: the name of those of the decision points, and the rules'."""
    array = f"curves_of_{[*info.tasks].index(name)}"
    columns: Sequence[Sequence[float]] = ((0.0,),) * 3
    whole = [0.0] * 3
    stopping = info.stopping.get(name)
    if stopping is not None:
        columns = stopping.slopes, stopping.intercepts, stopping.doubts
        whole = [stopping.slope, stopping.intercept, stopping.doubt]
    curves = [[column[point] for column in columns] for point in points]
    source.array("static const ec_curve", array, floats(curves))
    return [array, floats(whole)]


def _limits(source: Source, info: ModelInfo, points: Sequence[int]) -> None:
    """The limits of novelty and remoteness at the decision points."""
    naming = 255
    limits: dict[str, Any] = {}
    if info.novelty is not None:
        limits |= {"typical": info.novelty.typical, "novel": info.novelty.limits}
    for i, name in enumerate(info.tasks):
        stopping = info.stopping.get(name)
        if stopping is not None and stopping.remoteness is not None:
            naming = i
            limits |= vars(stopping.remoteness) | {"remote": stopping.remoteness.limits}
    for name in ("typical", "novel", "remote", "middles", "slopes"):
        values = [limits[name][point] for point in points if name in limits]
        source.array("const double", f"ec_{name}", floats(values))
    source.define("NAMING", naming)
    source.define("CALIBRATED", info.novelty is not None)


def quoted(text: str) -> str:
    """A text as a literal of C: ASCII, and other bytes of UTF-8 by their numbers."""
    plain = set(string.ascii_letters + string.digits + " -_.,:;()/+").__contains__
    codes = (chr(b) if plain(chr(b)) else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join(codes) + '"'


def floats(values: Any) -> Any:
    """Nested numbers as floats; texts stay."""
    if isinstance(values, str):
        return values
    if isinstance(values, Iterable):
        return [floats(value) for value in values]
    return float(values)
