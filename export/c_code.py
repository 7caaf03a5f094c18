"""A model as C99 for a microcontroller: the files of `export/c`, of which `model.h` and
`model.c` take the model's numbers."""

from __future__ import annotations

import os
import re
import string
from collections.abc import Iterable, Mapping, Sized
from contextlib import ExitStack
from math import ceil, inf, prod
from pathlib import Path

import numpy as np

from edge.arrays import Array
from edge.early import stopping_rules
from edge.errors import InputError
from edge.model.info import ModelInfo, Novelty, Remoteness, StoppingRule
from edge.model.model import Model
from edge.touch import measures, transforms
from edge.touch.cells import KERNEL_CELLS, Cells
from edge.touch.contact import feature_types
from edge.touch.kernels import BIASES, KernelTable, mixes
from edge.touch.layout import SkinLayout
from edge.touch.zones import Zones
from edge.writing import write_whole
from export.c_graph import CompiledGraph

ROOMS = Path(__file__).parent / "c"
RATE_HZ = 120.0
"""Frames a second for which there is room."""
CODE_BYTES = 28 * 1024
"""Of all rooms, with small tables and the arithmetic of doubles, by gcc 12 with -O2 for a
Cortex-M0+."""
LARGEST = 2**63
"""No product of a frame's sums may reach it."""
MOST_SUMMED = 128
"""Samples beyond which numpy sums up in halves."""
ALONE = {*measures.ALONE.values(), ("contact", "area")} - {("skin", "stiffness")}
"""(zone, quantity) that need no sums of a zone."""
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
    millions = source.work / 1e6
    return (
        f"{os.fspath(folder)}: {source.flash / 1024:.0f} kB of flash, "
        f"{source.ram / 1024:.0f} kB of RAM, a decision in about {millions:.1f} million "
        f"instructions of a Cortex-M4F ({millions / 0.064:.0f} ms at 64 MHz) or "
        f"{2.2 * millions:.1f} million of a Cortex-M0+ ({2.2 * millions / 0.133:.0f} ms "
        f"at 133 MHz){left_out}"
    )


class Source:
    """A model in C.

    Attributes:
        values: what stands for the names in the rooms' `model.h` and `model.c`.
        flash: bytes of code and tables.
        ram: bytes.
        work: instructions of a decision on a Cortex-M4F, about.
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
        self._frames = ceil(model.info.window_s * RATE_HZ) + 4
        windows_s = model.decision_points_s
        self._last = len(windows_s) if error is not None else 1
        self.values: dict[str, object] = {
            "early": error is not None,
            "windows_s": windows_s[-self._last :],
        }
        for owner, names in ((self._layout, OF_LAYOUT), (self._info, OF_INFO)):
            self.values |= {name: getattr(owner, name) or 0 for name in names}
        self.flash = CODE_BYTES
        self.ram = 4096
        self.work = 2500 * self._info.width
        outputs = set(model.outputs) - set(() if doubts else DOUBTS)
        points = range(len(windows_s))[-self._last :]
        room = self._info.width + self._features()
        graph = CompiledGraph(model, outputs, points, room)
        self._skin()
        self._geometry()
        self._graph(graph)
        rules = {} if error is None else stopping_rules(model, error)
        self._tasks(graph.places, rules)
        self._limits(doubts)

    def write(self, folder: Path) -> None:
        """Write all files, whole or not at all."""
        values = {}
        for name, value in self.values.items():
            values[name] = literal(value)
            if isinstance(value, Sized):
                values[f"{name}_count"] = str(len(value))
        with ExitStack() as files:
            for room in ROOMS.iterdir():
                text = string.Template(room.read_text()).substitute(values)
                file = files.enter_context(write_whole(folder / room.name))
                file.write(text.encode())
                file.flush()

    def _features(self) -> int:
        """The `ec_feature` of each feature, and the tables of the kernels, from which
        some are computed; how many doubles they are measured in."""
        rows = []
        largest = 0
        for feature, width in zip(self._types, self._info.widths, strict=True):
            samples = feature.kernels or feature.samples or self._info.samples
            count = width // samples
            if feature.summary not in ("", "rate"):
                count = width
                largest = max(largest, count * samples)
            alone = (feature.zone, feature.quantity) in ALONE
            of_region = "REGION_" * (alone and feature.zone == "contact")
            row = [
                transforms.floor_of(feature, self._layout),
                samples,
                count,
                "EC_NO_ZONE" if alone else f"EC_{feature.zone.upper()}",
                f"EC_Q_{of_region}{feature.quantity.upper()}",
                [f"EC_T_{kind.upper()}" for kind in feature.transforms],
                f"EC_S_{feature.summary.upper()}",
            ]
            rows.append(row)
        self.values["features"] = rows
        for name in ("taxel_kernels", "zone_kernels"):
            table = self._info.kernels.get(name, KernelTable((), ()))
            self.values[name] = kernel_fields(table)
        return largest + (len(measures.QUANTITIES) + 4) * self._frames

    def _skin(self) -> None:
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
        self.ram += self._frames * row + 8 * layout.alive.size
        self.work += (12000 if spreads else 4000) * self._frames * len(zones)
        self.values |= {
            "frames": self._frames,
            "cells": pooled,
            "kernel_cells": pooled_for_kernels,
            "motion": "motion" in quantities,
            "spreads": spreads,
            "force_motion": not quantities.isdisjoint(("force_motion", "stiffness")),
            "zone_names": [f"EC_{name.upper()}" for name in (*zones, "no_zone")],
            "cell_of_taxel": _of_taxels(layout, cells),
            "kernel_cell_of_taxel": _of_taxels(layout, kernel_cells),
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
        self.values |= {
            "along": along,
            "around": around,
            "scale": float(layout.counts_per_newton or 1.0),
            "force_floor": transforms.force_floor(layout),
            "length_floor": transforms.length_floor(layout),
            "column_angles": len(angles) > 1,
            "alive": layout.alive.reshape(-1),
            "angles": zip(angles, steps, strict=True),
            "links": links,
        }

    def _graph(self, graph: CompiledGraph) -> None:
        """The steps and the tables of the graph."""
        tables = []
        for table in graph.tables:
            kind = table.dtype.name
            values = array(f"{kind}_t", table.reshape(-1))
            stride = (table.ndim - 1) * table.shape[-1]
            tables.append([values, stride, f"EC_{kind.upper()}"])
            self.flash += table.nbytes
        for step in graph.steps:
            is_product = step.operator in ("EC_GEMM", "EC_MATMUL")
            self.work += 16 * prod(step.sizes) if is_product else 400 * max(step.sizes)
        self.flash += 40 * len(graph.steps)
        self.ram += 8 * graph.arena
        self.values |= {
            "arena": graph.arena,
            "ram": self.ram,
            "tables": tables,
            "steps": graph.steps,
        }

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
        self.values |= {"naming": naming, "calibrated": info.novelty is not None}


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
        return "(double)INFINITY" if value > 0 else "-(double)INFINITY"
    return float(value).hex()


def array(kind: str, values: Iterable[object]) -> str:
    """A constant array without a name."""
    return f"(const {kind}[]){literal(values)}"


def quoted(text: str) -> str:
    """A text as a literal of C: ASCII, and other bytes of UTF-8 by their numbers."""
    letters = text.encode().decode("latin-1")
    return '"' + SPECIAL.sub(lambda match: f"\\{ord(match[0]):03o}", letters) + '"'


def lacks(info: ModelInfo) -> Iterable[str]:
    """What C lacks for a model, as sentences."""
    layout = info.layout
    if layout.axes:
        yield "it takes no shear"
    total = layout.rows * layout.cols * 65535
    if (total * max(2 * layout.cols, layout.rows)) ** 2 >= LARGEST:
        yield f"the sums of {layout.rows} x {layout.cols} taxels exceed 64 bits"
    for feature in feature_types(info.features):
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
