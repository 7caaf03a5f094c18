"""`python -m tests.hard_cases.adversarial`: thousands of small training sets made to be hard.

Each family of `families.py` makes rows, queries and a model by a seed. The model's neighbours, in
order, its label and its distances must be those of Python's whole numbers, and those that
`onnx.reference` gives on a part of the sets, bit for bit.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from onnx.reference import ReferenceEvaluator
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.errors import InputError
from tests.hard_cases.families import FAMILIES, made
from tests.hard_cases.models import Ours

SETS = 1000
REFERENCE = 20
"""One set in so many is also asked of onnx.reference, which takes a hundred times as long."""
CORPUS = Path(__file__).with_name("corpus.json")
OUTPUTS = ["t_label", "t_neighbours", "t_scores", "t_distances"]


class Judgement(NamedTuple):
    """Counts of one set, or of several.

    Attributes:
        queries: how many were asked.
        wrong: answers that are not the oracle's.
        engines: answers that differ between engines, of `compared`.
        refused: sets that cannot be fitted, by a sentence.
    """

    queries: int = 0
    wrong: int = 0
    engines: int = 0
    compared: int = 0
    refused: int = 0


def judged(family: str, seed: int, reference: bool = False) -> Judgement:
    """Fit, export, ask and judge one set."""
    hard = made(family, seed)
    try:
        ours = Ours(hard.X, np.array([f"c{label}" for label in hard.y]), hard.choice)
    except InputError:
        return Judgement(refused=1)
    count, differ = len(hard.queries), 0
    if reference:
        answers = ours.model.run(hard.queries)
        others = ReferenceEvaluator(ours.data).run(OUTPUTS, {"features": hard.queries})
        unequal = [answers[n] != other for n, other in zip(OUTPUTS, others, strict=True)]
        differ = int(np.any([u.reshape(count, -1).any(axis=1) for u in unequal], axis=0).sum())
    return Judgement(count, ours.wrong(hard.queries), differ, count * reference)


def single(job: tuple[str, int]) -> Judgement:
    """A set in another process."""
    family, seed = job
    with np.errstate(all="ignore"):
        return judged(family, seed, seed % REFERENCE == 0)


def corpus() -> list[tuple[str, int]]:
    """The sets that every test run judges."""
    return [(str(family), int(seed)) for family, seed in json.loads(CORPUS.read_text())]


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line for each family; 1 where an answer is wrong, or engines differ."""
    parser = argparse.ArgumentParser(prog="adversarial", description=__doc__)
    parser.add_argument("--sets", type=int, default=SETS, help="sets a family")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="families whose name holds this text")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    arguments = parser.parse_args(argv)
    seeds = range(arguments.first, arguments.first + arguments.sets)
    total = Judgement()
    with ProcessPoolExecutor(arguments.jobs, initializer=threadpool_limits, initargs=(1,)) as pool:
        for family in (family for family in FAMILIES if arguments.only in family):
            run = pool.map(single, [(family, seed) for seed in seeds], chunksize=20)
            sets = list(tqdm(run, total=len(seeds), desc=family, leave=False))
            of = Judgement(*map(sum, zip(*sets, strict=True)))
            bad = [s for s, one in zip(seeds, sets, strict=True) if one.wrong or one.engines]
            print(
                f"{family:<16} {of.queries:>6} queries  {of.wrong:>4} wrong  engines differ in "
                f"{of.engines} of {of.compared}  {of.refused} sets refused"
                + (f"  first seeds: {bad[:8]}" if bad else ""), flush=True,
            )  # fmt: skip
            total = Judgement(*map(sum, zip(total, of, strict=True)))
    print(f"{total.queries} queries, {total.wrong} wrong; {total.engines} differ between engines")
    return int(total.wrong + total.engines > 0)


if __name__ == "__main__":
    sys.exit(main())
