"""The tables of `export/c/formula.c`, from the constants that a model's graph names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from edge.arrays import Array, Floats
from edge.decide.knn import Constants
from edge.decide.model import Model
from export.image import NOWHERE, Pools, record

FRACTION_BITS = 8
"""Of the squared weights of coordinates: `EC_FRACTION_BITS`."""
NO_LABEL = 65535
WORK = ("row", "product", "trial", "square", "root")


class Formula:
    """What a decision is computed by.

    Attributes:
        spaces: how many there are.
        trials: likewise.
        components: the most of a space.
        nearest: trials that count for the distances to all labels of a task, at most.
        projections: the `ec_projection` of each point and space.
        work: {kind: how much of it a decision takes}; `WORK` are the kinds.
    """

    def __init__(self, model: Model, points: Sequence[int], pools: Pools) -> None:
        """Read the constants.

        Args:
            model: whose they are.
            points: the decision points that are kept.
            pools: take the numbers.

        Raises:
            InputError: C cannot take a number.
        """
        arrays = model.contents.constants
        self._points = {point: Constants(arrays, point) for point in points}
        at = self._points[points[-1]]
        self._width = model.info.width
        self._pools = pools
        tasks = model.info.tasks
        self.spaces = 1 + max(map(at.space, tasks))
        self.trials = max(len(at.numbers(f"labels of {t}", 1)) for t in tasks)
        self.nearest = 0
        self.work = dict.fromkeys(WORK, 0)
        self.projections = [
            made for point in points for made in self._projections(self._points[point])
        ]
        widths = [len(at.numbers(f"coordinates of {task}", 2)) for task in tasks]
        self.components = max(
            widths + [int(p["components"][0]) for p in self.projections]
        )
        for of_space in self.projections[-self.spaces :]:
            self._weigh(of_space)

    def _weigh(self, projection: Array) -> None:
        count = int(projection["count"][0])
        self.work["row"] += count
        self.work["product"] += count * int(projection["components"][0])

    def _projections(self, at: Constants) -> list[Array]:
        """The `ec_projection` of each space at a decision point."""
        means: list[tuple[Floats, Array]] = []
        places = []
        for space in range(self.spaces):
            first, name = at.projection(space)
            wide = np.zeros(self._width)
            mine = np.zeros(self._width, bool)
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

    def doubt(self, point: int, limits: dict[str, float]) -> Array:
        """The `ec_doubt` of a decision point, with the limits of the scores."""
        pools = self._pools
        at = self._points[point]
        weights = at.numbers("novelty weights", 2)
        matrix, shift = pools.matrix(weights)
        projection = record(
            "ec_projection",
            most_steps=at.numbers("novelty most steps"),
            factor=at.numbers("novelty factor") * 2.0**-shift,
            means=pools.series(at.numbers("novelty means", 1)),
            gains=pools.series(at.numbers("novelty gains", 1)),
            columns=NOWHERE,
            matrix=matrix,
            count=len(weights),
            components=weights.shape[1],
        )
        whitening, fine = pools.matrix(at.numbers("novelty whitening", 2))
        rows, _ = pools.matrix(at.numbers("novelty coordinates", 2) / -2.0)
        squares = at.numbers("remoteness weights", 1) ** 2
        self.components = max(self.components, weights.shape[1])
        return record(
            "ec_doubt",
            projection=projection,
            factor=at.numbers("novelty whitening factors") * 2.0**-fine,
            limit=at.numbers("novelty limit"),
            nearness=pools.series(at.numbers("novelty nearness", 1)),
            weighted_nearness=pools.series(at.numbers("remoteness nearness", 1)),
            whitening=whitening,
            rows=rows,
            weights=pools.add("words", squares * 2.0**FRACTION_BITS),
            **limits,
        )

    def weigh_doubt(self, doubt: Array) -> None:
        """Count the work of the scores."""
        self._weigh(doubt["projection"])
        components = int(doubt["projection"]["components"][0])
        self.work["product"] += components**2
        self.work["trial"] += 2 * self.trials
        self.work["square"] += 2 * self.trials * components

    def place(self, task: str, point: int, curve: Sequence[float]) -> Array:
        """The `ec_place` of a task at a decision point, with its curve of confidence."""
        at = self._points[point]
        coordinates = at.numbers(f"coordinates of {task}", 2) / -2.0
        if f"mask of {task}" in at:
            coordinates = coordinates[at.numbers(f"mask of {task}", 1) > 0.0]
        rows, _ = self._pools.matrix(coordinates)
        scales = f"scales of {task}"
        return record(
            "ec_place",
            unit=at.numbers("units", 1)[at.space(task)],
            scale=at.numbers(scales) if scales in at else 0.0,
            curve=curve,
            rows=rows,
            components=len(coordinates),
        )

    def task(self, task: str) -> dict[str, Any]:
        """Fields of an `ec_task`."""
        at = [*self._points.values()][-1]
        labels = at.numbers(f"labels of {task}", 1)
        add = self._pools.add
        counts = NOWHERE
        if f"scales of {task}" in at:
            of_labels = at.numbers(f"counts of {task}", 1)
            counts = add("words", of_labels)
            self.nearest = max(self.nearest, int(of_labels.sum()))
            self.work["root"] += int(of_labels.sum())
        width = len(at.numbers(f"coordinates of {task}", 2))
        self.work["trial"] += len(labels)
        self.work["square"] += len(labels) * width
        return {
            "trials": add("words", np.where(labels < 0, NO_LABEL, labels)),
            "counts": counts,
            "space": at.space(task),
        }


def _shared(tables: list[tuple[Floats, Array]], wide: Floats, mine: Array) -> int:
    """The place of a table of numbers by feature that has some features'; tasks share
    one where they agree."""
    for place, (other, theirs) in enumerate(tables):
        if (other == wide)[mine & theirs].all():
            tables[place] = np.where(theirs, other, wide), mine | theirs
            return place
    tables.append((wide, mine))
    return len(tables) - 1
