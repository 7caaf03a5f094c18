"""A model as C99 for a microcontroller: the files of `export/c`, of which `model.h` and
`model.c` take the model's numbers."""

from __future__ import annotations

import math
import os
import re
import string
from collections.abc import Iterable, Mapping, Sized
from contextlib import ExitStack
from math import inf
from pathlib import Path

import numpy as np

from edge.arrays import Array, Floats
from edge.decide.doubts import GAP_S, PERIODS
from edge.decide.early import stopping_rules
from edge.decide.info import ModelInfo, Novelty, Remoteness, StoppingRule
from edge.decide.model import Model
from edge.elementary import log, logistic, sin
from edge.errors import InputError
from edge.features.cells import KERNEL_CELLS, Cells
from edge.features.kernels import BIASES, CONVOLUTIONS, KernelTable, mixes
from edge.features.names import feature_types, zones_of
from edge.features.quantities import ALONE, OF_ZONES, force_floor, length_floor
from edge.touch.layout import SkinLayout
from edge.writing import write_whole
from export.c_graph import CompiledGraph, Step

ROOMS = Path(__file__).parent / "c"
CODE_BYTES = 28 * 1024
"""Of all rooms, with small tables and the arithmetic of doubles, by gcc 12 with -O2 for a
Cortex-M0+."""
KERNEL_BYTES = 4608
"""Of the code of kernels, and of the channels that each sums up."""
COSTS = {
    "task": (14000, 27000),
    "convolution": (6600, 8900),
    "root": (1340, 3100),
    "row": (704, 1365),
    "product": (12.8, 49.3),
    "number": (301, 776),
}
"""Instructions of a Cortex-M4F and of a Cortex-M0+ for the parts of a decision, fitted
to what QEMU counted: roots and logarithms of values, rows of projections, products of
matrices, and numbers that other steps of the graph take."""
REST_OF_RAM = 2048 + 2100
"""Of the stack, and of what does not depend on the model."""
LONG_STEP_S = 0.95 * GAP_S / PERIODS
"""No usual step of at most this time makes a longer pause usual."""
LARGEST = 2**63
"""No product of a frame's sums may reach it."""
MOST_SUMMED = 128
"""Samples beyond which numpy sums up in halves."""
TYPE_OF = {"palette": "uint8", "packed": "uint8"}
"""The types of tables that are no types of C."""
PROBE = 0.3
PROBES = 8
DOUBTS = ("novelty", "remoteness")
FLAGS = ("out_of_range", *DOUBTS)
"""Outputs of the model that are of no task."""
SPECIAL = re.compile(r"[^\w -]", re.ASCII)
"""Letters that may mean something else in C."""
ENDS = "label scores distances neighbours label_distances".split()
OF_LAYOUT = "rows cols wraps threshold_counts onset release_s radius_m row0_z_m".split()
OF_INFO = "debounce window_s width joints dof".split()
"""Attributes that are constants of the preprocessor, by their names."""


def export(
    model: Model,
    folder: str | os.PathLike[str],
    error: float | None = None,
    flash_kb: int | None = None,
) -> str:
    """Write a model's C, and say how large it is, and what was left out for that.

    Args:
        model: the model.
        folder: that is made.
        error: the accepted share of wrong decisions, for early ones; None decides at
            the full window, and leaves out the tables of the other decision points.
        flash_kb: kilobytes that tables and code may take. What does not fit leaves out
            early decisions first, then novelty.

    Raises:
        InputError: C lacks something that the model needs, the error rate is not
            certified, the least that can be written is larger than `flash_kb`, or the
            folder cannot be written.
    """
    left_out = ""
    source = Source(model, error)
    limit = 1024 * (flash_kb or inf)
    if source.flash > limit and error is not None:
        left_out += "; early decisions are left out to fit --flash"
        source = Source(model)
    if source.flash > limit and model.info.novelty is not None:
        left_out += (
            "; novelty is left out to fit --flash: nothing is unusual or unknown, and "
            "confidence is that of a usual touch"
        )
        source = Source(model, doubts=False)
    if source.flash > limit:
        raise InputError(
            f"{model.path}: takes {source.flash / 1024:.0f} kB of flash in C, above "
            "--flash; export fewer features or recordings"
        )
    source.write(Path(folder))
    fast, slow = source.instructions() / 1e6
    return (
        f"{os.fspath(folder)}: {source.flash / 1024:.0f} kB of flash, "
        f"{source.ram / 1024:.0f} kB of RAM, a decision in about {fast:.1f} million "
        f"instructions of a Cortex-M4F ({fast / 0.064:.0f} ms at 64 MHz) or "
        f"{slow:.1f} million of a Cortex-M0+ ({slow / 0.133:.0f} ms at 133 MHz){left_out}"
    )


class Source:
    """A model in C.

    Attributes:
        values: what stands for the names in the rooms' `model.h` and `model.c`.
        flash: bytes of code and tables.
        ram: bytes.
        work: of a decision, how much there is of each of `COSTS`.
    """

    def __init__(
        self, model: Model, error: float | None = None, doubts: bool = True
    ) -> None:
        """Make all values.

        Args:
            model: the model.
            error: as for `export`.
            doubts: with novelty and remoteness.

        Raises:
            InputError: as `export`.
        """
        for reason in lacks(model.info):
            raise InputError(f"{model.path}: cannot be written in C, as {reason}")
        self._info = model.info
        self._layout = model.info.layout
        self._types = feature_types(model.info.features)
        windows_s = model.decision_points_s
        self._last = len(windows_s) if error is not None else 1
        self._zones = zones_of(self._types)
        self.values: dict[str, object] = {
            "early": error is not None,
            "windows_s": windows_s[-self._last :],
            "long_step_s": LONG_STEP_S,
            "repeats": int(model.info.repeats),
            **quantities_in_c(),
            "long_steps": int(model.info.window_s / LONG_STEP_S) + 2,
        }
        for owner, names in ((self._layout, OF_LAYOUT), (self._info, OF_INFO)):
            self.values |= {name: getattr(owner, name) or 0 for name in names}
        self.flash = CODE_BYTES
        self.ram = 0
        self.work: dict[str, float] = dict.fromkeys(COSTS, 0.0)
        self.work["task"] += len(model.info.tasks)
        outputs = set(model.info.outputs) - set(() if doubts else DOUBTS)
        points = range(len(windows_s))[-self._last :]
        room = self._info.width + self._features()
        graph = CompiledGraph(model, outputs, points, room)
        self._skin()
        self._geometry()
        self._graph(graph)
        rules = {} if error is None else stopping_rules(model, error)
        self._tasks(graph.places, rules)
        self._limits(doubts)
        self.values["checksum"] = str(checksum(model) if graph.steps else 0)

    def instructions(self) -> Floats:
        """(2,) about how many a decision takes on each processor of `COSTS`."""
        amounts = np.array(list(self.work.values()))
        return np.asarray(amounts @ np.array(list(COSTS.values())))

    def write(self, folder: Path) -> None:
        """Write all files, whole or not at all."""
        values = {}
        for name, value in self.values.items():
            values[name] = literal(value)
            if isinstance(value, Sized):
                values[f"{name}_count"] = str(len(value))
        write_rooms(ROOMS, folder, values)

    def _features(self) -> int:
        """The `ec_course` and the `ec_feature` of each feature, and the tables of the
        kernels, from which some are computed; how many doubles summaries take."""
        courses: dict[tuple[object, ...], int] = {}
        places = [0]
        rows = []
        summed = 0
        for feature, width in zip(self._types, self._info.widths, strict=True):
            samples = feature.samples or self._info.samples
            sums_up = feature.summary not in ("", "rate")
            count = width if sums_up else width // samples
            quantity = feature.quantity
            zone = 0 if quantity.zone else self._zones.index(feature.zone)
            course = samples, count, zone, quantity.code.replace("CHANGE", "ANGLE")
            if quantity.kernels:
                self.work["convolution"] += CONVOLUTIONS
            elif course not in courses:
                courses[course] = len(courses)
                places.append(places[-1] + samples * count)
            if sums_up:
                together = count if "relative" in feature.transforms else 1
                summed = max(summed, samples * together)
            roots = {"log", "sqrt"}.intersection(feature.transforms)
            self.work["root"] += (samples * count * len(roots)) * (not quantity.kernels)
            row = [
                quantity.floor(self._layout),
                courses.get(course, 0),
                quantity.code,
                [f"EC_T_{kind.upper()}" for kind in feature.transforms],
                f"EC_S_{feature.summary.upper()}",
            ]
            rows.append(row)
        fields = [[*c, place] for c, place in zip(courses, places, strict=False)]
        self.values |= {"features": rows, "courses": fields, "value_count": places[-1]}
        self.ram += self._last * 8 * places[-1]
        for name in ("taxel_kernels", "zone_kernels"):
            table = self._info.kernels.get(name, KernelTable((), ()))
            self.values[name] = kernel_fields(table)
            if table.shifts:
                self.flash += KERNEL_BYTES + 4 * len(table.biases)
        return summed

    def _skin(self) -> None:
        """The skin, and what is measured in every frame."""
        layout = self._layout
        used = [feature.quantity for feature in self._types]
        quantities = {quantity.name for quantity in used}
        motions = {quantity.motion for quantity in used}
        cells = Cells(layout)
        kernel_cells = Cells(layout, KERNEL_CELLS)
        pooled = cells.count * ("taxel_force" in quantities)
        pooled_for_kernels = kernel_cells.count * ("taxel_kernels" in quantities)
        zone_channels = 8 * len(self._zones) * ("zone_kernels" in quantities)
        zones = max(len(self._zones), 1)
        unsure = 2 * len(self._zones) + 3 + self._info.joints
        row = 40 + 8 * max(self._info.joints, 1) + 121 * zones + 8 * unsure
        row += 4 * max(pooled, 1) + 4 * max(pooled_for_kernels, 1)
        self.ram += 4 * row + 48 * unsure + 9 * layout.alive.size
        self.ram += self._last * 240 * (zone_channels + pooled_for_kernels)
        self.values |= {
            "cells": pooled,
            "kernel_cells": pooled_for_kernels,
            "zone_channels": zone_channels,
            "channels": zone_channels + pooled_for_kernels,
            "motion": "motion" in motions,
            "centroids": not quantities.isdisjoint(("along", "around")),
            "spreads": any("SPREAD" in (quantity.c or "") for quantity in used),
            "force_motion": "force_motion" in motions,
            "zone_names": [f"EC_{name.upper()}" for name in (*self._zones, "no_zone")],
            "cell_of_taxel": _of_taxels(layout, cells) if pooled else (),
            "kernel_cell_of_taxel": (
                _of_taxels(layout, kernel_cells) if pooled_for_kernels else ()
            ),
        }

    def _geometry(self) -> None:
        """Where the taxels lie, on which arm, and the scale of their counts."""
        layout = self._layout
        along, around = layout.pitch
        angles = layout.column_angles_deg or (0.0,)
        steps = (np.diff([*angles, angles[0]]) + 180.0) % 360.0 - 180.0
        links = []
        chain = self._info.chain
        for kind, axis, step, after in chain.links if chain else ():
            links.append([axis, np.ravel(step), after, f"EC_{kind.upper()}"])
        joints = self._info.joints
        ranges = [*(chain.limits if chain else ()), *[None] * joints]
        still_s = [*self._info.still_s, *[inf] * joints]
        limits = list(zip(ranges, still_s, strict=False))[:joints]
        self.values |= {
            "limits": [[*(span or (-inf, inf)), still] for span, still in limits],
            "along": along,
            "around": around,
            "scale": float(layout.counts_per_newton or 1.0),
            "force_floor": force_floor(layout),
            "length_floor": length_floor(layout),
            "column_angles": len(angles) > 1,
            "alive": layout.alive.reshape(-1),
            "angles": zip(angles, steps, strict=True),
            "links": links,
        }

    def _graph(self, graph: CompiledGraph) -> None:
        """The steps and the tables of the graph."""
        tables = []
        for table in graph.tables:
            kind = TYPE_OF.get(table.type, table.type)
            values = array(f"{kind}_t", table.data.reshape(-1))
            palette = array("double", table.palette) if table.palette.size else 0
            stride = (table.data.ndim - 1) * table.data.shape[-1]
            code = f"EC_{table.type.upper()}"
            tables.append([values, palette, stride, table.columns, code, table.shift])
            self.flash += table.nbytes
        steps = []
        for step in graph.steps:
            self._weigh(step, graph)
            steps.append([step.inputs, step.outputs, step.sizes, step.operator])
        most_columns = max((table.columns for table in graph.tables), default=0)
        self.flash += 26 * len(graph.steps) + 20 * len(graph.tables)
        self.ram += 8 * (graph.arena + most_columns) + REST_OF_RAM
        self.values |= {
            "arena": graph.arena,
            "ram": self.ram,
            "tables": tables,
            "steps": steps,
            "most_columns": most_columns,
        }

    def _weigh(self, step: Step, graph: CompiledGraph) -> None:
        """Count the work of a step."""
        size, along, behind, count = [*step.sizes, 1, 1, 1][:4]
        if step.operator == "EC_PROJECT":
            self.work["row"] += along
            count = graph.tables[step.inputs[3] - graph.arena].columns
        if step.operator in ("EC_PROJECT", "EC_GEMM", "EC_MATMUL"):
            self.work["product"] += along * count
        elif step.operator.startswith(("EC_REDUCE", "EC_TOPK")):
            self.work["number"] += size * along * behind
        elif step.operator.startswith("EC_GATHER"):
            self.work["number"] += size * behind * count
        else:
            self.work["number"] += size

    def _tasks(
        self, places: Mapping[str, int], rules: Mapping[str, StoppingRule | None]
    ) -> None:
        """The tasks, their labels and their calibration."""
        tasks = self._info.tasks
        names = list(tasks)
        rows = []
        labels = []
        for name, task in tasks.items():
            rule = rules.get(name)
            indices = [array("uint8_t", column) for column in task.factors.values()]
            row = [
                *self._curves(name),
                *((rule.confidence, rule.last, True) if rule else (0, 0, False)),
                [places.get(f"{name}_{end}", 0) for end in ENDS],
                len(task.labels),
                task.k,
                indices,
                [names.index(factor) for factor in task.factors],
            ]
            rows.append(row)
            labels.append(array("char *const", map(quoted, task.labels)))
        self.values |= {f"place_{name}": places.get(name, 0) for name in FLAGS}
        self.values |= {
            "most_labels": max(len(task.labels) for task in tasks.values()),
            "tasks": rows,
            "labels": labels,
            "task_names": map(quoted, names),
        }

    def _curves(self, task: str) -> list[object]:
        """The curves of a task: those of the decision points, and that of the rules."""
        stopping = self._info.stopping.get(task)
        if stopping is None:
            return [0, (0, 0, 0)]
        curves = zip(stopping.slopes, stopping.intercepts, stopping.doubts, strict=True)
        rules = stopping.slope, stopping.intercept, stopping.doubt
        return [array("ec_curve", [*curves][-self._last :]), rules]

    def _limits(self, doubts: bool) -> None:
        """The limits of novelty and remoteness at the decision points; without doubts
        no score is beyond them."""
        info = self._info
        novelty = info.novelty or Novelty((), ())
        far = Remoteness((), (), ())
        naming = 255
        if not doubts:
            never = (inf,) * self._last
            novelty = Novelty(never, never)
        for i, name in enumerate(info.tasks if doubts else ()):
            stopping = info.stopping.get(name)
            if stopping is not None and stopping.remoteness is not None:
                naming = i
                far = stopping.remoteness
        limits = {
            "typical": novelty.typical,
            "novel": novelty.limits,
            "remote": far.limits,
            "middles": far.middles,
            "slopes": far.slopes,
        }
        self.values |= {key: limit[-self._last :] for key, limit in limits.items()}
        self.values |= {"naming": naming, "has_novelty": info.novelty is not None}


def write_rooms(rooms: Path, folder: Path, values: Mapping[str, str]) -> None:
    """Write all files of C of a folder with these values, whole or not at all."""
    with ExitStack() as files:
        for room in rooms.glob("*.[ch]"):
            text = string.Template(room.read_text()).substitute(values)
            file = files.enter_context(write_whole(folder / room.name))
            file.write(text.encode())
            file.flush()


def checksum(model: Model) -> int:
    """What `ec_selftest` in `export/c/decide.c` compares: FNV-1a of elementary functions
    and of the outputs for features that are all `PROBE`, at the full window."""
    last = max(len(model.decision_points_s) - 1, 0)
    values = model.run(np.full((1, model.info.width), PROBE), last)
    ends = ENDS[:3]
    names = [f"{task}_{end}" for task in model.info.tasks for end in ends]
    numbers = [PROBE * i for i in range(1, PROBES + 1)]
    probes = [f(x) for x in numbers for f in (sin, log, logistic, math.sqrt)]
    parts = [np.array(probes), *(values[name].reshape(-1) for name in names)]
    total = 14695981039346656037
    for bits in np.concatenate(parts).astype(np.float64).view(np.uint64).tolist():
        total = (total ^ bits) * 1099511628211 % 2**64
    return total


def literal(value: object) -> str:
    """A value in C: hexadecimal floats hold every bit."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return f"{{{', '.join(map(literal, value)) or '0'}}}"
    if not isinstance(value, float | np.floating):
        return str(int(value))  # type: ignore[call-overload]
    if np.isnan(value):
        return "(double)NAN"
    if np.isinf(value):
        return f"{'-' if value < 0.0 else ''}(double)INFINITY"
    return float(value).hex()


def array(kind: str, values: Iterable[object]) -> str:
    """A constant array without a name."""
    return f"(const {kind}[]){literal(values)}"


def quoted(text: str) -> str:
    """A text as a literal of C: ASCII, and other bytes of UTF-8 by their numbers."""
    letters = text.encode().decode("latin-1")
    return '"' + SPECIAL.sub(lambda match: f"\\{ord(match[0]):03o}", letters) + '"'


def quantities_in_c() -> dict[str, str]:
    """The names of all quantities, and the cases of `sure_value` in
    `export/c/samples.c`."""
    quantities = [*ALONE.values(), *OF_ZONES.values()]
    cases = [f"case {of.code}: return {of.c};" for of in quantities if of.c]
    names = ", ".join(of.code for of in quantities)
    return {"quantity_names": names, "sure_values": " \\\n  ".join(cases)}


def lacks(info: ModelInfo) -> Iterable[str]:
    """What C lacks for a model, as sentences."""
    layout = info.layout
    if layout.axes:
        yield "it takes no shear"
    if info.onset:
        yield "it finds the onset of a touch by the skin alone"
    total = layout.rows * layout.cols * 65535
    if (total * max(2 * layout.cols, layout.rows)) ** 2 >= LARGEST:
        yield f"the sums of {layout.rows} x {layout.cols} taxels exceed 64 bits"
    for feature in feature_types(info.features):
        if feature.quantity.c is None:
            yield f"it measures no {feature.quantity.name}"
        samples = feature.samples or info.samples
        if feature.summary not in ("", "rate") and samples > MOST_SUMMED:
            yield f"{feature.name} sums up more than {MOST_SUMMED} samples"


def kernel_fields(table: KernelTable) -> list[object]:
    """The `ec_kernels` of a table, which may be empty."""
    mixed = mixes(len(table.shifts)) if table.shifts else ()
    flat = [n for mix in mixed for n in (mix.sum(), *np.flatnonzero(mix))]
    return [
        array("int8_t", table.shifts),
        array("int32_t", table.biases),
        array("uint8_t", flat),
        BIASES.get(len(table.biases), ()),
    ]


def _of_taxels(layout: SkinLayout, cells: Cells) -> Array:
    """(taxels,) the cell that each belongs to; -1 where it has no living taxel."""
    rows, cols = np.indices(layout.shape) // cells.side
    blocks = rows * layout.cols + cols
    living = np.unique(blocks[layout.alive])
    cell_of_block = living.searchsorted(blocks)
    return np.where(np.isin(blocks, living), cell_of_block, -1).ravel()
