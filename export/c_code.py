"""A model as C99 for a microcontroller: `model.h` and `model.c` beside the files of
`export/c`, which hold no number of the model."""

from __future__ import annotations

import os
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
from edge.writing import write_whole
from export.c_graph import TYPES, CompiledGraph

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
        InputError: C lacks something that the model needs, the error rate is not
            certified, or the folder cannot be written.
    """
    source = source_of(model, error, frames)
    source.write(folder)
    return source


def source_of(
    model: Model, error: float | None = None, frames: int | None = None
) -> Source:
    """A model's C, as `write` writes it."""
    for reason in lacks(model.info):
        raise InputError(f"{model.path}: cannot be written in C, as {reason}")
    last = len(model.decision_points_s) - 1
    points = range(last if error is None else 0, last + 1)
    frames = frames or ceil(model.info.window_s * RATE_HZ) + 4
    source = Source(model.info, points, frames)
    graph = CompiledGraph(model, points, model.info.width + source.features())
    source.kernels()
    source.skin()
    source.geometry()
    source.graph(graph)
    source.tasks(graph.places, {} if error is None else stopping_rules(model, error))
    source.limits()
    windows_s = [model.decision_points_s[point] for point in points]
    source.constant("double ec_windows_s[]", windows_s)
    source.define(POINTS=len(points), EARLY=error is not None)
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
    source = source_of(model, error)
    limit = 1024 * flash_kb if flash_kb else source.flash
    if source.flash > limit and error is not None:
        left_out = "; early decisions are left out to fit --flash"
        source = source_of(model)
    if source.flash > limit:
        raise InputError(
            f"{model.path}: takes {source.flash / 1024:.0f} kB of flash in C, above "
            "--flash; export fewer features or recordings"
        )
    source.write(folder)
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
        defines: lines of `model.h`.
        constants: lines of `model.c`.
        flash: bytes of code and tables.
        ram: bytes.
        work: instructions of a decision on a Cortex-M4F, about.
    """

    def __init__(self, info: ModelInfo, points: Sequence[int], frames: int) -> None:
        self.defines: list[str] = []
        self.constants: list[str] = []
        self.flash = CODE_BYTES
        self.ram = 0
        self.work = 0
        self._info = info
        self._layout = info.layout
        self._types = feature_types(info.features)
        self._points = points
        self._frames = frames

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write all files, each whole or not at all."""
        defines = "\n".join(self.defines)
        constants = "\n".join(self.constants)
        header = f"#ifndef EC_MODEL_H\n#define EC_MODEL_H\n{defines}\n#endif\n"
        texts = {file.name: file.read_text() for file in ROOMS.iterdir()}
        texts["model.h"] = header
        texts["model.c"] = f'#include "internal.h"\n\n{constants}\n'
        for name, text in texts.items():
            with write_whole(Path(folder) / name) as file:
                file.write(text.encode())

    def define(self, **values: object) -> None:
        """Constants of the preprocessor."""
        for name, value in values.items():
            self.defines.append(f"#define EC_{name} {literal(value)}")

    def constant(self, declaration: str, values: Iterable[object]) -> None:
        """A constant array or structure."""
        self.constants.append(f"const {declaration} = {literal(values)};")

    def features(self) -> int:
        """The features; how many doubles they are measured in."""
        rows = []
        largest = 0
        for feature, width in zip(self._types, self._info.widths, strict=True):
            samples = feature.kernels or feature.samples or self._info.samples
            count = width // samples
            if feature.summary not in ("", "rate"):
                count = width
                largest = max(largest, count * samples)
            rows.append(self._feature(feature, samples, count))
        self.define(FEATURES=len(rows))
        self.constant("ec_feature ec_features[]", rows)
        return largest + (len(measures.QUANTITIES) + 4) * self._frames

    def _feature(self, feature: Feature, samples: int, rows: int) -> list[object]:
        """The `ec_feature` of a feature."""
        alone = (feature.zone, feature.quantity) in ALONE
        of_region = "REGION_" * (alone and feature.zone == "contact")
        kinds = [f"EC_T_{kind.upper()}" for kind in feature.transforms]
        return [
            float(transforms.floor_of(feature, self._layout)),
            samples,
            rows,
            "EC_NO_ZONE" if alone else f"EC_{feature.zone.upper()}",
            f"EC_Q_{of_region}{feature.quantity.upper()}",
            kinds,
            f"EC_S_{feature.summary.upper()}",
        ]

    def kernels(self) -> None:
        """The tables of the features that are made of kernels."""
        for name in ("taxel_kernels", "zone_kernels"):
            table = self._info.kernels.get(name, KernelTable((), ()))
            flat: list[int] = []
            for mix in mixes(len(table.shifts)) if table.shifts else ():
                flat += [mix.sum(), *np.flatnonzero(mix)]
            fields = [
                array("int8_t", table.shifts),
                array("int32_t", table.biases),
                array("uint8_t", flat),
                BIASES.get(len(table.biases), ()),
            ]
            self.constant(f"ec_kernels ec_{name}", fields)

    def skin(self) -> None:
        """The skin, and what is measured in every frame."""
        layout = self._layout
        quantities = {feature.quantity for feature in self._types}
        zones = Zones(layout, self._types).names
        cells = Cells(layout)
        kernel_cells = Cells(layout, KERNEL_CELLS)
        pooled = cells.count * ("taxel_force" in quantities)
        pooled_for_kernels = kernel_cells.count * ("taxel_kernels" in quantities)
        spreads = not quantities.isdisjoint(measures.QUANTITIES[6:])
        row = 72 + 64 * max(len(zones), 1) + 8 * self._info.joints
        row += 4 * (pooled + pooled_for_kernels)
        self.ram += self._frames * row + 8 * layout.alive.size + 2048
        self.work += (12000 if spreads else 4000) * self._frames * len(zones)
        self.work += 2500 * self._info.width
        self.define(
            FRAMES=self._frames,
            ZONES=len(zones),
            CELLS=pooled,
            KERNEL_CELLS=pooled_for_kernels,
            MOTION="motion" in quantities,
            SPREADS=spreads,
            FORCE_MOTION=not quantities.isdisjoint(("force_motion", "stiffness")),
        )
        zone_names = [f"EC_{name.upper()}" for name in (*zones, "no_zone")]
        self.constant("uint8_t ec_zone_names[]", zone_names)
        self.constant("int16_t ec_cell_of_taxel[]", _of_taxels(layout, cells))
        numbers = _of_taxels(layout, kernel_cells)
        self.constant("int16_t ec_kernel_cell_of_taxel[]", numbers)

    def geometry(self) -> None:
        """Where the taxels lie, on which arm, and the scale of their counts."""
        layout = self._layout
        for owner, names in ((layout, OF_LAYOUT), (self._info, OF_INFO)):
            for name in names:
                self.define(**{name.upper(): getattr(owner, name) or 0})
        along, around = layout.pitch
        angles = layout.column_angles_deg or (0.0,)
        steps = [
            (b - a + 180.0) % 360.0 - 180.0 for a, b in pairwise([*angles, angles[0]])
        ]
        links = []
        for kind, axis, step, after in (
            self._info.chain.links if self._info.chain else ()
        ):
            name = {"fixed": "FIXED", "prismatic": "PRISMATIC"}.get(kind, "REVOLUTE")
            links.append([axis, np.ravel(step), after, f"EC_{name}"])
        self.define(
            ALONG=float(along),
            AROUND=float(around),
            SCALE=float(layout.counts_per_newton or 1.0),
            FORCE_FLOOR=float(transforms.force_floor(layout)),
            LENGTH_FLOOR=float(transforms.length_floor(layout)),
            COLUMN_ANGLES=len(angles) > 1,
            LINKS=len(links),
        )
        self.constant("bool ec_alive[]", layout.alive.reshape(-1))
        self.constant("ec_angle ec_angles[]", zip(angles, steps, strict=True))
        self.constant("ec_link ec_links[]", links)

    def graph(self, graph: CompiledGraph) -> None:
        """The steps and the tables of the graph."""
        tables = []
        for table in graph.tables:
            kind = table.dtype.name
            values = array(TYPES[kind], table.reshape(-1))
            stride = (table.ndim - 1) * table.shape[-1]
            tables.append([values, stride, f"EC_{kind.upper()}"])
            self.flash += table.nbytes
        steps = []
        for s in graph.steps:
            steps.append([f"EC_{s.operator.upper()}", s.inputs, s.outputs, s.sizes])
            is_product = s.operator == "Gemm"
            self.work += 16 * prod(s.sizes[:2]) if is_product else 400 * max(s.sizes)
        self.flash += 44 * len(steps)
        self.ram += 8 * graph.arena
        self.define(ARENA=graph.arena, STEPS=len(steps))
        self.constant("ec_table ec_tables[]", tables)
        self.constant("ec_step ec_steps[]", steps)

    def tasks(
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
                bool(indices),
            ]
            rows.append(row)
            labels.append(array("char *const", map(quoted, task.labels)))
        most = max(len(task.labels) for task in tasks.values())
        self.define(TASKS=len(names), MOST_LABELS=most)
        for output in ("out_of_range", "novelty", "remoteness"):
            self.define(**{f"PLACE_{output.upper()}": places.get(output, 0)})
        order = sorted(range(len(names)), key=lambda i: bool(tasks[names[i]].factors))
        self.constant("ec_task ec_tasks[]", rows)
        self.constant("uint8_t ec_order[]", order)
        self.constant("char *const *const ec_labels[]", labels)
        self.constant("char *const ec_task_names[]", map(quoted, names))

    def _curves(self, task: str) -> list[object]:
        """The curves of a task: those of the decision points, and that of the rules."""
        stopping = self._info.stopping.get(task)
        if stopping is None:
            return [0, ()]
        columns = stopping.slopes, stopping.intercepts, stopping.doubts
        curves = [[column[point] for column in columns] for point in self._points]
        rules = stopping.slope, stopping.intercept, stopping.doubt
        return [array("ec_curve", curves), rules]

    def limits(self) -> None:
        """The limits of novelty and remoteness at the decision points."""
        info = self._info
        naming = 255
        limits: dict[str, Any] = {}
        if info.novelty is not None:
            limits = {"typical": info.novelty.typical, "novel": info.novelty.limits}
        for i, name in enumerate(info.tasks):
            stopping = info.stopping.get(name)
            if stopping is not None and stopping.remoteness is not None:
                naming = i
                far = stopping.remoteness
                limits |= vars(far) | {"remote": far.limits}
        for name in ("typical", "novel", "remote", "middles", "slopes"):
            values = [limits[name][point] for point in self._points if name in limits]
            self.constant(f"double ec_{name}[]", values)
        self.define(NAMING=naming, CALIBRATED=info.novelty is not None)


def literal(value: object) -> str:
    """A value in C: hexadecimal floats hold every bit."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return f"{{{', '.join(map(literal, value)) or '0'}}}"
    if not isinstance(value, float | np.floating):
        return str(int(value))  # type: ignore[call-overload]
    if np.isinf(value):
        return "(double)INFINITY"
    return float(value).hex() + "f" * isinstance(value, np.float32)


def array(kind: str, values: Iterable[object]) -> str:
    """A constant array without a name."""
    return f"(const {kind}[]){literal(values)}"


def quoted(text: str) -> str:
    """A text as a literal of C: ASCII, and other bytes of UTF-8 by their numbers."""
    plain = set(string.ascii_letters + string.digits + " -_.,:;()/+").__contains__
    codes = (chr(b) if plain(chr(b)) else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join(codes) + '"'


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


def _of_taxels(layout: SkinLayout, cells: Cells) -> Array:
    """(taxels,) the cell that each belongs to; -1 where it has no living taxel."""
    rows, cols = np.indices(layout.shape) // cells.side
    blocks = (rows * layout.cols + cols).reshape(-1)
    living = np.unique(blocks[layout.alive.reshape(-1)])
    return np.where(np.isin(blocks, living), living.searchsorted(blocks), -1)
