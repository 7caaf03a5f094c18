"""`python -m tests.hard_cases.mutants`: each guard is taken out in turn, and a test must fail.

The tree is copied for each; the named tests run in a process of their own on the copy.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
COPIED = ("edge", "train", "export", "tests", "pyproject.toml")


@dataclass(frozen=True)
class Mutant:
    """A guard and what is left without it.

    Attributes:
        guard: what it keeps from happening.
        file: where it is.
        source: its text, found exactly once.
        without: what takes its place.
        tests: files and a `-k` expression of the tests that must notice.
    """

    guard: str
    file: str
    source: str
    without: str
    tests: tuple[str, ...]

    def problem(self) -> str:
        """What is wrong with the entry, or nothing."""
        found = (ROOT / self.file).read_text().count(self.source)
        return "" if found == 1 else f"{self.file}: found {found} times: {self.source!r}"


PIPELINE, GRAPH, TRACK = "train/pipeline.py", "export/graph.py", "edge/touch/track.py"
CROSSVAL, FEATURES, REGION = "train/crossval.py", "edge/touch/features.py", "edge/touch/region.py"
HARD = "tests/hard_cases/test_hard_cases.py"
OF_PIPELINE, OF_GRAPH = "tests/train/test_pipeline.py", "tests/export/test_graph.py"
OF_TRACK, OF_FEATURES = "tests/edge/touch/test_track.py", "tests/edge/touch/test_features.py"
OF_REGION, OF_CROSSVAL = "tests/edge/touch/test_region.py", "tests/train/test_crossval.py"
OF_ARM, OF_MODEL = "tests/edge/touch/test_arm.py", "tests/edge/model/test_model.py"

MUTANTS = (
    Mutant(
        "a type that told nothing gets no gain",
        PIPELINE,
        "out=np.zeros(types), where=scale > 0.0)",
        "out=np.ones(types), where=scale > 0.0)",
        (OF_PIPELINE, "told_nothing"),
    ),
    Mutant(
        "a spread that is rounding is no spread",
        PIPELINE,
        "deviation[deviation <= 8 * np.finfo(float).eps * largest] = 0.0",
        "pass",
        (HARD, "spread and rounding"),
    ),
    Mutant(
        "a column that is constant but for rounding weighs nothing",
        PIPELINE,
        "still = np.abs(centred).max(axis=0) <= 4 * np.finfo(float).eps * np.abs(X).max(axis=0)",
        "still = np.zeros(X.shape[1], dtype=bool)",
        (OF_PIPELINE, "without_variance or told_nothing"),
    ),
    Mutant(
        "components end at the rank",
        PIPELINE,
        "limit = values[:1].max(initial=0.0) * max(X.shape) * np.finfo(float).eps",
        "limit = 0.0",
        (HARD, "rank"),
    ),
    Mutant(
        "the sign is fixed",
        PIPELINE,
        "    axes *= np.sign(axes[np.arange(rank), top])[:, None]\n",
        "",
        (OF_PIPELINE, "sign"),
    ),
    Mutant(
        "entries equal but for rounding are equal",
        PIPELINE,
        "sizes >= (1.0 - SAME_SIZE) * sizes.max(axis=1, keepdims=True)",
        "sizes >= sizes.max(axis=1, keepdims=True)",
        (OF_PIPELINE, "sign_does_not_hang"),
    ),
    Mutant(
        "a projection is exact: high half",
        PIPELINE,
        "high = (d + self.high) - self.high",
        "high = 0.5 * d",
        (OF_PIPELINE, "exact_in_any_order or cuts_off"),
    ),
    Mutant(
        "a projection is exact: low half",
        PIPELINE,
        "low = ((d - high) + self.low) - self.low",
        "low = d - high",
        (OF_GRAPH, "equals_a_training_row or all_at_once"),
    ),
    Mutant(
        "the mean is subtracted first",
        PIPELINE,
        "        d = (X - self.mean) * self.gain\n        high",
        "        d = X * self.gain - self.mean * self.gain\n        high",
        (HARD, "offset or exact"),
    ),
    Mutant(
        "scales that cannot be held are refused",
        PIPELINE,
        "if largest > LARGEST_SCALE or 0.0 < largest < SMALLEST_SCALE:",
        "if False:",
        (OF_PIPELINE, "refused"),
    ),
    Mutant(
        "a training vector that is not finite is refused",
        PIPELINE,
        "if not np.isfinite(X).all():",
        "if False:",
        (OF_PIPELINE, "not_finite"),
    ),
    Mutant(
        "equal distances go to the earlier row (estimator)",
        PIPELINE,
        'np.argsort(squares, kind="stable")[: self.k]',
        'len(squares) - 1 - np.argsort(squares[::-1], kind="stable")[: self.k]',
        (OF_PIPELINE, "earlier_row"),
    ),
    Mutant(
        "the graph's projection: high half",
        "export/build.py",
        'half = build.node("Sub", [build.node("Add", [d, step]), step])',
        'half = build.node("Mul", [d, build.constant(0.5)])',
        (OF_GRAPH, "scaling_agrees or equals_a_training_row or all_at_once"),
    ),
    Mutant(
        "the graph measures distances directly",
        GRAPH,
        '    squares = build.node("ReduceSumSquare", [gaps, build.ints(1)], keepdims=0)\n',
        '    gaps = build.node("Cast", [build.node("Cast", [gaps], to=TensorProto.FLOAT)], '
        "to=TensorProto.DOUBLE)\n"
        '    squares = build.node("ReduceSumSquare", [gaps, build.ints(1)], keepdims=0)\n',
        (HARD, "distances or near-duplicate"),
    ),
    Mutant(
        "the shortlist is checked",
        GRAPH,
        'sure = build.node("Less", [build.node("Add", [kth, build.by_decision_point(slack)]), reach])',  # noqa: E501
        'sure = build.node("LessOrEqual", [kth, kth])',
        (OF_GRAPH, "too_narrow"),
    ),
    Mutant(
        "the check allows for float32's rounding",
        GRAPH,
        "slack = [2.0 * u * float(of.max()) for of in lengths]",
        "slack = [0.0 for of in lengths]\n    u = 0.0",
        (OF_GRAPH, "clusters"),
    ),
    Mutant(
        "the shortlist is measured in the order of the rows",
        GRAPH,
        'ordered, _ = build.nodes("TopK", [picked, ints(count)], ["", ""], largest=0, sorted=1)',
        "ordered = picked",
        (HARD, "duplicates or equal"),
    ),
    Mutant(
        "the shortlist's rows are brought to float32's size",
        GRAPH,
        "units = [_unit(r) for r in rows]",
        "units = [1.0 for r in rows]",
        (OF_GRAPH, "float32_cannot_hold"),
    ),
    Mutant(
        "no shortlist of nearly all rows",
        GRAPH,
        "len(rows[0]) >= SHORTLIST_ROWS and 2 * (k + SHORTLIST) <= len(rows[0])",
        "len(rows[0]) >= SHORTLIST_ROWS",
        (OF_GRAPH, "voters_as_rows"),
    ),
    Mutant(
        "a distance that is no number votes for nothing",
        GRAPH,
        '    said = build.node("Where", [known, said, build.constant(-1, np.int64)])\n',
        "",
        (OF_GRAPH, "never_classified"),
    ),
    Mutant(
        "a tie goes to the nearest of the tied",
        GRAPH,
        'place = build.node("ArgMax", [own], axis=1, keepdims=1)',
        'place = build.node("ArgMax", [own], axis=1, keepdims=1, select_last_index=1)',
        (OF_GRAPH, "last_tie"),
    ),
    Mutant(
        "label -1 is refused on the board",
        "edge/model/model.py",
        "if index < 0:",
        "if False:",
        (OF_MODEL, "refused_with_its_place or beyond_any_distance"),
    ),
    Mutant(
        "leave-one-out: equal distances at the partition's limit",
        CROSSVAL,
        "among = np.flatnonzero(near)",
        "among = np.argpartition(row, k - 1)[:k]",
        (OF_CROSSVAL, "limit"),
    ),
    Mutant(
        "leave-one-out: equal trials are equally far",
        CROSSVAL,
        "z = (scaled @ axes.T)[first_equal(X) if first is None else first]",
        "z = scaled @ axes.T",
        (OF_CROSSVAL, "limit"),
    ),
    Mutant(
        "leave-one-out refuses what is not finite",
        CROSSVAL,
        "if not np.isfinite(X).all():",
        "if False:",
        (OF_CROSSVAL, "not_finite"),
    ),
    Mutant(
        "a fraction of a step, not a slope, meets the values",
        FEATURES,
        "np.minimum(fraction, 1.0, out=fraction)",
        "np.minimum(fraction, 2.0, out=fraction)",
        (OF_FEATURES, "overshoot or last_values"),
    ),
    Mutant(
        "a step of no length divides nothing",
        FEATURES,
        "step[step == 0.0] = 1.0",
        "pass",
        (OF_FEATURES, "instant or last_values or single or one_frame"),
    ),
    Mutant(
        "what rounding leaves of a line's width is not its root",
        FEATURES,
        "np.maximum(along * around - slant * slant, 0.0)",
        "along * around - slant * slant",
        (HARD, "width"),
    ),
    Mutant(
        "a trial seen before is as strange as it was",
        "train/conformal.py",
        "SLACK = 1e-9",
        "SLACK = 0.0",
        (HARD, "repeats"),
    ),
    Mutant(
        "two readings of one instant are one",
        TRACK,
        "if self._t and t <= self._t[-1]:",
        "if False:",
        (OF_TRACK, "one_instant"),
    ),
    Mutant(
        "motion counts from the reading that counts",
        TRACK,
        "                    self._starts.pop(which, None)\n",
        "                    pass\n",
        (OF_TRACK, "reading_that_counts"),
    ),
    Mutant(
        "a frame's time is finite",
        TRACK,
        "if not math.isfinite(frame.t):",
        "if False:",
        (OF_TRACK, "not_finite"),
    ),
    Mutant(
        "a chip's time is finite",
        TRACK,
        "    if not math.isfinite(t):\n",
        "    if False:\n",
        (OF_TRACK, "not_finite"),
    ),
    Mutant(
        "one frame alone begins no contact",
        TRACK,
        "if self._run < of.settings.debounce:",
        "if False:",
        (OF_TRACK, "one_frame_alone"),
    ),
    Mutant(
        "equal areas stay with the region followed",
        REGION,
        "tied = [bits for bits, overlap in zip(tied, overlaps, strict=True) if overlap == most]",
        "pass",
        (HARD, "flicker"),
    ),
    Mutant(
        "a taxel that could not be read is not in contact",
        REGION,
        "        inside &= valid\n",
        "        pass\n",
        (HARD, "splits"),
    ),
    Mutant(
        "a region across the seam is averaged on the circle",
        REGION,
        "if self.wraps and all(bits & outside for outside in self._halves):",
        "if False:",
        (OF_REGION, "seam or turning"),
    ),
    Mutant(
        "a clear bit after each row stops carries",
        REGION,
        "self.stride = stride = cols + 1",
        "self.stride = stride = cols",
        (OF_REGION, "adversarial"),
    ),
    Mutant(
        "1 - cos as 2 sin^2 of the half angle",
        "edge/touch/arm.py",
        "f, g = np.sin(angles), 2.0 * half * half",
        "f, g = np.sin(angles), 1.0 - np.cos(angles)",
        (HARD, "tiny"),
    ),
    Mutant(
        "an angle that is not finite is refused",
        "edge/touch/arm.py",
        "if not np.isfinite(angles).all():",
        "if False:",
        (OF_ARM, "non_finite"),
    ),
    Mutant(
        "angles between two lines go the shorter way",
        "edge/runtime/joint_stream.py",
        "                    turned -= 2.0 * math.pi * np.round(turned / (2.0 * math.pi))\n",
        "",
        ("tests/edge/runtime/test_joint_stream.py", "shorter_way"),
    ),
    Mutant(
        "a line that is not finite is no pose",
        "edge/runtime/joint_stream.py",
        "        if not finite:\n",
        "        if False:\n",
        (HARD, "NaN"),
    ),
    Mutant(
        "a recording's times are finite",
        "edge/recording.py",
        "if not np.isfinite(t).all():",
        "if False:",
        (HARD, "NaN"),
    ),
    Mutant(
        "a recording's joint angles are finite",
        "edge/recording.py",
        "        if not finite.all():\n",
        "        if False:\n",
        (HARD, "NaN"),
    ),
    Mutant(
        "the tilt's Newton steps are cut back",
        "train/simulate/effects/tilt.py",
        "        y = guarded(state, y, free, c, ~done)\n",
        "",
        (HARD, "tilt"),
    ),
    Mutant(
        "the tilt's loads come from the side with more digits",
        "train/simulate/effects/tilt.py",
        "force = np.where(stiff, (c[2] * d0 - c[1] * d1) / some, bed[0])",
        "force = bed[0]",
        (HARD, "tilt"),
    ),
)


def killed(mutant: Mutant) -> tuple[Mutant, str]:
    """The first test that failed on the copy; "" where the mutant survived."""
    import pytest

    with tempfile.TemporaryDirectory() as folder:
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                skip = shutil.ignore_patterns("__pycache__", ".hypothesis")
                shutil.copytree(source, Path(folder) / name, ignore=skip)
            else:
                shutil.copy(source, folder)
        path = Path(folder) / mutant.file
        path.write_text(path.read_text().replace(mutant.source, mutant.without))
        os.chdir(folder)
        sys.path.insert(0, folder)
        sys.dont_write_bytecode = True
        file, chosen = mutant.tests
        said = io.StringIO()
        options = ["-x", "-q", "-p", "no:cacheprovider", "--rootdir", folder, "--tb=no"]
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = pytest.main([*options, "-p", "no:xdist", "-k", chosen, file])
        os.chdir(ROOT)
    lines = [line for line in said.getvalue().splitlines() if line.startswith(("FAILED", "ERROR"))]
    if status == pytest.ExitCode.TESTS_FAILED and lines:
        return mutant, lines[0].split(" - ")[0].removeprefix("FAILED ").split("::")[-1]
    if status in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        return mutant, ""
    return mutant, f"! the tests did not run ({status!r}): {said.getvalue()[-300:]}"


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line a mutant; 1 where one survives or an entry is stale."""
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__)
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--only", default="", help="guards that hold this text")
    arguments = parser.parse_args(argv)
    mutants = [m for m in MUTANTS if arguments.only in m.guard]
    stale = [problem for problem in (m.problem() for m in mutants) if problem]
    for problem in stale:
        print(f"STALE    {problem}")
    if stale:
        return 1
    # Loaded once here, so that each forked process begins with them; none of the project's own.
    for name in ("hypothesis", "onnxruntime", "scipy.ndimage", "skl2onnx", "sklearn.neighbors"):
        __import__(name)
    alive = 0
    context = multiprocessing.get_context("fork")
    with context.Pool(arguments.jobs, maxtasksperchild=1) as pool:
        for mutant, test in pool.imap(killed, mutants, chunksize=1):
            survived = not test or test.startswith("!")
            alive += survived
            print(f"{'SURVIVED' if survived else 'killed  '} {mutant.guard}")
            print(f"         {mutant.file}: {test or 'no test failed'}", flush=True)
    print(f"{len(mutants) - alive} of {len(mutants)} guards are missed by a test when taken out")
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main())
