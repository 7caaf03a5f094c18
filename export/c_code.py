"""A model as C99 for a microcontroller: the files of `export/c`, of which `model.h` takes
the sizes and `model.c` the bytes of `model.bin`, the model as data."""

from __future__ import annotations

import math
import os
import string
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array, Floats
from edge.decide.doubts import GAP_S, PERIODS
from edge.decide.early import stopping_rules
from edge.decide.info import ModelInfo, StoppingRule
from edge.decide.model import Model
from edge.elementary import log, logistic, sin
from edge.errors import InputError
from edge.features.cells import KERNEL_CELLS, Cells
from edge.features.kernels import BIASES, CONVOLUTIONS, KernelTable, mixes
from edge.features.names import Feature, feature_types, zones_of
from edge.features.quantities import ALONE, OF_ZONES, force_floor, length_floor
from edge.touch.layout import SkinLayout
from edge.writing import write_whole
from export.formula import Formula
from export.image import NOWHERE, ROOMS, SIZES, TABLES, Image, Pools, record

CODE_BYTES = 28 * 1024
"""Of all rooms, with small tables and the arithmetic of doubles, by gcc 12 with -O2 for a
Cortex-M0+."""
KERNEL_BYTES = 4608
"""Of the code of kernels, and of the channels that each sums up."""
COSTS = {
    "task": (6800, 14000),
    "convolution": (6600, 8900),
    "root": (550, 670),
    "row": (1036, 2270),
    "product": (13.4, 56.6),
    "trial": (430, 929),
    "square": (30.4, 116),
}
"""Instructions of a Cortex-M4F and of a Cortex-M0+ for the parts of a decision, fitted
to what QEMU counted: roots and logarithms of values, rows of projections, products of
matrices, trials, and coordinates of these."""
REST_OF_RAM = 2048 + 2100
"""Of the stack, and of what does not depend on the model."""
LONG_STEP_S = 0.95 * GAP_S / PERIODS
"""No usual step of at most this time makes a longer pause usual."""
LARGEST = 2**63
"""No product of a frame's sums may reach it."""
MOST_SUMMED = 128
"""Samples beyond which numpy sums up in halves."""
PROBE = 0.3
PROBES = 8
OF_PROGRAM = ("rows", "cols", "wraps")
OF_LAYOUT = ("threshold_counts", "onset", "release_s", "radius_m", "row0_z_m")
"""Attributes of a layout that have their names in C."""
TRANSFORMS = ("none", "log", "sqrt", "relative")
SUMMARIES = ("", "rate", "mean", "deviation", "roughness")
LINKS = ("fixed", "revolute", "continuous", "prismatic")
ZONES = ("contact", "skin", "left", "right", "no_zone")
"""In the order of their numbers in C."""


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
        flash: bytes of code and tables.
        ram: bytes.
        work: of a decision, how much there is of each of `COSTS`.
        image: the model as data.
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
        self._doubts = doubts and model.info.novelty is not None
        count = len(model.decision_points_s)
        self._points = range(0 if error is not None else count - 1, count)
        self._zones = zones_of(self._types)
        self._pools = Pools()
        self._formula = Formula(model, self._points, self._pools)
        self.work: dict[str, float] = {"task": len(model.info.tasks)}
        self._tables: dict[str, Any] = {
            "projections": self._formula.projections,
            "windows_s": [model.decision_points_s[i] for i in self._points],
        }
        self._sizes: dict[str, int] = {
            "points": len(self._points),
            "tasks": len(model.info.tasks),
            "spaces": self._formula.spaces,
            "features": len(self._types),
            "width": self._info.width,
            "joints": self._info.joints,
            "long_steps": int(model.info.window_s / LONG_STEP_S) + 2,
            "has_novelty": self._doubts,
        }
        self._features()
        self._skin()
        self._geometry()
        self._tasks({} if error is None else stopping_rules(model, error))
        if self._doubts:
            self._limits()
        self._sizes["components"] = self._formula.components
        for kind, amount in self._formula.work.items():
            self._add_work(kind, amount)
        header = {
            "program": program(self._layout),
            "trials": self._formula.trials,
            "numbers": self._numbers(model, error is not None),
            "sizes": record("ec_sizes", **self._sizes),
        }
        empty = dict.fromkeys(TABLES, ())
        self.image = Image(header, empty | self._tables | self._pools.tables())
        kernels = KERNEL_BYTES * (self._sizes["channels"] > 0)
        self.flash = CODE_BYTES + kernels + self.image.size
        self.ram = self._ram()

    def instructions(self) -> Floats:
        """(2,) about how many a decision takes on each processor of `COSTS`."""
        costs = np.array([COSTS[kind] for kind in self.work])
        return np.asarray(np.array([*self.work.values()]) @ costs)

    def write(self, folder: Path) -> None:
        """Write all files, whole or not at all."""
        image = self.image
        header = image.header().tolist()[0]
        sizes = {name: self._sizes.get(name, 0) for name in SIZES}
        values = {
            **quantities_in_c(),
            **{name: literal(getattr(self._layout, name)) for name in OF_PROGRAM},
            "program": str(program(self._layout)),
            "ram": str(self.ram),
            "most": literal(sizes.values()),
            "sizes": "\n".join(
                f"#define EC_MOST_{name.upper()} {int(n)}" for name, n in sizes.items()
            ),
            "fields": "\n".join(image.fields()),
            "digests": digests(header),
            "big_digests": digests(image.header(">").tolist()[0]),
            "header": ", ".join(map(literal, header[3:])),
            "tables": ",\n".join(map(literal, image.values())),
        }
        write_rooms(ROOMS, folder, values, {"model.bin": image.data()})

    def _numbers(self, model: Model, early: bool) -> Array:
        layout = self._layout
        info = self._info
        values = {name: getattr(layout, name) or 0 for name in OF_LAYOUT}
        along, around = layout.pitch
        return record(
            "ec_numbers",
            **values,
            along=along,
            around=around,
            scale=float(layout.counts_per_newton or 1.0),
            window_s=info.window_s,
            long_step_s=LONG_STEP_S,
            force_floor=force_floor(layout),
            length_floor=length_floor(layout),
            column_angles=len(layout.column_angles_deg or ()) > 1,
            dof=info.dof or 0,
            link_count=len(info.chain.links) if info.chain else 0,
            debounce=info.debounce,
            repeats=info.repeats,
            early=early,
            calibrated=info.novelty is not None,
            naming=self._naming(),
            text=self._pools.text(info.name or ""),
            checksum=checksum(model) if self._formula.spaces else 0,
        )

    def _features(self) -> None:
        """The courses, and the features that are made of them."""
        courses: dict[tuple[int, int, int, int], int] = {}
        features = []
        place = 0
        summed = 0
        for feature, width in zip(self._types, self._info.widths, strict=True):
            course = self._course(feature, width)
            samples, count, *_ = course
            if feature.quantity.kernels:
                self._add_work("convolution", CONVOLUTIONS)
            elif course not in courses:
                courses[course] = place
                place += samples * count
            if feature.summary not in ("", "rate"):
                together = count if "relative" in feature.transforms else 1
                summed = max(summed, samples * together)
            roots = {"log", "sqrt"}.intersection(feature.transforms)
            if not feature.quantity.kernels:
                self._add_work("root", samples * count * len(roots))
            number = [*courses].index(course) if course in courses else 0
            features.append(_feature(feature, self._layout, number))
        names = ("samples", "rows", "zone", "quantity")
        self._tables["features"] = features
        self._tables["courses"] = [
            record("ec_course", place=place, **dict(zip(names, course, strict=True)))
            for course, place in courses.items()
        ]
        self._tables["kernels"] = [
            self._kernels(self._info.kernels.get(name, KernelTable((), ())))
            for name in ("taxel_kernels", "zone_kernels")
        ]
        self._sizes |= {"courses": len(courses), "values": place, "summed": summed}

    def _course(self, feature: Feature, width: int) -> tuple[int, int, int, int]:
        """Samples, rows, zone and quantity of what a feature is made of."""
        samples = feature.samples or self._info.samples
        sums_up = feature.summary not in ("", "rate")
        quantity = feature.quantity
        return (
            samples,
            width if sums_up else width // samples,
            0 if quantity.zone else self._zones.index(feature.zone),
            codes().index(quantity.code.replace("CHANGE", "ANGLE")),
        )

    def _add_work(self, kind: str, amount: float) -> None:
        self.work[kind] = self.work.get(kind, 0) + amount

    def _kernels(self, table: KernelTable) -> Array:
        """The `ec_kernels` of a table, which may be empty."""
        mixed = mixes(len(table.shifts)) if table.shifts else ()
        flat = [n for mix in mixed for n in (mix.sum(), *np.flatnonzero(mix))]
        return record(
            "ec_kernels",
            shifts=self._pools.add("bytes", np.array(table.shifts, np.int8)),
            biases=self._pools.add("longs", table.biases),
            mixes=self._pools.add("bytes", flat),
            biases_of_dilation=BIASES.get(len(table.biases), (0, 0, 0, 0)),
        )

    def _skin(self) -> None:
        """The skin, and what is measured in every frame."""
        layout = self._layout
        used = [feature.quantity for feature in self._types]
        quantities = {quantity.name for quantity in used}
        motions = {quantity.motion for quantity in used}
        pooled = {}
        for table, side, name in (
            ("cell", 1, "taxel_force"),
            ("kernel_cell", KERNEL_CELLS, "taxel_kernels"),
        ):
            cells = Cells(layout, side) if side > 1 else Cells(layout)
            is_used = name in quantities
            pooled[f"{table}s"] = cells.count * is_used
            of_taxel = _of_taxels(layout, cells) if is_used else ()
            self._tables[f"{table}_of_taxel"] = of_taxel
        zone_channels = 8 * len(self._zones) * ("zone_kernels" in quantities)
        self._tables["zone_names"] = [
            ZONES.index(name) for name in (*self._zones, "no_zone")
        ]
        self._tables["alive"] = layout.alive.reshape(-1)
        self._sizes |= pooled
        self._sizes |= {
            "zones": len(self._zones),
            "zone_channels": zone_channels,
            "channels": zone_channels + pooled["kernel_cells"],
            "motion": "motion" in motions,
            "force_motion": "force_motion" in motions,
            "centroids": not quantities.isdisjoint(("along", "around")),
            "spreads": any("SPREAD" in (quantity.c or "") for quantity in used),
        }

    def _geometry(self) -> None:
        """Where the taxels lie, and on which arm."""
        angles = self._layout.column_angles_deg or (0.0,)
        steps = (np.diff([*angles, angles[0]]) + 180.0) % 360.0 - 180.0
        chain = self._info.chain
        joints = self._info.joints
        ranges = [*(chain.limits if chain else ()), *[None] * joints]
        still_s = [*self._info.still_s, *[inf] * joints]
        self._tables["angles"] = [*zip(angles, steps, strict=True)]
        self._tables["links"] = [
            record(
                "ec_link",
                axis=axis,
                step=np.ravel(step),
                after=after,
                kind=LINKS.index(kind),
            )
            for kind, axis, step, after in (chain.links if chain else ())
        ]
        self._tables["limits"] = [
            (*(span or (-inf, inf)), still)
            for span, still in list(zip(ranges, still_s, strict=False))[:joints]
        ]

    def _tasks(self, rules: Mapping[str, StoppingRule | None]) -> None:
        """The tasks, their labels and their calibration."""
        tasks = self._info.tasks
        names = list(tasks)
        self._tables["tasks"] = [self._task(name, rules.get(name)) for name in tasks]
        # Of a space the rows with most components come first: others are parts of them.
        wide = sorted(tasks, key=lambda name: -tasks[name].components)
        places = {
            (point, name): self._formula.place(name, point, self._curve(name, point))
            for point in self._points
            for name in wide
        }
        self._tables["places"] = [
            places[point, name] for point in self._points for name in names
        ]
        self._sizes |= {
            "labels": max(len(task.labels) for task in tasks.values()),
            "neighbours": max(task.k for task in tasks.values()),
            "nearest": self._formula.nearest,
        }

    def _task(self, name: str, rule: StoppingRule | None) -> Array:
        """The `ec_task` of a task, with its rule for early decisions, if any."""
        task = self._info.tasks[name]
        names = list(self._info.tasks)
        indices = [self._pools.add("words", of) for of in task.factors.values()]
        factors = [names.index(factor) for factor in task.factors]
        made = record(
            "ec_task",
            text=self._pools.text(name, *task.labels),
            indices=indices or NOWHERE,
            factors=factors or 0,
            labels=len(task.labels),
            k=task.k,
            **self._formula.task(name),
        )
        stopping = self._info.stopping.get(name)
        if stopping is not None:
            made["rule_curve"] = stopping.slope, stopping.intercept, stopping.doubt
        if rule:
            made["rule_confidence"] = rule.confidence
            made["rule_last"] = rule.last
            made["has_rule"] = True
        return made

    def _curve(self, task: str, point: int) -> tuple[float, float, float]:
        """The curve of a task's confidence at a decision point."""
        of = self._info.stopping.get(task)
        if of is None:
            return 0.0, 0.0, 0.0
        return of.slopes[point], of.intercepts[point], of.doubts[point]

    def _naming(self) -> int:
        """The task that names things; `NOWHERE` where nothing is unknown."""
        for i, name in enumerate(self._info.tasks if self._doubts else ()):
            stopping = self._info.stopping.get(name)
            if stopping is not None and stopping.remoteness is not None:
                return i
        return NOWHERE

    def _limits(self) -> None:
        """The scores of doubt, and their limits at the decision points."""
        info = self._info
        assert info.novelty is not None
        naming = self._naming()
        far = None
        if naming != NOWHERE:
            far = info.stopping[[*info.tasks][naming]].remoteness
        doubts = []
        for point in self._points:
            limits = {
                "typical": info.novelty.typical[point],
                "novel": info.novelty.limits[point],
            }
            if far is not None:
                limits["remote"] = far.limits[point]
                limits["middle"] = far.middles[point]
                limits["slope"] = far.slopes[point]
            doubts.append(self._formula.doubt(point, limits))
        self._formula.weigh_doubt(doubts[-1])
        self._tables["doubts"] = doubts

    def _ram(self) -> int:
        """Bytes of RAM."""
        size = self._sizes
        zones = max(size["zones"], 1)
        unsure = 2 * size["zones"] + 3 + size["joints"]
        row = 40 + 8 * max(size["joints"], 1) + 121 * zones + 8 * unsure
        row += 4 * max(size["cells"], 1) + 4 * max(size["kernel_cells"], 1)
        answer = 10 * size["labels"] + 10 * size["neighbours"] + 8
        return (
            4 * row
            + 48 * unsure
            + 9 * self._layout.alive.size
            + size["points"] * (8 * size["values"] + 240 * size["channels"])
            + 8 * (size["width"] + size["summed"] + size["nearest"])
            + size["tasks"] * (answer + 8 * size["labels"] + 64)
            + (4 * size["spaces"] + 12) * size["components"]
            + REST_OF_RAM
        )


def _feature(feature: Feature, layout: SkinLayout, course: int) -> Array:
    """The `ec_feature` of a feature that is made of a course."""
    kinds = [TRANSFORMS.index(kind) for kind in feature.transforms]
    return record(
        "ec_feature",
        floor=feature.quantity.floor(layout),
        course=course,
        quantity=codes().index(feature.quantity.code),
        transforms=[*kinds, 0, 0, 0][:3],
        summary=SUMMARIES.index(feature.summary),
    )


def digests(header: Sequence[int]) -> str:
    """The digests of a header as numbers of C."""
    return ", ".join(f"0x{digest:08x}u" for digest in header[1:3])


def program(layout: SkinLayout) -> int:
    """Which program a model needs: of a skin of this shape, with these quantities."""
    shape = [int(getattr(layout, name)) for name in OF_PROGRAM]
    return zlib.crc32(repr((shape, quantities_in_c())).encode())


def write_rooms(
    rooms: Path,
    folder: Path,
    values: Mapping[str, str],
    more: Mapping[str, bytes] | None = None,
) -> None:
    """Write all files of C of a folder with these values, and more, whole or not at
    all."""
    contents = {
        room.name: string.Template(room.read_text()).substitute(values).encode()
        for room in rooms.glob("*.[ch]")
    }
    with ExitStack() as files:
        for name, data in (contents | dict(more or {})).items():
            file = files.enter_context(write_whole(folder / name))
            file.write(data)
            file.flush()


def checksum(model: Model) -> int:
    """What `ec_selftest` in `export/c/decide.c` compares: FNV-1a of elementary functions
    and of the outputs for features that are all `PROBE`, at the full window."""
    last = max(len(model.decision_points_s) - 1, 0)
    values = model.run(np.full((1, model.info.width), PROBE), last)
    ends = ("label", "distances")
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
        number = int(value)  # type: ignore[call-overload]
        return f"{number}u" if number > 2**31 else str(number)
    if np.isnan(value):
        return "(double)NAN"
    if np.isinf(value):
        return f"{'-' if value < 0.0 else ''}(double)INFINITY"
    return float(value).hex()


def array(kind: str, values: Iterable[object]) -> str:
    """A constant array without a name."""
    return f"(const {kind}[]){literal(values)}"


def codes() -> list[str]:
    """The names of all quantities in C, in the order of their numbers."""
    return [of.code for of in (*ALONE.values(), *OF_ZONES.values())]


def quantities_in_c() -> dict[str, str]:
    """The names of all quantities, and the cases of `sure_value` in
    `export/c/samples.c`."""
    quantities = [*ALONE.values(), *OF_ZONES.values()]
    cases = [f"case {of.code}: return {of.c};" for of in quantities if of.c]
    names = ", ".join(codes())
    return {"quantity_names": names, "sure_values": " \\\n  ".join(cases)}


def lacks(info: ModelInfo) -> Iterable[str]:
    """What C lacks for a model, as sentences."""
    layout = info.layout
    if layout.axes:
        yield "it takes no shear"
    if info.scorer != "knn":
        yield f"its scorer is {info.scorer}"
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


def _of_taxels(layout: SkinLayout, cells: Cells) -> Array:
    """(taxels,) the cell that each belongs to; -1 where it has no living taxel."""
    rows, cols = np.indices(layout.shape) // cells.side
    blocks = rows * layout.cols + cols
    living = np.unique(blocks[layout.alive])
    cell_of_block = living.searchsorted(blocks)
    return np.where(np.isin(blocks, living), cell_of_block, -1).ravel()
