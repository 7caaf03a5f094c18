"""`python -m tests.hard_cases.adversarial`: thousands of small training sets made to be hard.

Each family makes rows, queries and a model by a seed; the model's neighbours, in order, and its
label are compared with an oracle of whole numbers that shares no code with them. Where two
candidates are nearer to each other than the arithmetic can tell, a decision may carry the flag
`close`; without it the answer must be the oracle's. On a part of the sets `onnx.reference` is
asked too: its labels and neighbours must be ONNX Runtime's, flag or not, save for flagged queries
so far out that sums of products round (`edge.model.model.EXACT_REACH`).
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx.reference import ReferenceEvaluator
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.errors import InputError
from edge.model.model import EXACT_REACH, Model
from export.graph import to_onnx
from tests.hard_cases import exact
from tests.hard_cases.models import Array, describe
from train.pipeline import Choice, ContactClassifier

WIDTH = 24
"""Columns of a vector: eight samples of three features."""
QUERIES = 8
SETS = 1000
REFERENCE = 20
"""One set in so many is also asked of onnx.reference, which takes a hundred times as long."""
CORPUS = Path(__file__).with_name("corpus.json")


@dataclass(frozen=True)
class Hard:
    """A training set, its labels, queries, and how the model is fitted."""

    X: Array
    y: NDArray[np.int64]
    queries: Array
    choice: Choice


def typical(draw: np.random.Generator, n: int) -> Array:
    """Vectors with the scales of force, area and motion."""
    X = draw.gamma(2.0, size=(n, WIDTH))
    X[:, 8:16] *= 30.0
    X[:, 16:] *= 0.02
    return X


def choice(draw: np.random.Generator, n: int, scaling: str = "none", **more: Any) -> Choice:
    """Components and neighbours by chance, even numbers of neighbours more often."""
    k = int(draw.choice([1, 2, 2, 3, 4, 4, 6, 8]))
    return Choice(scaling, int(draw.integers(1, 21)), min(k, n), **more)


def labels(draw: np.random.Generator, n: int) -> NDArray[np.int64]:
    """Labels that have nothing to do with the rows: votes tie, and each order gives another."""
    return draw.integers(0, draw.integers(2, 6), n)


def contacts(draw: np.random.Generator) -> Hard:
    """Ordinary vectors, every scaling."""
    n = int(draw.integers(8, 60))
    scaling = str(draw.choice(["none", "I", "II", "III", "IV", "V"]))
    X = typical(draw, n)
    return Hard(X, labels(draw, n), typical(draw, QUERIES), choice(draw, n, scaling))


def lattices(draw: np.random.Generator) -> Hard:
    """Whole numbers in a few columns, queries on and between them: exact ties everywhere."""
    half, used = int(draw.integers(4, 30)), int(draw.integers(1, 5))
    columns = draw.choice(WIDTH, used, replace=False)
    X, queries = np.zeros((2 * half, WIDTH)), np.zeros((QUERIES, WIDTH))
    points = draw.integers(-3, 4, (half, used)) * 2.0 ** draw.integers(-8, 9)
    X[:, columns] = np.concatenate([points, -points])  # the mean is exactly 0
    queries[:, columns] = X[draw.integers(0, 2 * half, QUERIES)][:, columns]
    queries[::2, columns] += points[draw.integers(0, half, len(queries[::2]))]
    queries *= 0.5
    return Hard(X, labels(draw, 2 * half), queries, choice(draw, 2 * half))


def duplicates(draw: np.random.Generator) -> Hard:
    """Rows that stand several times in the set, under different labels."""
    few, times = int(draw.integers(2, 10)), int(draw.integers(2, 6))
    X = np.repeat(typical(draw, few), times, axis=0)[draw.permutation(few * times)]
    queries = X[draw.integers(0, len(X), QUERIES)].copy()
    queries[::2] *= 1.0 + 1e-3 * draw.normal(size=(len(queries[::2]), 1))
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, len(X)), queries, choice(draw, len(X), scaling))


def spheres(draw: np.random.Generator) -> Hard:
    """Rows equally far from the query: one step with its signs and columns changed."""
    n = 2 * int(draw.integers(4, 20))
    used = int(draw.integers(2, 7))
    step = draw.integers(1, 100, used) * 2.0 ** draw.integers(-10, 11)
    X = np.zeros((n, WIDTH))
    for i in range(0, n, 2):
        X[i, draw.choice(WIDTH, used, replace=False)] = step * draw.choice([-1.0, 1.0], used)
        X[i + 1] = -X[i]
    queries = np.zeros((QUERIES, WIDTH))  # the middle of the sphere, and rows near it
    queries[1::2] = X[draw.integers(0, n, len(queries[1::2]))] * 2.0 ** -draw.integers(1, 30)
    return Hard(X, labels(draw, n), queries, choice(draw, n))


def permutations(draw: np.random.Generator) -> Hard:
    """Equal distances whose squares are the same numbers in another order: a sum that rounds
    depends on it. Every sign of every order of three numbers, so that components lie along the
    columns; a few rows further out tell the columns apart."""
    columns = draw.choice(WIDTH, 3, replace=False)
    step = draw.normal(size=3) * 10.0 ** draw.uniform(-6.0, 6.0)
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
    orders = np.array(list(itertools.permutations(step)))
    points = (orders[:, None] * signs).reshape(-1, 3)
    far = np.diag(np.abs(step).max() * np.array([4.0, 6.0, 9.0]))
    points = np.concatenate([points[draw.permutation(len(points))], far, -far])
    X, queries = np.zeros((len(points), WIDTH)), np.zeros((QUERIES, WIDTH))
    X[:, columns] = points
    # On the diagonal, where the orders of one sign are equally far, and in the middle of all.
    away = step[0] * draw.normal(size=(QUERIES - 1, 1))
    queries[1:, columns] = draw.choice([-1.0, 1.0], 3) * away
    return Hard(X, labels(draw, len(X)), queries, choice(draw, len(X)))


def near_duplicates(draw: np.random.Generator) -> Hard:
    """Rows that differ in a part of 1e-1 to 1e-15 of themselves."""
    n, base = int(draw.integers(8, 40)), typical(draw, 3)
    spread = 10.0 ** -draw.uniform(1.0, 15.0)
    X = base[draw.integers(0, 3, n)] * (1.0 + spread * draw.normal(size=(n, WIDTH)))
    queries = base[draw.integers(0, 3, QUERIES)] * (
        1.0 + spread * draw.normal(size=(QUERIES, WIDTH))
    )
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


def offsets(draw: np.random.Generator) -> Hard:
    """A spread of 1 far from zero, up to 1e12."""
    n = int(draw.integers(8, 40))
    offset = draw.choice([-1.0, 1.0], WIDTH) * 10.0 ** draw.uniform(0.0, 12.0)
    X = offset + draw.normal(size=(n, WIDTH))
    scaling = str(draw.choice(["none", "III"]))
    return Hard(
        X, labels(draw, n), offset + draw.normal(size=(QUERIES, WIDTH)), choice(draw, n, scaling)
    )


def scales(draw: np.random.Generator) -> Hard:
    """From 1e-25 to 1e25, and columns up to ten decades apart."""
    n = int(draw.integers(8, 40))
    size = 10.0 ** (draw.uniform(-25.0, 25.0) + draw.uniform(-5.0, 5.0, WIDTH))
    X = draw.normal(size=(n, WIDTH)) * size
    return Hard(X, labels(draw, n), draw.normal(size=(QUERIES, WIDTH)) * size, choice(draw, n))


def bisectors(draw: np.random.Generator) -> Hard:
    """Queries midway between two rows, and off the middle by 1e-1 to 1e-16 of the way."""
    n = int(draw.integers(8, 40))
    X = typical(draw, n)
    a, b = X[draw.integers(0, n, QUERIES)], X[draw.integers(0, n, QUERIES)]
    way = 0.5 + draw.choice([-1.0, 0.0, 1.0], (QUERIES, 1)) * 10.0 ** -draw.uniform(
        1.0, 16.0, (QUERIES, 1)
    )
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, n), a + way * (b - a), choice(draw, n, scaling))


def discriminants(draw: np.random.Generator) -> Hard:
    """Classes told apart by a projection that is made for them, with ties of equal rows."""
    n = int(draw.integers(20, 60))
    y = np.arange(n) % int(draw.integers(2, 6))
    X = typical(draw, n) + 3.0 * typical(draw, int(y.max()) + 1)[y]
    X[draw.integers(0, n)] = X[draw.integers(0, n)]
    queries = np.concatenate([X[:4], X[4:8] + 1e-9 * draw.normal(size=(4, WIDTH))])
    shrinkage = float(10.0 ** -draw.uniform(0.0, 4.0))
    more = {"projection": "lda", "shrinkage": shrinkage}
    return Hard(X, y, queries, choice(draw, n, "III", **more))


def outside(draw: np.random.Generator) -> Hard:
    """Queries 1 to 1e12 times outside the training set, whose rows nearly repeat."""
    hard = near_duplicates(draw)
    away = 10.0 ** draw.uniform(0.0, 12.0, (QUERIES, 1))
    return replace(hard, queries=hard.queries + away * typical(draw, QUERIES))


def limits(draw: np.random.Generator) -> Hard:
    """Spreads near the smallest and the largest that are taken, 1e-30 and 1e100."""
    n = int(draw.integers(8, 40))
    size = float(draw.choice([1e-29, 1e97])) * 10.0 ** draw.uniform(-1.0, 1.0)
    X = np.repeat(draw.normal(size=((n + 1) // 2, WIDTH)) * size, 2, axis=0)[:n]
    X[::2] *= 1.0 + 10.0 ** -draw.uniform(6.0, 16.0) * draw.normal(size=X[::2].shape)
    return Hard(X, labels(draw, n), X[:QUERIES] + 0.1 * size, choice(draw, n))


def columns(draw: np.random.Generator) -> Hard:
    """Up to 600 values a trial, from 129 on with fewer bits for each weight."""
    n, width = int(draw.integers(8, 14)), 3 * int(draw.integers(30, 200))
    X = draw.gamma(2.0, size=(n, width)) * (1.0 + draw.choice([0.0, 1e9]))
    X[1::2] = X[::2][: n // 2] * (1.0 + 10.0 ** -draw.uniform(1.0, 15.0))
    c = Choice("none", int(draw.integers(1, 5)), int(draw.integers(1, 5)))
    return Hard(X, labels(draw, n), 0.5 * (X[:4] + X[4:8]), c)


def dominated(draw: np.random.Generator) -> Hard:
    """One feature 1e3 to 1e16 times as large as the others, which alone tell the rows apart."""
    n = int(draw.integers(8, 40))
    X = typical(draw, n)
    X[:, :8] = np.rint(2.0 * draw.uniform(size=(n, 8))) * 10.0 ** draw.uniform(3.0, 16.0)
    queries = X[draw.integers(0, n, QUERIES)]
    away = 10.0 ** -draw.uniform(0.0, 12.0)
    queries[:, 8:] *= 1.0 + away * draw.normal(size=(QUERIES, WIDTH - 8))
    scaling = str(draw.choice(["none", "III", "V"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


def lines(draw: np.random.Generator) -> Hard:
    """Rows on one line, in steps that are equal or nearly so; queries on the line."""
    n = int(draw.integers(8, 40))
    start = typical(draw, 1) * 10.0 ** draw.uniform(0.0, 8.0)
    step = draw.normal(size=WIDTH) * 10.0 ** draw.uniform(-6.0, 3.0)
    at = draw.integers(-6, 7, (n, 1)) + draw.choice([0.0, 1e-14, 1e-9]) * draw.normal(size=(n, 1))
    queries = start + 0.5 * draw.integers(-12, 13, (QUERIES, 1)) * step
    scaling = str(draw.choice(["none", "I", "II", "III", "IV", "V"]))
    return Hard(start + at * step, labels(draw, n), queries, choice(draw, n, scaling))


def denormals(draw: np.random.Generator) -> Hard:
    """Columns of a few of the smallest numbers that there are, beside ordinary ones."""
    n = int(draw.integers(8, 40))
    X, small = typical(draw, n), draw.random(WIDTH) < 0.6
    few = draw.integers(0, 50, (n, int(small.sum()))) * 2.0 ** draw.integers(0, 30)
    X[:, small] = few * float(np.finfo(np.float64).smallest_subnormal)
    queries = X[draw.integers(0, n, QUERIES)]
    queries[::2] = typical(draw, len(queries[::2]))
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


FAMILIES: dict[str, Callable[[np.random.Generator], Hard]] = {
    family.__name__: family
    for family in (
        contacts, lattices, duplicates, spheres, permutations, near_duplicates, offsets, scales,
        bisectors, discriminants, outside, limits, columns, dominated, lines, denormals,
    )
}  # fmt: skip


@dataclass
class Found:
    """What came of one set, or of many.

    Attributes:
        queries: how many were asked.
        close: of them flagged as closer than can be told.
        other: of the flagged, those whose neighbours, order or label are not the oracle's.
        wrong: neighbours, order or label other than the oracle's, without the flag.
        engines: neighbours or labels that differ between engines, and queries asked of both.
        gap: the smallest part of a distance by which two neighbours in a right, unflagged order
            differ, where they differ at all.
        missed: the largest difference of two distances that was told wrongly, as a part of the
            size of the training rows and the query.
        worst: (family, seed) where wrong, then where most were other, then of the smallest gap.
        hardest: by which it is the worst.
        refused: sets that cannot be fitted, by a sentence.
        bad: seeds of sets with a wrong answer.
    """

    queries: int = 0
    close: int = 0
    other: int = 0
    wrong: int = 0
    engines: tuple[int, int] = (0, 0)
    gap: float = np.inf
    missed: float = 0.0
    worst: tuple[str, int] | None = None
    hardest: tuple[float, ...] = ()
    refused: int = 0
    bad: list[int] = field(default_factory=list)

    def add(self, other: Found, seed: tuple[str, int]) -> None:
        """Take in another's."""
        if other.wrong or other.engines[0]:
            self.bad.append(seed[1])
        harder = (other.wrong + other.engines[0], other.other, -other.gap)
        if self.worst is None or harder > self.hardest:
            self.worst, self.hardest = seed, harder
        self.queries += other.queries
        self.close += other.close
        self.other += other.other
        self.wrong += other.wrong
        self.refused += other.refused
        self.engines = (self.engines[0] + other.engines[0], self.engines[1] + other.engines[1])
        self.gap, self.missed = min(self.gap, other.gap), max(self.missed, other.missed)


def made(family: str, seed: int) -> Hard:
    """A set of a family."""
    return FAMILIES[family](np.random.default_rng([list(FAMILIES).index(family), seed]))


def judged(family: str, seed: int, reference: bool = False) -> Found:
    """Fit, export, ask and judge one set."""
    hard = made(family, seed)
    names = np.array([f"c{label}" for label in hard.y])
    found = Found()
    try:
        fitted = ContactClassifier({"t": hard.choice}).fit(hard.X, {"t": names})
        data = to_onnx(fitted, describe(fitted, hard.X.shape[1] // 3))
    except InputError:
        found.refused = 1
        return found
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        model = Model(path)
    rows, points = coordinates(fitted, hard)
    label = fitted.labels_["t"].tolist()
    classes = fitted.classes_["t"].tolist()
    lists, said, rounded = [], [], []
    for query, point in zip(hard.queries, points, strict=True):
        decision = model.decide(query)["t"]
        wanted, squares = exact.nearest(rows, point, hard.choice.k)
        winner = classes[exact.winner([label[i] for i in wanted])]
        seen = decision.neighbours.tolist()
        lists.append(seen)
        said.append(decision.label)
        reach = float(model.run(query[None])["reach"][0]) if reference else 0.0
        rounded.append(reach > EXACT_REACH and decision.close)
        found.queries += 1
        right = seen == wanted and decision.label == winner
        if decision.close:
            found.close += 1
            found.other += not right
        elif right:
            found.gap = min(found.gap, smallest_gap(squares, hard.choice.k))
        else:
            found.wrong += 1
            size = max(int((rows**2).sum(axis=1).max()), int((point**2).sum()))
            found.missed = max(found.missed, largest_miss(squares, seen, wanted, size))
    if reference:
        other = ReferenceEvaluator(onnx.load_from_string(data))
        numbers, neighbours = other.run(["t_label", "t_neighbours"], {"features": hard.queries})
        differ = sum(
            (a.tolist() != b or classes[int(c)] != d) and not free
            for a, b, c, d, free in zip(
                neighbours, lists, np.ravel(numbers), said, rounded, strict=True
            )
        )
        found.engines = (differ, len(lists) - sum(rounded))
    return found


def coordinates(fitted: ContactClassifier, hard: Hard) -> tuple[exact.Whole, exact.Whole]:
    """Exact coordinates of the training rows and of the queries, in the same unit."""
    space = fitted.spaces_["t"]
    p, c = fitted.projections_[space], fitted.components_["t"]
    both, _ = exact.coordinates(
        np.concatenate([hard.X, hard.queries])[:, fitted.columns_[space]],
        p.mean_, p.gain_, p.weights_[:, :c],
    )  # fmt: skip
    return both[: len(hard.X)], both[len(hard.X) :]


def smallest_gap(squares: list[int], k: int) -> float:
    """The smallest part by which two neighbours that follow each other differ, if they do."""
    near = sorted(squares)[: k + 1]
    gaps = [ratio(b - a, b) for a, b in itertools.pairwise(near) if b > a]
    return 0.5 * min(gaps, default=np.inf)


def largest_miss(squares: list[int], seen: list[int], wanted: list[int], size: int) -> float:
    """The largest difference of two distances that was told wrongly, over sqrt(size)."""
    roots = {i: math.sqrt(ratio(squares[i], size)) for i in (*seen, *wanted)}
    parts = [
        ratio(abs(squares[a] - squares[b]), size) / (roots[a] + roots[b])
        for a, b in zip(seen, wanted, strict=True)
        if squares[a] != squares[b]
    ]
    return max(parts, default=0.0)


def ratio(part: int, whole: int) -> float:
    """part / whole of whole numbers of any size."""
    return float(np.float64(part / whole)) if whole else 0.0


def single(job: tuple[str, int, bool]) -> tuple[tuple[str, int], Found]:
    """A set in another process."""
    family, seed, reference = job
    with np.errstate(all="ignore"):
        return (family, seed), judged(family, seed, reference)


def search(
    families: Sequence[str], sets: int, jobs: int, first: int = 0
) -> Iterator[tuple[str, Found]]:
    """Each family with what came of its sets."""
    with ProcessPoolExecutor(jobs, initializer=threadpool_limits, initargs=(1,)) as pool:
        for family in families:
            every = Found()
            work = [(family, i, i % REFERENCE == 0) for i in range(first, first + sets)]
            run = pool.map(single, work, chunksize=20)
            for seed, found in tqdm(run, total=sets, desc=f"{family:<16}", leave=False):
                every.add(found, seed)
            yield family, every


def corpus() -> list[tuple[str, int]]:
    """The hardest sets that were found so far."""
    return [(str(family), int(seed)) for family, seed in json.loads(CORPUS.read_text())]


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line a family; 1 where an answer is wrong without its flag, or engines differ."""
    parser = argparse.ArgumentParser(prog="adversarial", description=__doc__)
    parser.add_argument("--sets", type=int, default=SETS, help="sets a family")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="families whose name holds this text")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--keep", action="store_true", help="put the worst into the corpus")
    arguments = parser.parse_args(argv)
    chosen = [family for family in FAMILIES if arguments.only in family]
    kept, bad, asked, flagged, other = corpus(), 0, 0, 0, 0
    for family, found in search(chosen, arguments.sets, arguments.jobs, arguments.first):
        bad += found.wrong + found.engines[0]
        asked, flagged = asked + found.queries, flagged + found.close
        other += found.other
        print(
            f"{family:<16} {found.queries:>6} queries  {found.wrong:>4} wrong without a flag "
            f"(by up to {found.missed:.0e} of the rows' size)  {found.close:>4} close, "
            f"{found.other} of them rightly  engines differ in {found.engines[0]} of "
            f"{found.engines[1]}  "
            f"smallest gap told {found.gap:.0e}  {found.refused} sets refused", flush=True,
        )  # fmt: skip
        print(f"{'':<16} worst: seed {found.worst and found.worst[1]}; wrong: {found.bad[:8]}")
        kept += [(family, seed) for seed in found.bad[:3]] + ([found.worst] if found.worst else [])
    print(f"{asked} queries, {bad} wrong; {flagged} flagged as close, {other} of them rightly")
    if arguments.keep:
        lines = ",\n".join(f"  {json.dumps(entry)}" for entry in sorted(set(kept)))
        CORPUS.write_text(f"[\n{lines}\n]\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
