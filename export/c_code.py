"""A model as C99 for a microcontroller: the files of `export/c`, of which `model.h`
takes the sizes and `model.c` the bytes of `model.bin`, the model as data."""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterable, Sequence
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.decide.doubts import GAP_S, PERIODS
from edge.decide.early import stopping_rules
from edge.decide.info import ModelInfo
from edge.decide.model import Model
from edge.elementary import log, logistic, sin
from edge.errors import InputError
from edge.features.cells import KERNEL_CELLS, Cells
from edge.features.kernels import BIASES, KernelTable, mixes
from edge.features.names import Feature, feature_types, zones_of
from edge.features.quantities import ALONE, OF_ZONES, force_floor, length_floor
from edge.touch.layout import SkinLayout
from export.c_text import literal, write_rooms
from export.costs import Costs
from export.formula import Formula
from export.image import ROOMS, SIZES, TABLES, Image, Pools, record

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
            early decisions first, then the outlier score.

    Raises:
        InputError: C lacks something that the model needs, the error rate is not
            certified, the least that can be written is larger than `flash_kb`, or the
            folder cannot be written.
    """
    left_out = ""
    source = Source(model, error)
    limit = 1024 * (flash_kb or inf)
    if source.costs.flash > limit and error is not None:
        left_out += "; early decisions are left out to fit --flash"
        source = Source(model)
    if source.costs.flash > limit and model.info.outlier_score is not None:
        left_out += (
            "; the outlier score is left out to fit --flash: nothing is unusual or unknown, and "
            "confidence is that of a usual touch"
        )
        source = Source(model, doubts=False)
    if source.costs.flash > limit:
        raise InputError(
            f"{model.path}: takes {source.costs.flash / 1024:.0f} kB of flash in C, above "
            "--flash; export fewer features or recordings"
        )
    source.write(Path(folder))
    return f"{os.fspath(folder)}: {source.costs}{left_out}"


class Source:
    """A model in C.

    Attributes:
        costs: what it takes.
        image: the model as data.
    """

    def __init__(
        self, model: Model, error: float | None = None, doubts: bool = True
    ) -> None:
        """Make all values.

        Args:
            model: the model.
            error: as for `export`.
            doubts: with the outlier score and the distance to known objects.

        Raises:
            InputError: as `export`.
        """
        for reason in lacks(model.info):
            raise InputError(f"{model.path}: cannot be written in C, as {reason}")
        self._info = model.info
        self._layout = model.info.layout
        self._types = feature_types(model.info.features)
        count = len(model.decision_points_s)
        points = range(0 if error is not None else count - 1, count)
        self._zones = zones_of(self._types)
        self._pools = Pools()
        rules = {} if error is None else stopping_rules(model, error)
        has_outliers = doubts and model.info.outlier_score is not None
        formula = Formula(model, points, self._pools, rules, has_outliers)
        self._tables: dict[str, Any] = {
            **formula.tables,
            "windows_s": [model.decision_points_s[i] for i in points],
        }
        self._sizes: dict[str, int] = {
            **formula.sizes,
            "points": len(points),
            "features": len(self._types),
            "width": self._info.width,
            "joints": self._info.joints,
            "long_steps": int(model.info.window_s / LONG_STEP_S) + 2,
        }
        self._features()
        self._skin()
        self._geometry()
        header = {
            "program": program(self._layout),
            "trials": formula.trials,
            "numbers": self._numbers(model, formula, error is not None),
            "sizes": record("ec_sizes", **self._sizes),
        }
        empty = dict.fromkeys(TABLES, ())
        self.image = Image(header, empty | self._tables | self._pools.tables())
        self.costs = Costs(self.image, self._layout.alive.size)

    def write(self, folder: Path) -> None:
        """Write all files, whole or not at all."""
        image = self.image
        header = image.header().tolist()[0]
        sizes = {name: self._sizes.get(name, 0) for name in SIZES}
        values = {
            **quantities_in_c(),
            **{name: literal(getattr(self._layout, name)) for name in OF_PROGRAM},
            "program": str(program(self._layout)),
            "ram": str(self.costs.ram),
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

    def _numbers(self, model: Model, formula: Formula, early: bool) -> Array:
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
            calibrated=info.outlier_score is not None,
            naming=formula.naming,
            text=self._pools.text(info.name or ""),
            checksum=checksum(model) if formula.trials else 0,
        )

    def _features(self) -> None:
        """The series that are sampled, and the features that are made of them."""
        sampled: dict[tuple[int, int, int, int], int] = {}
        features = []
        place = 0
        summed = 0
        for feature, width in zip(self._types, self._info.widths, strict=True):
            series = self._series(feature, width)
            samples, count, *_ = series
            if not feature.quantity.kernels and series not in sampled:
                sampled[series] = place
                place += samples * count
            if feature.summary not in ("", "rate"):
                together = count if "relative" in feature.transforms else 1
                summed = max(summed, samples * together)
            number = [*sampled].index(series) if series in sampled else 0
            features.append(_feature(feature, self._layout, number))
        names = ("samples", "rows", "zone", "quantity")
        self._tables["features"] = features
        self._tables["sampled"] = [
            record(
                "ec_time_series", place=place, **dict(zip(names, series, strict=True))
            )
            for series, place in sampled.items()
        ]
        self._tables["kernels"] = [
            self._kernels(self._info.kernels.get(name, KernelTable((), ())))
            for name in ("taxel_kernels", "zone_kernels")
        ]
        self._sizes |= {"sampled": len(sampled), "values": place, "summed": summed}

    def _series(self, feature: Feature, width: int) -> tuple[int, int, int, int]:
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


def _feature(feature: Feature, layout: SkinLayout, series: int) -> Array:
    """The `ec_feature` of a feature that is made of a series."""
    kinds = [TRANSFORMS.index(kind) for kind in feature.transforms]
    return record(
        "ec_feature",
        floor=feature.quantity.floor(layout),
        series=series,
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


def checksum(model: Model) -> int:
    """What `ec_selftest` in `export/c/decide.c` compares: FNV-1a of elementary
    functions and of the outputs for features that are all `PROBE`, at the full
    window."""
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
