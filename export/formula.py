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
        self._constants = model.contents.constants
        self._width = model.info.width
        self._pools = pools
        tasks = model.info.tasks
        self.spaces = 1 + max(int(self._constants[f"space of {t}"]) for t in tasks)
        self.trials = max(len(self._constants[f"labels of {t}"]) for t in tasks)
        self.nearest = 0
        self.work = dict.fromkeys(WORK, 0)
        self.projections = [p for point in points for p in self._projections(point)]
        self.components = max(int(p["components"][0]) for p in self.projections)
        for task in tasks:
            coordinates = self._constants[f"coordinates of {task}"]
            self.components = max(self.components, coordinates.shape[-2])
        for of_space in self.projections[-self.spaces :]:
            self._weigh(of_space)

    def _at(self, name: str, point: int, axes: int) -> Floats:
        """A constant of so many axes at a decision point."""
        return np.asarray(Constants(self._constants, point).numbers(name, axes), float)

    def _weigh(self, projection: Array) -> None:
        count = int(projection["count"][0])
        self.work["row"] += count
        self.work["product"] += count * int(projection["components"][0])

    def _part(self, space: int, point: int) -> tuple[str, int]:
        """How the constants of a space at a decision point are called, and their place
        among those that are called so."""
        first, name = Constants(self._constants, point).projection(space)
        return name, point - first

    def _projections(self, point: int) -> list[Array]:
        """The `ec_projection` of each space at a decision point."""
        means: list[tuple[Floats, Array]] = []
        places = []
        for space in range(self.spaces):
            name, at = self._part(space, point)
            wide = np.zeros(self._width)
            mine = np.zeros(self._width, bool)
            columns = self._constants.get(f"columns {name}", np.arange(self._width))
            wide[columns] = self._at(f"means {name}", at, 1)
            mine[columns] = True
            places.append(_shared(means, wide, mine))
        series = [self._pools.series(wide) for wide, _ in means]
        return [
            self._projection(space, point, series[place])
            for space, place in enumerate(places)
        ]

    def _projection(self, space: int, point: int, means: Array) -> Array:
        name, at = self._part(space, point)
        weights = self._at(f"weights {name}", at, 2)
        used = int(np.flatnonzero(weights.any(0)).max(initial=0)) + 1
        matrix, shift = self._pools.matrix(weights[:, :used])
        columns = self._constants.get(f"columns {name}")
        return record(
            "ec_projection",
            most_steps=self._at("most steps", point, 0),
            factor=2.0**-shift,
            limit=self._at(f"limits of space {space}", point, 0),
            means=means,
            gains=self._pools.series(self._at(f"gains {name}", at, 1)),
            columns=NOWHERE if columns is None else self._pools.add("words", columns),
            matrix=matrix,
            count=len(weights),
            components=used,
        )

    def doubt(self, point: int, limits: dict[str, float]) -> Array:
        """The `ec_doubt` of a decision point, with the limits of the scores."""
        pools = self._pools
        weights = self._at("novelty weights", point, 2)
        matrix, shift = pools.matrix(weights)
        projection = record(
            "ec_projection",
            most_steps=self._at("novelty most steps", point, 0),
            factor=self._at("novelty factor", point, 0) * 2.0**-shift,
            means=pools.series(self._at("novelty means", point, 1)),
            gains=pools.series(self._at("novelty gains", point, 1)),
            columns=NOWHERE,
            matrix=matrix,
            count=len(weights),
            components=weights.shape[1],
        )
        whitening, fine = pools.matrix(self._at("novelty whitening", point, 2))
        rows, _ = pools.matrix(self._at("novelty coordinates", point, 2) / -2.0)
        squares = self._at("remoteness weights", point, 1) ** 2
        self.components = max(self.components, weights.shape[1])
        return record(
            "ec_doubt",
            projection=projection,
            factor=self._at("novelty whitening factors", point, 0) * 2.0**-fine,
            limit=self._at("novelty limit", point, 0),
            nearness=pools.series(self._at("novelty nearness", point, 1)),
            weighted_nearness=pools.series(self._at("remoteness nearness", point, 1)),
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
        coordinates = self._at(f"coordinates of {task}", point, 2) / -2.0
        mask = f"mask of {task}"
        if mask in self._constants:
            coordinates = coordinates[self._at(mask, point, 1) > 0.0]
        rows, _ = self._pools.matrix(coordinates)
        scales = f"scales of {task}"
        space = int(self._constants[f"space of {task}"])
        return record(
            "ec_place",
            unit=self._at("units", point, 1)[space],
            scale=self._at(scales, point, 0) if scales in self._constants else 0.0,
            curve=curve,
            rows=rows,
            components=len(coordinates),
        )

    def task(self, task: str) -> dict[str, Any]:
        """Fields of an `ec_task`."""
        labels = self._constants[f"labels of {task}"]
        counts = self._constants.get(f"counts of {task}")
        nearest = 0 if counts is None else int(counts.sum())
        self.nearest = max(self.nearest, nearest)
        self.work["root"] += nearest
        add = self._pools.add
        width = self._constants[f"coordinates of {task}"].shape[-2]
        self.work["trial"] += len(labels)
        self.work["square"] += len(labels) * width
        return {
            "trials": add("words", np.where(labels < 0, NO_LABEL, labels)),
            "counts": NOWHERE if counts is None else add("words", counts),
            "space": int(self._constants[f"space of {task}"]),
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
