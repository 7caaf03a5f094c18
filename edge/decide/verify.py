"""golden.npz: raw frames with every result on the way to a decision, to check a machine
by.

| key | type | meaning |
|---|---|---|
| `start` | int64 (m + 1,) | trial i is rows start[i] to start[i + 1] of `t`, `frames`, `joints` |
| `t`, `frames`, `joints`, `valid` | as in a recording | the trials, one after another |
| `series_start` | int64 (m + 1,) | the same for the series |
| `onset_s` | float64 (m,) | |
| `series_t` | float64 (s,) | |
| `series_counts` | int64 (s, c) | `integers_of` the series |
| `vectors` | float64 (v, width) | feature vectors; the first m are the trials', in order |
| `<task>_label`, `_scores`, `_distances`, `_neighbours` | | the graph's outputs for `vectors` |
| `<task>_label_distances` | float64 (v, labels) | likewise, where the model gives them |
| `outlier_score`, `known_distance` | float64 (v,) | likewise |
| `out_of_range` | float64 (v,) | the graph's output |
| `decision_point_vectors` | float64 (points, w, width) | vectors for each decision point |
| `decision_point_<task>_label`, ... | | the graph's outputs for these, each at its point |
| `meta` | JSON text | `skin` |

Every quantity must be equal, to the last bit. An engine that computes in float32 gives
other distances.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, pairwise, starmap
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array, Floats, Integers
from edge.decide.model import Model
from edge.errors import InputError
from edge.features.quantities import OF_CELLS
from edge.files import parsing
from edge.record.npz import load_arrays, load_meta
from edge.record.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.track import first_contact

Line = tuple[str, Array, Array]
"""A quantity to compare: name, computed values, expected ones."""


@dataclass(frozen=True)
class Check:
    """One compared quantity.

    Attributes:
        name: the quantity.
        rows: how many rows were compared.
        row: the first that differs, or None where all rows are equal.
        value: the computed value there.
        expected: the golden value there.
    """

    name: str
    rows: int
    row: int | None = None
    value: str = ""
    expected: str = ""

    @property
    def passed(self) -> bool:
        """Whether all rows are equal."""
        return self.row is None


def golden_of(model: str | Path, version: str) -> Path:
    """The golden file of an installed model, beside it."""
    return Path(model).with_name(f"golden-{version}.npz")


def first_series(
    recording: Recording, model: Model
) -> tuple[float, FeatureSeries] | None:
    """Onset and series of a recording's first contact, by the board's own path."""
    return first_contact(recording, model.info.tracker(recording.layout))


def integers_of(series: FeatureSeries) -> Integers:
    """(n, m) all whole numbers: peak, area, sums, those of the zones, the cells."""
    cells = [c for c in map(vars(series).get, OF_CELLS) if c is not None]
    return np.column_stack(
        [series.peak, series.area, series.sums, *series.zones.values(), *cells]
    )


def verify(model: Model, path: str | os.PathLike[str]) -> list[Check]:
    """Run a golden file's frames and vectors, and compare.

    Raises:
        InputError: the golden file is damaged, or was made for a model of another form.
    """
    name = os.fspath(path)
    arrays = load_arrays(name)
    meta = load_meta(name, arrays)
    if meta.get("model", model.info.data_digest) != model.info.data_digest:
        raise InputError(
            f"{name}: is of another model than {model.path}; copy or export both together"
        )
    with parsing(
        name,
        "a golden file of this model",
        "; export it again with the model",
    ):
        SkinLayout.from_dict(meta["skin"], where=name)
        lines = chain(_path(model, name, arrays, meta), _graph(model, name, arrays))
        return list(starmap(compared, lines))


def _trials(arrays: dict[str, Array], meta: dict[str, Any]) -> Iterator[Recording]:
    keys = [key for key in ("t", "frames", "joints", "valid", "shear") if key in arrays]
    for first, end in pairwise(arrays["start"].tolist()):
        if not 0 <= first < end <= len(arrays["t"]):
            raise ValueError("a trial has no frames")
        columns = {key: arrays[key][first:end] for key in keys}
        yield Recording(**columns, meta={"skin": meta["skin"]})


def _path(
    model: Model,
    name: str,
    arrays: dict[str, Array],
    meta: dict[str, Any],
) -> Iterator[Line]:
    """Onsets, series and feature vectors of the trials."""
    info = model.info
    windows = (info.window_s, *info.decision_points_s)
    onsets = []
    integers = []
    vectors = []
    for i, trial in enumerate(_trials(arrays, meta)):
        model.require_joints(trial.dof, f"{name}: trial {i}")
        contact = first_series(trial, model)
        if contact is None:
            continue
        onsets.append(contact[0])
        integers.append(integers_of(contact[1]))
        vectors.append([info.vector(contact[1], window_s) for window_s in windows])
    trials = len(onsets)
    at_windows = np.array(vectors).swapaxes(0, 1)
    lengths = np.array(list(map(len, integers)))
    yield "series length", lengths, np.diff(arrays["series_start"])
    yield "series counts", np.concatenate(integers), arrays["series_counts"]
    yield "onset", np.array(onsets), arrays["onset_s"]
    yield "features", at_windows[0], arrays["vectors"][:trials]
    if info.decision_points_s:
        stored = arrays["decision_point_vectors"][:, :trials]
        yield "features at decision points", at_windows[1:], stored


def _graph(
    model: Model,
    name: str,
    arrays: dict[str, Array],
) -> Iterator[Line]:
    """The graph's outputs for the stored vectors."""
    for key in ("vectors", "decision_point_vectors"):
        if key in arrays and arrays[key].shape[-1:] != (model.info.width,):
            raise InputError(
                f"{name}: {key} has the shape {arrays[key].shape}, but {model.path} "
                f"takes {model.info.width} features; export both together"
            )
    for key, answer in answers(model, arrays).items():
        yield key, answer, arrays[key]


def answers(model: Model, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """{key: the graph's output} for the vectors of a golden file, each at its decision
    point."""
    results = _outputs(model, arrays["vectors"])
    if model.info.decision_points_s:
        rows = enumerate(arrays["decision_point_vectors"])
        points = [_outputs(model, vectors, point) for point, vectors in rows]
        for key in points[0]:
            results[f"decision_point_{key}"] = np.stack([p[key] for p in points])
    return results


def _outputs(
    model: Model,
    vectors: Floats,
    decision_point: int | None = None,
) -> dict[str, Array]:
    """The model's outputs for vectors (n, width), asked one by one as on the board.

    ONNX leaves open where NaN stands in an order. So what follows from a vector without
    a label, as one that is not finite, is 0.
    """
    vectors = np.ascontiguousarray(vectors, np.float64)
    rows = [model.run(vector[None], decision_point) for vector in vectors]
    outputs = {key: np.concatenate([row[key] for row in rows]) for key in rows[0]}
    labels = {f"{task}_label" for task in model.info.tasks}
    refused = np.min([outputs[label] for label in labels], axis=0) < 0
    for key in outputs.keys() - labels:
        outputs[key][refused] = 0
    return outputs


def compared(name: str, values: Array, expected: Array) -> Check:
    """Compare a quantity, whose first axis is the rows; NaN is equal to NaN."""
    rows = len(expected)
    if values.shape != expected.shape:
        shapes = f"shape {values.shape}", f"{expected.shape}"
        return Check(name, rows, 0, *shapes)
    differ = (values != expected) & ~(np.isnan(values) & np.isnan(expected))
    if not differ.any():
        return Check(name, rows)
    place = tuple(np.argwhere(differ)[0])
    return Check(name, rows, int(place[0]), str(values[place]), str(expected[place]))
