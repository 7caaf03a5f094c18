"""golden.npz: raw frames with every result on the way to a decision, to hold the path to.

| key | type | meaning |
|---|---|---|
| `start` | int64 (m + 1,) | trial i is rows start[i] to start[i + 1] of `t`, `frames`, `joints` |
| `t`, `frames`, `joints`, `valid` | as in a recording | the trials, one after another |
| `series_start` | int64 (m + 1,) | the same for the series |
| `onset_s` | float64 (m,) | |
| `series_t` | float64 (s,) | |
| `series_counts` | int64 (s, c) | `FeatureSeries.integers`: exact |
| `vectors` | float64 (v, width) | feature vectors; the first m are the trials', in order; `twins` |
| `<task>_label`, `_scores`, `_distances`, `_neighbours`, `_next` | | the graph's, for `vectors` |
| `<task>_label_distances` | float64 (v, labels) | likewise, of a model with decision points |
| `decision_point_vectors` | float64 (points, w, width) | likewise, for each decision point |
| `<task>_decision_point_label`, ... | | the graph's outputs for these, each at its point |
| `meta` | JSON text | `skin`, `bounds` {`scores`, `distances`, `features`, `time_s`} |

A bound b allows abs(seen - expected) <= b * max(1, abs(expected)).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.model.model import Model, require_joints
from edge.recording import Recording, load_arrays, load_meta
from edge.touch.contact import FeatureSeries
from edge.touch.features import feature_vector
from edge.touch.layout import SkinLayout
from edge.touch.track import first_contact

PARTS = ("label", "neighbours", "scores", "distances", "next")


@dataclass(frozen=True)
class Check:
    """One compared quantity.

    Attributes:
        name: the quantity.
        rows: how many rows were compared.
        worst: largest difference over its allowance; exact quantities give 0 or infinity.
        row: where, or None where all rows are equal.
        seen: the value there.
        expected: the golden value there.
    """

    name: str
    rows: int
    worst: float
    row: int | None
    seen: str = ""
    expected: str = ""

    @property
    def passed(self) -> bool:
        """Within the bound."""
        return self.worst <= 1.0


FLOAT64 = "float64"
"""The check that fails where an engine computes in float32: the operators are the standard's and
the tensors float64, yet an engine may compute in less without a word."""
SINGLE_BITS = 24
"""Of a mantissa in float32."""


def twins(vectors: NDArray[np.float64]) -> NDArray[np.intp]:
    """(m,) the rows of vectors (n, width) that float64 tells from the next one, not float32."""
    mantissas, exponents = np.frexp(vectors)
    single = np.rint(np.ldexp(mantissas, SINGLE_BITS))
    alike = (single[1:] == single[:-1]) & (exponents[1:] == exponents[:-1])
    return np.flatnonzero(alike.all(axis=1) & (vectors[1:] != vectors[:-1]).any(axis=1))


def first_series(recording: Recording, model: Model) -> tuple[float, FeatureSeries] | None:
    """Onset and series of a recording's first contact, by the board's own path."""
    return first_contact(recording, model.info.tracker(recording.layout))


def verify(model: Model, path: str | os.PathLike[str]) -> list[Check]:
    """Run a golden file's frames and vectors, and compare.

    Raises:
        InputError: the golden file is damaged, or was made for a model of another form.
    """
    name = os.fspath(path)
    arrays = load_arrays(name)
    meta = load_meta(name, arrays)
    try:
        bounds = {str(key): float(bound) for key, bound in meta["bounds"].items()}
        trials = _trials(name, arrays, meta)
        checks = _verify_path(model, trials, arrays, bounds)
        return checks + _verify_graph(model, name, arrays, bounds)
    except KeyError as error:
        raise InputError(f"{name}: lacks {error}; export it again with the model") from None
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name}: not a golden file ({error}); export it again") from None


def _trials(name: str, arrays: dict[str, NDArray[Any]], meta: dict[str, Any]) -> list[Recording]:
    start = arrays["start"].astype(np.int64)
    trials: list[Recording] = []
    for i, (a, b) in enumerate(zip(start[:-1].tolist(), start[1:].tolist(), strict=True)):
        if not 0 <= a < b <= len(arrays["t"]):
            raise InputError(f"{name}: trial {i} has no frames; export it again")
        valid = arrays.get("valid")
        trials.append(
            Recording(
                t=arrays["t"][a:b],
                frames=arrays["frames"][a:b],
                joints=arrays["joints"][a:b] if "joints" in arrays else None,
                valid=None if valid is None else valid[a:b],
                meta={"skin": meta["skin"]},
            )
        )
    SkinLayout.from_dict(meta["skin"], where=name)
    return trials


def _verify_path(
    model: Model,
    trials: list[Recording],
    arrays: dict[str, NDArray[Any]],
    bounds: dict[str, float],
) -> list[Check]:
    info = model.info
    onsets = np.full(len(trials), np.nan)
    vectors = np.full((len(trials), info.width), np.nan)
    decision_point_vectors = np.full((len(info.decision_points_s), *vectors.shape), np.nan)
    starts = arrays["series_start"]
    counts: list[NDArray[np.int64]] = []
    wrong_length: Check | None = None
    for i, trial in enumerate(trials):
        require_joints(model, None if trial.joints is None else trial.joints.shape[1], f"trial {i}")
        found = first_series(trial, model)
        length = int(starts[i + 1] - starts[i])
        rows = np.zeros((length, arrays["series_counts"].shape[1]), dtype=np.int64)
        if found is not None:
            onsets[i], series = found
            vectors[i] = feature_vector(series, info.window_s, info.samples, info.features)
            for decision_point, window in enumerate(info.decision_points_s):
                decision_point_vectors[decision_point, i] = feature_vector(
                    series, window, info.samples, info.features
                )
            seen = series.integers
            if seen.shape == rows.shape:
                rows = seen
            elif wrong_length is None:
                wrong_length = Check(
                    "series length", len(trials), np.inf, i, str(seen.shape), str(rows.shape)
                )
        counts.append(rows)
    expected = arrays["vectors"][: len(trials)]
    at_decision_points = []
    if info.decision_points_s:
        stored = arrays["decision_point_vectors"][:, : len(trials)]
        at_decision_points = [
            _close(
                "features at decision points", decision_point_vectors, stored, bounds["features"]
            )
        ]
    return [
        wrong_length or Check("series length", len(trials), 0.0, None),
        _exact("series counts", np.concatenate(counts), arrays["series_counts"]),
        _close("onset", onsets, arrays["onset_s"], bounds["time_s"]),
        _close("features", vectors, expected, bounds["features"]),
        *at_decision_points,
    ]


def _verify_graph(
    model: Model, name: str, arrays: dict[str, NDArray[Any]], bounds: dict[str, float]
) -> list[Check]:
    vectors = np.ascontiguousarray(arrays["vectors"], dtype=np.float64)
    if vectors.ndim != 2 or vectors.shape[1] != model.info.width:
        raise InputError(
            f"{name}: its vectors are {vectors.shape[1:]} long, "
            f"{model.path} takes {model.info.width}; export both together"
        )
    tasks = sorted(
        key.removesuffix("_label")
        for key in arrays
        if key.endswith("_label") and not key.endswith("_decision_point_label")
    )
    if tasks != sorted(model.info.tasks):
        raise InputError(
            f"{name}: is for the tasks {', '.join(tasks) or 'none'}, {model.path} answers "
            f"{', '.join(sorted(model.info.tasks))}; export both together"
        )
    answers = outputs(model, vectors)
    checks = [*_told_apart(model, vectors, answers, arrays)]
    checks += _compare(model, answers, arrays, bounds, "")
    if model.info.decision_points_s:
        at_decision_points = np.ascontiguousarray(
            arrays["decision_point_vectors"], dtype=np.float64
        )
        if at_decision_points.shape[::2] != (len(model.info.decision_points_s), model.info.width):
            raise InputError(
                f"{name}: has no vectors for the model's decision points; export both together"
            )
        seen = [
            outputs(model, rows, decision_point)
            for decision_point, rows in enumerate(at_decision_points)
        ]
        stacked = {key: np.stack([one[key] for one in seen]) for key in seen[0]}
        checks += _compare(model, stacked, arrays, bounds, "decision_point_")
    return checks


def parts(model: Model) -> tuple[str, ...]:
    """What a model says of a task."""
    return (*PARTS, "label_distances") if model.info.decision_points_s else PARTS


def outputs(
    model: Model, vectors: NDArray[np.float64], decision_point: int | None = None
) -> dict[str, NDArray[Any]]:
    """The graph's outputs for vectors (n, width), asked one by one as the board does."""
    single = [model.run(vectors[i : i + 1], decision_point) for i in range(len(vectors))]
    return {key: np.concatenate([row[key] for row in single]) for key in single[0]}


def _told_apart(
    model: Model,
    vectors: NDArray[np.float64],
    seen: dict[str, NDArray[Any]],
    arrays: dict[str, NDArray[Any]],
) -> Iterator[Check]:
    """Whether most twins whose distances differ have other distances here too."""
    first = twins(vectors)
    for task in model.info.tasks:
        key = f"{task}_distances"
        expected, found = arrays[key], seen[key]
        rows = first[(expected[first] != expected[first + 1]).any(axis=1)]
        same = (found[rows] == found[rows + 1]) | ~np.isfinite(found[rows])
        lost = rows[same.all(axis=1)]
        if 2 * len(lost) > len(rows):
            row = int(lost[0]) + 1
            yield Check(FLOAT64, len(rows), np.inf, row, str(found[row]), str(expected[row]))
            return
    if len(first):
        yield Check(FLOAT64, len(first), 0.0, None)


def _compare(
    model: Model,
    seen: dict[str, NDArray[Any]],
    arrays: dict[str, NDArray[Any]],
    bounds: dict[str, float],
    prefix: str,
) -> list[Check]:
    checks: list[Check] = []
    for task in model.info.tasks:
        for part in parts(model):
            key = f"{task}_{prefix}{part}"
            values = seen[f"{task}_{part}"]
            if part in bounds:
                checks.append(_close(key, values, arrays[key], bounds[part]))
            else:
                checks.append(_exact(key, values, arrays[key]))
    return checks


def _exact(name: str, seen: NDArray[Any], expected: NDArray[Any]) -> Check:
    if seen.shape != expected.shape:
        return Check(name, len(expected), np.inf, 0, f"shape {seen.shape}", f"{expected.shape}")
    differs = (seen != expected).reshape(len(seen), -1).any(axis=1)
    if not differs.any():
        return Check(name, len(seen), 0.0, None)
    row = int(np.argmax(differs))
    return Check(name, len(seen), np.inf, row, str(seen[row]), str(expected[row]))


def _close(name: str, seen: NDArray[Any], expected: NDArray[Any], bound: float) -> Check:
    if seen.shape != expected.shape:
        return Check(name, len(expected), np.inf, 0, f"shape {seen.shape}", f"{expected.shape}")
    if seen.size == 0:
        return Check(name, 0, 0.0, None)
    allowance = bound * np.maximum(1.0, np.abs(expected))
    same = (seen == expected) | (np.isnan(seen) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        gap = np.where(same, 0.0, np.abs(seen - expected))
        # Of infinite values only equal ones are near, however wide an infinite allowance is.
        share = gap / np.where((allowance > 0.0) & (allowance < np.inf), allowance, 1e-300)
    share = np.where(gap == 0.0, 0.0, np.where(np.isnan(gap), np.inf, share))
    flat = share.reshape(len(seen), -1)
    row, column = np.unravel_index(int(np.argmax(flat)), flat.shape)
    worst = float(flat[row, column])
    if worst == 0.0:
        return Check(name, len(seen), 0.0, None)
    return Check(
        name,
        len(seen),
        worst,
        int(row),
        repr(float(seen.reshape(len(seen), -1)[row, column])),
        repr(float(expected.reshape(len(seen), -1)[row, column])),
    )
