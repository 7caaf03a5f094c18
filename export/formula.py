"""The tables of `export/c/formula.c`, from the constants that a model's graph names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from edge.arrays import Array, Floats
from edge.decide.info import StoppingRule
from edge.decide.knn import Constants
from edge.decide.model import Model
from export.image import NOWHERE, Pools, record

FRACTION_BITS = 8
"""Of the squared weights of coordinates: `EC_FRACTION_BITS`."""
NO_LABEL = 65535


class Formula:
    """What a decision is computed by.

    Attributes:
        tables: {name: its records}: projections, tasks, places and doubts.
        sizes: fields of the `ec_sizes`.
        trials: how many there are.
        naming: the task that names objects; `NOWHERE` where nothing is unknown.
    """

    def __init__(
        self,
        model: Model,
        points: Sequence[int],
        pools: Pools,
        rules: Mapping[str, StoppingRule | None],
        has_outliers: bool,
    ) -> None:
        """Read the constants.

        Args:
            model: whose they are.
            points: the decision points that are kept.
            pools: take the numbers.
            rules: of the tasks, for early decisions.
            has_outliers: whether the outlier score and the distance to known objects are
                kept.

        Raises:
            InputError: C cannot take a number.
        """
        arrays = model.contents.constants
        self._info = model.info
        self._points = {point: Constants(arrays, point) for point in points}
        self._last = at = self._points[points[-1]]
        self._pools = pools
        tasks = self._info.tasks
        self._spaces = 1 + max(map(at.space, tasks))
        self.trials = max(len(at.numbers(f"labels of {t}", 1)) for t in tasks)
        projections = [
            projection
            for point in points
            for projection in self._projections(self._points[point])
        ]
        of_tasks = [self._task(name, rules.get(name)) for name in tasks]
        places = self._places(points)
        self.naming = self._naming() if has_outliers else NOWHERE
        doubts = [self._doubt(point) for point in points] if has_outliers else []
        self.tables = {
            "projections": projections,
            "tasks": of_tasks,
            "places": places,
            "doubts": doubts,
        }
        projected = [*projections, *(doubt["projection"] for doubt in doubts)]
        self.sizes = {**self._sizes(projected), "has_outliers": has_outliers}

    def _sizes(self, projections: Sequence[Array]) -> dict[str, int]:
        """The fields of the `ec_sizes` that tasks and projections need."""
        at = self._last
        tasks = self._info.tasks
        near = [f"counts of {name}" for name in tasks if f"scales of {name}" in at]
        widths = [len(at.coordinates(name)) for name in tasks]
        widths += [int(projection["components"][0]) for projection in projections]
        return {
            "tasks": len(tasks),
            "labels": max(len(task.labels) for task in tasks.values()),
            "neighbours": max(task.k for task in tasks.values()),
            "nearest": max((int(at.numbers(n, 1).sum()) for n in near), default=0),
            "components": max(widths),
            "spaces": self._spaces,
        }

    def _places(self, points: Sequence[int]) -> list[Array]:
        """The `ec_place` of each task at each decision point."""
        tasks = self._info.tasks
        # Of a space the rows with most components come first: others are parts of them.
        wide = sorted(tasks, key=lambda name: -tasks[name].components)
        places = {
            (point, name): self._place(name, point) for point in points for name in wide
        }
        return [places[point, name] for point in points for name in tasks]

    def _projections(self, at: Constants) -> list[Array]:
        """The `ec_projection` of each space at a decision point."""
        means: list[tuple[Floats, Array]] = []
        places = []
        for space in range(self._spaces):
            first, name = at.projection(space)
            wide = np.zeros(self._info.width)
            mine = np.zeros(self._info.width, bool)
            columns: Any = slice(None)
            if f"columns {name}" in at:
                columns = at.numbers(f"columns {name}", 1)
            wide[columns] = at.numbers(f"means {name}", 1, first)
            mine[columns] = True
            places.append(_shared(means, wide, mine))
        series = [self._pools.series(wide) for wide, _ in means]
        return [
            self._projection(space, at, series[place])
            for space, place in enumerate(places)
        ]

    def _projection(self, space: int, at: Constants, means: Array) -> Array:
        first, name = at.projection(space)
        weights = at.numbers(f"weights {name}", 2, first)
        used = int(np.flatnonzero(weights.any(0)).max(initial=0)) + 1
        matrix, shift = self._pools.matrix(weights[:, :used])
        columns = NOWHERE
        if f"columns {name}" in at:
            columns = self._pools.add("words", at.numbers(f"columns {name}", 1))
        return record(
            "ec_projection",
            most_steps=at.numbers("most steps"),
            factor=2.0**-shift,
            limit=at.numbers(f"limits of space {space}"),
            means=means,
            gains=self._pools.series(at.numbers(f"gains {name}", 1, first)),
            columns=columns,
            matrix=matrix,
            count=len(weights),
            components=used,
        )

    def _naming(self) -> int:
        """The task that names objects; `NOWHERE` where nothing is unknown."""
        for i, name in enumerate(self._info.tasks):
            stopping = self._info.stopping.get(name)
            if stopping is not None and stopping.known_distance is not None:
                return i
        return NOWHERE

    def _limits(self, point: int) -> dict[str, float]:
        """The limits of the scores of doubt at a decision point."""
        info = self._info
        assert info.outlier_score is not None
        limits = {
            "typical": info.outlier_score.typical[point],
            "outlying": info.outlier_score.limits[point],
        }
        if self.naming != NOWHERE:
            far = info.stopping[[*info.tasks][self.naming]].known_distance
            assert far is not None
            limits["far"] = far.limits[point]
            limits["middle"] = far.middles[point]
            limits["slope"] = far.slopes[point]
        return limits

    def _doubt(self, point: int) -> Array:
        """The `ec_doubt` of a decision point."""
        pools = self._pools
        at = self._points[point]
        weights = at.numbers("outlier weights", 2)
        matrix, shift = pools.matrix(weights)
        projection = record(
            "ec_projection",
            most_steps=at.numbers("outlier most steps"),
            factor=at.numbers("outlier factor") * 2.0**-shift,
            means=pools.series(at.numbers("outlier means", 1)),
            gains=pools.series(at.numbers("outlier gains", 1)),
            columns=NOWHERE,
            matrix=matrix,
            count=len(weights),
            components=weights.shape[1],
        )
        whitening, fine = pools.matrix(at.numbers("outlier whitening", 2))
        rows, _ = pools.matrix(at.numbers("outlier coordinates", 2) / -2.0)
        squares = at.numbers("known weights", 1) ** 2
        return record(
            "ec_doubt",
            projection=projection,
            factor=at.numbers("outlier whitening factors") * 2.0**-fine,
            limit=at.numbers("outlier limit"),
            nearness=pools.series(at.numbers("outlier nearness", 1)),
            weighted_nearness=pools.series(at.numbers("known nearness", 1)),
            whitening=whitening,
            rows=rows,
            weights=pools.add("words", squares * 2.0**FRACTION_BITS),
            **self._limits(point),
        )

    def _place(self, task: str, point: int) -> Array:
        """The `ec_place` of a task at a decision point."""
        at = self._points[point]
        coordinates = at.coordinates(task) / -2.0
        if f"mask of {task}" in at:
            coordinates = coordinates[at.numbers(f"mask of {task}", 1) > 0.0]
        rows, _ = self._pools.matrix(coordinates)
        scales = f"scales of {task}"
        return record(
            "ec_place",
            unit=at.numbers("units", 1)[at.space(task)],
            scale=at.numbers(scales) if scales in at else 0.0,
            curve=self._curve(task, point),
            rows=rows,
            components=len(coordinates),
        )

    def _curve(self, task: str, point: int) -> tuple[float, float, float]:
        """The curve of a task's confidence at a decision point."""
        of = self._info.stopping.get(task)
        if of is None:
            return 0.0, 0.0, 0.0
        return of.slopes[point], of.intercepts[point], of.doubts[point]

    def _task(self, name: str, rule: StoppingRule | None) -> Array:
        """The `ec_task` of a task, with its rule for early decisions, if any."""
        task = self._info.tasks[name]
        names = list(self._info.tasks)
        at = self._last
        add = self._pools.add
        factors = [names.index(factor) for factor in task.factors]
        indices = [add("words", of) for of in task.factors.values()]
        labels = at.numbers(f"labels of {name}", 1)
        counts = NOWHERE
        if f"scales of {name}" in at:
            counts = add("words", at.numbers(f"counts of {name}", 1))
        of_task = record(
            "ec_task",
            text=self._pools.text(name, *task.labels),
            trials=add("words", np.where(labels < 0, NO_LABEL, labels)),
            counts=counts,
            indices=indices or NOWHERE,
            labels=len(task.labels),
            k=task.k,
            space=at.space(name),
            factors=factors or 0,
        )
        stopping = self._info.stopping.get(name)
        if stopping is not None:
            of_task["rule_curve"] = stopping.slope, stopping.intercept, stopping.doubt
        if rule:
            of_task["rule_confidence"] = rule.confidence
            of_task["rule_last"] = rule.last
            of_task["has_rule"] = True
        return of_task


def _shared(tables: list[tuple[Floats, Array]], wide: Floats, mine: Array) -> int:
    """The place of a table of numbers by feature that has some features'; tasks share
    one where they agree."""
    for place, (other, theirs) in enumerate(tables):
        if (other == wide)[mine & theirs].all():
            tables[place] = np.where(theirs, other, wide), mine | theirs
            return place
    tables.append((wide, mine))
    return len(tables) - 1
