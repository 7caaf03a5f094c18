"""A model as C99 for a microcontroller: `model.h` and `model.c` beside the files of
`export/c`, which hold no number of the model."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import ceil, pi
from operator import mul
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.early import stopping_rules
from edge.errors import InputError
from edge.model.info import ModelInfo
from edge.model.model import Model
from edge.touch import measures, transforms
from edge.touch.cells import KERNEL_CELLS, Cells
from edge.touch.contact import feature_types
from edge.touch.feature import Feature
from edge.touch.kernels import BIASES, mixes
from edge.touch.layout import SkinLayout
from edge.touch.zones import Zones
from export.c_graph import ELEMENT_WISE, CompiledGraph

ROOMS = Path(__file__).parent / "c"
RATE_HZ = 120.0
"""Frames a second for which there is room."""
CODE_BYTES = 16 * 1024
"""Of all rooms, by gcc 12 with -O2 for a Cortex-M0+."""
LARGEST = 2**63
"""No product of a frame's sums may reach it."""
MOST_SUMMED = 128
"""Samples beyond which numpy sums up in halves."""
QUANTITIES = {
    ("contact", "max_force"): "EC_REGION_PEAK",
    ("contact", "area"): "EC_REGION_AREA",
    ("contact", "motion"): "EC_CENTROID_MOTION",
    ("contact", "force_motion"): "EC_CENTRE_OF_FORCE_MOTION",
    ("skin", "taxel_kernels"): "EC_TAXEL_KERNELS",
    ("skin", "zone_kernels"): "EC_ZONE_KERNELS",
    ("skin", "taxel_force"): "EC_TAXEL_FORCE",
    ("arm", "joint_angle"): "EC_JOINT_ANGLE",
    ("arm", "joint_change"): "EC_JOINT_CHANGE",
}
"""{(zone, quantity): its name in C}, but for those that a zone's sums make."""
OF_ZONES = {"along": "ALONG_ROWS", "around": "AROUND_COLS", "width": "WIDTH_OF_ZONE"}
ROOTS = {"sqrt": "ROOT", "": "COURSE"}
C_TYPES = {
    "EC_INT8": "int8_t",
    "EC_INT16": "int16_t",
    "EC_INT32": "int32_t",
    "EC_FLOAT": "float",
    "EC_DOUBLE": "double",
}


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
    source = Source()
    scratch = _features(source, model.info, frames)
    windows_s = model.decision_points_s
    points = range(len(windows_s)) if error is not None else [len(windows_s) - 1]
    graph = CompiledGraph(
        model, list(model.outputs), points, arena=model.info.width + scratch
    )
    _skin(source, model.info, frames)
    source.define("POINTS", len(points))
    source.define("ARENA", graph.arena)
    source.array("const double", "ec_windows_s", [float(windows_s[i]) for i in points])
    source.ram += 8 * graph.arena
    _graph(source, graph)
    _tasks(source, model, graph.places, points, error)
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
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float | np.floating):
        suffix = "f" if isinstance(value, np.float32) else ""
        number = "INFINITY" if np.isinf(value) else float(value).hex() + suffix
        return f"(double){number}" if number == "INFINITY" and not suffix else number
    if isinstance(value, int | np.integer):
        return str(value)
    assert isinstance(value, Iterable)
    return f"{{{', '.join(map(literal, value))}}}"


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
    convolved = [
        name for name in ("taxel_kernels", "zone_kernels") if name in info.kernels
    ]
    source.define("CONVOLVED", len(convolved))
    for name in convolved:
        table = info.kernels[name]
        source.array("static const int8_t", f"shifts_of_{name}", table.shifts)
        source.array("static const int32_t", f"biases_of_{name}", table.biases)
        indices = [np.flatnonzero(mix) for mix in mixes(len(table.shifts))]
        mixed = [number for mix in indices for number in (len(mix), *mix.tolist())]
        source.array("static const uint8_t", f"mixes_of_{name}", mixed)
    for name in ("taxel_kernels", "zone_kernels"):
        fields = ["0", "0", "0", 0, [0] * 4]
        if name in info.kernels:
            fields = [f"{part}_of_{name}" for part in ("shifts", "biases", "mixes")]
            table = info.kernels[name]
            fields += [len(table.shifts), BIASES[len(table.biases)]]
        source.lines.append(f"const ec_kernels ec_{name} = {literal(fields)};")
    return largest + (len(measures.QUANTITIES) + 4) * frames


def _feature(
    feature: Feature, layout: SkinLayout, samples: int, rows: int
) -> list[Any]:
    """The `ec_feature` of a feature."""
    place = feature.zone, feature.quantity
    name = OF_ZONES.get(feature.quantity, feature.quantity.upper())
    quantity = QUANTITIES.get(place, f"EC_{name}")
    of_zone = place not in QUANTITIES
    zone = f"EC_{feature.zone.upper()}" if of_zone else "EC_NO_ZONE"
    kinds = [f"EC_{ROOTS.get(t, t.upper())}" for t in feature.transforms]
    floor = float(transforms.floor_of(feature, layout))
    summary = ROOTS.get(feature.summary, feature.summary.upper())
    kinds += ["EC_NO_TRANSFORM"] * (3 - len(kinds))
    return [floor, samples, rows, zone, quantity, kinds, f"EC_{summary}"]


def _skin(source: Source, info: ModelInfo, frames: int) -> None:
    """The skin, the arm and what is measured in every frame."""
    layout = info.layout
    types = feature_types(info.features)
    quantities = {feature.quantity for feature in types}
    zones = Zones(layout, types).names
    cells = Cells(layout)
    kernel_cells = Cells(layout, KERNEL_CELLS)
    along, around = layout.pitch
    values: dict[str, object] = {
        "ROWS": layout.rows,
        "COLS": layout.cols,
        "WRAPS": int(layout.wraps),
        "THRESHOLD": layout.threshold_counts,
        "ONSET": layout.onset,
        "DEBOUNCE": info.debounce,
        "RELEASE_S": float(layout.release_s),
        "WINDOW_S": float(info.window_s),
        "SCALE": float(layout.counts_per_newton or 1.0),
        "ALONG": float(along),
        "AROUND": float(around),
        "CYLINDER": int(layout.radius_m is not None),
        "RADIUS_M": float(layout.radius_m or 0.0),
        "ROW0_Z_M": float(layout.row0_z_m),
        "TURN": 2.0 * pi,
        "RADIANS": pi / 180.0,
        "COLUMN_ANGLES": int(layout.column_angles_deg is not None),
        "FORCE_FLOOR": float(transforms.force_floor(layout)),
        "LENGTH_FLOOR": float(transforms.length_floor(layout)),
        "FRAMES": frames,
        "MOTION": int("motion" in quantities),
        "FORCE_MOTION": int(not quantities.isdisjoint(("force_motion", "stiffness"))),
        "ZONES": len(zones),
        "CELLS": cells.count if "taxel_force" in quantities else 0,
        "KERNEL_CELLS": kernel_cells.count if "taxel_kernels" in quantities else 0,
        "JOINTS": info.joints,
        "DOF": info.chain.dof if info.chain else 0,
        "LINKS": len(info.chain.links) if info.chain else 0,
        "WIDTH": info.width,
        "ANGLES": info.dof or 0,
    }
    for name, value in values.items():
        source.define(name, value)
    counts = len(zones), info.joints, values["CELLS"], values["KERNEL_CELLS"]
    row = sum(map(mul, (64, 8, 4, 4), map(max, counts, (1, 1, 1, 1)))) + 32
    source.ram += frames * row + 8 * layout.rows * layout.cols + 2048
    source.work += 90 * frames * 100 * len(zones) + 3000 * info.width
    source.array("const bool", "ec_alive", layout.alive.reshape(-1))
    source.array(
        "const uint8_t",
        "ec_zone_names",
        [f"EC_{z.upper()}" for z in (*zones, "no_zone")],
    )
    source.array("const int16_t", "ec_cell_of_taxel", _of_taxels(layout, cells))
    source.array(
        "const int16_t", "ec_kernel_cell_of_taxel", _of_taxels(layout, kernel_cells)
    )
    angles = layout.column_angles_deg or (0.0,)
    steps = [(b - a + 180.0) % 360.0 - 180.0 for a, b in pairwise([*angles, angles[0]])]
    source.array("const ec_angle", "ec_angles", zip(angles, steps, strict=True))
    links = [] if info.chain is None else info.chain.links
    kinds = {"fixed": "EC_FIXED", "prismatic": "EC_PRISMATIC"}
    rows = [
        [axis, [x for row in step for x in row], after, kinds.get(kind, "EC_REVOLUTE")]
        for kind, axis, step, after in links
    ]
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
    source.define("STEPS", len(graph.steps))
    tables = []
    for i, table in enumerate(graph.tables):
        source.array(
            f"static const {C_TYPES[table.kind]}", f"t{i}", table.values.reshape(-1)
        )
        source.flash += table.values.nbytes
        by_point = table.values.ndim - 1
        tables.append([f"t{i}", table.values.shape[-1], table.kind, by_point])
    source.array("const ec_table", "ec_tables", tables)
    steps = [
        [f"EC_{s.operator.upper()}", s.points, s.inputs, s.outputs, s.sizes]
        for s in graph.steps
    ]
    source.array("const ec_step", "ec_steps", steps)
    source.flash += 44 * len(steps)
    for step in graph.steps:
        first, second, *_ = (*step.sizes, 1)
        if step.operator == "Gemm":
            source.work += 12 * first * second
        else:
            alone = step.operator in ELEMENT_WISE
            source.work += 200 * first * (1 if alone else max(second, 1))


def _tasks(
    source: Source,
    model: Model,
    places: Mapping[str, int],
    points: Sequence[int],
    error: float | None,
) -> None:
    """The tasks, their labels and their calibration."""
    info = model.info
    names = list(info.tasks)
    rules = {} if error is None else stopping_rules(model, error)
    source.define("TASKS", len(names))
    source.define("MOST_LABELS", max(len(task.labels) for task in info.tasks.values()))
    source.define("CALIBRATED", int(info.novelty is not None))
    source.define("EARLY", int(error is not None))
    for output in ("out_of_range", "novelty", "remoteness"):
        source.define(f"PLACE_{output.upper()}", places.get(output, 0))
    rows: list[list[object]] = []
    for name, task in info.tasks.items():
        stopping = info.stopping.get(name)
        curves: list[tuple[float, ...]] = [(0.0, 0.0, 0.0)]
        whole = curves[0]
        if stopping is not None:
            of_points = stopping.slopes, stopping.intercepts, stopping.doubts
            curves = [tuple(column[i] for column in of_points) for i in points]
            whole = stopping.slope, stopping.intercept, stopping.doubt
        source.array("static const ec_curve", f"curves_of_{len(rows)}", floats(curves))
        factors = list(task.factors.items())
        for i in range(2):
            indices = factors[i][1] if factors else []
            source.array("static const uint8_t", f"indices_{i}_of_{len(rows)}", indices)
        rule = rules.get(name)
        of_rule = (0.0, 0) if rule is None else (float(rule.confidence), rule.last)
        ends = "label scores distances neighbours label_distances".split()
        rows.append(
            [
                f"curves_of_{len(rows)}",
                floats(whole),
                of_rule[0],
                [f"indices_{i}_of_{len(rows)}" for i in range(2)],
                *(places.get(f"{name}_{end}", 0) for end in ends),
                len(task.labels),
                task.k,
                [names.index(factor) for factor, _ in factors] or [0, 0],
                of_rule[1],
                rule is not None,
                bool(factors),
            ]
        )
    source.array("const ec_task", "ec_tasks", rows)
    order = sorted(range(len(names)), key=lambda i: bool(info.tasks[names[i]].factors))
    source.array("const uint8_t", "ec_order", order)
    _labels(source, info)
    _doubts(source, info, points)


def _labels(source: Source, info: ModelInfo) -> None:
    """The names of tasks and labels."""
    for i, task in enumerate(info.tasks.values()):
        labels = map(quoted, task.labels)
        source.array("static const char *const", f"labels_of_{i}", labels)
    lists = [f"labels_of_{i}" for i in range(len(info.tasks))]
    source.array("const char *const *const", "ec_labels", lists)
    source.array("const char *const", "ec_task_names", map(quoted, info.tasks))


def _doubts(source: Source, info: ModelInfo, points: Sequence[int]) -> None:
    """The limits of novelty and remoteness at the decision points."""
    novelty = info.novelty
    naming = [name for name, s in info.stopping.items() if s.remoteness is not None]
    remoteness = info.stopping[naming[0]].remoteness if naming else None
    source.define("NAMING", [*info.tasks].index(naming[0]) if naming else 255)
    for name, table in (
        ("typical", novelty and novelty.typical),
        ("novel", novelty and novelty.limits),
        ("remote", remoteness and remoteness.limits),
        ("middles", remoteness and remoteness.middles),
        ("known_slopes", remoteness and remoteness.slopes),
    ):
        values = [float(table[i]) for i in points] if table else []
        source.array("const double", f"ec_{name}", values)


def quoted(text: str) -> str:
    """A text as a literal of C; what is not ASCII, as the bytes of UTF-8."""
    codes = (f"\\{byte:03o}" for byte in text.encode())
    return '"' + "".join(codes) + '"'


def floats(values: Any) -> Any:
    """Nested numbers as floats."""
    if isinstance(values, Sequence):
        return [floats(value) for value in values]
    return float(values)
