"""`python -m tests.hard_cases.adversarial`: thousands of small training sets made to be hard.

Each family of `families.py` makes rows, queries and a model by a seed; the model's neighbours, in
order, and its label are compared with an oracle of whole numbers that shares no code with them.
Where two candidates are nearer to each other than the arithmetic can tell, a decision may carry the
flag `close`; without it the answer must be the oracle's. On a part of the sets `onnx.reference` is
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
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import onnx
from onnx.reference import ReferenceEvaluator
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.errors import InputError
from edge.model.model import EXACT_REACH, Model
from export.graph import to_onnx
from tests.hard_cases import exact
from tests.hard_cases.families import FAMILIES, Hard, made
from tests.hard_cases.models import describe
from train.pipeline import ContactClassifier

SETS = 1000
REFERENCE = 20
"""One set in so many is also asked of onnx.reference, which takes a hundred times as long."""
CORPUS = Path(__file__).with_name("corpus.json")


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
