"""`python -m tests.mutation.guards`: each guard is taken out in turn, and a test must fail."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from tests.mutation import runner
from tests.mutation.guard import Guard
from tests.mutation.simulator_guards import SIMULATOR

CONTACT, GRID = "edge/touch/contact.py", "edge/touch/grid.py"
PIPELINE, PROJECTION = "train/pipeline.py", "train/projection.py"
SCALING = "train/scaling.py"
GRAPH, TRACK = "export/graph.py", "edge/touch/track.py"
CROSSVAL, FEATURES, REGION = "train/crossval.py", "edge/touch/features.py", "edge/touch/region.py"

GUARDS = (
    Guard(
        "a type that told nothing gets no gain",
        f"{SCALING}:scale_of",
        "np.divide(1.0, scale, out=np.zeros(types), where=scale > 0.0)",
        "np.divide(1.0, scale, out=np.ones(types), where=scale > 0.0)",
    ),
    Guard(
        "a spread that is rounding is no spread",
        f"{SCALING}:scale_of",
        "deviation[deviation <= 8 * np.finfo(float).eps * largest] = 0.0",
        "pass",
        "spread and rounding",
    ),
    Guard(
        "a column that is constant but for rounding weighs nothing",
        f"{PROJECTION}:_centred",
        "still = np.abs(centred).max(axis=0) <= 4 * np.finfo(float).eps * np.abs(X).max(axis=0)",
        "still = np.zeros(X.shape[1], dtype=bool)",
    ),
    Guard(
        "components end at the rank",
        f"{PROJECTION}:principal_axes",
        "limit = values[:1].max(initial=0.0) * max(X.shape) * np.finfo(float).eps",
        "limit = 0.0",
        "rank",
    ),
    Guard(
        "the sign is fixed",
        f"{PROJECTION}:principal_axes",
        "axes *= _signs(axes)[:, None]",
        "pass",
    ),
    Guard(
        "entries equal but for rounding are equal",
        f"{PROJECTION}:_signs",
        "sizes >= (1.0 - SAME_SIZE) * sizes.max(axis=1, keepdims=True)",
        "sizes >= sizes.max(axis=1, keepdims=True)",
    ),
    Guard(
        "a projection is exact: high half",
        f"{PROJECTION}:project",
        "high = np.rint(d)",
        "high = 0.5 * d",
    ),
    Guard(
        "a projection is exact: low half",
        f"{PROJECTION}:project",
        "low = ((d - high) + FINE) - FINE",
        "low = d - high",
        beside=GRAPH,
    ),
    Guard(
        "the mean is subtracted first",
        f"{PROJECTION}:transform",
        "d = (np.asarray(X, dtype=np.float64) - self.mean_) * self.gain_",
        "d = X * self.gain_ - self.mean_ * self.gain_",
        "offset or exact",
    ),
    Guard(
        "scales that cannot be held are refused",
        f"{SCALING}:centred_and_scaled",
        "if not (largest == 0.0 or SMALLEST_SCALE <= largest <= LARGEST_SCALE): ...",
        "if False: ...",
    ),
    Guard(
        "of axes of equal variance leave-one-out takes those of the pipeline",
        f"{PROJECTION}:leading",
        "(top[1:] < (1.0 - CLOSE_EIGENVALUES) * top[:-1]).all()",
        "True",
        beside="train/distance.py",
    ),
    Guard(
        "sums do not hang on the order in memory",
        f"{SCALING}:centred_and_scaled",
        "X = np.ascontiguousarray(X, dtype=np.float64)",
        "X = np.asarray(X, dtype=np.float64)",
        beside="train/distance.py",
    ),
    Guard(
        "an engine that computes in float32 is found out",
        "edge/model/verify.py:_told_apart",
        "if 2 * len(lost) > len(rows): ...",
        "if False: ...",
    ),
    Guard(
        "joint angles that features are made of are finite",
        f"{CONTACT}:_joints_of",
        "if not np.isfinite(frame.joints).all(): ...",
        "if False: ...",
        beside="edge/touch/feature_sets.py",
    ),
    Guard(
        "a training vector that is not finite is refused",
        f"{PIPELINE}:fit",
        "if not np.isfinite(X).all(): ...",
        "if False: ...",
    ),
    Guard(
        "equal distances go to the earlier row (estimator)",
        f"{PIPELINE}:kneighbors",
        'np.argsort(squares, kind="stable")[: self.k]',
        'len(squares) - 1 - np.argsort(squares[::-1], kind="stable")[: self.k]',
    ),
    Guard(
        "the graph's projection: high half",
        "export/build.py:project",
        'high = build.node("Round", [d])',
        'high = build.node("Mul", [d, build.constant(0.5)])',
        beside=GRAPH,
    ),
    Guard(
        "the graph measures distances directly",
        f"{GRAPH}:_running",
        'build.node("Mul", [gaps, gaps])',
        'build.node("Cast", [build.node("Cast", [build.node("Mul", [gaps, gaps])], '
        "to=TensorProto.FLOAT)], to=TensorProto.DOUBLE)",
        "distances or near-duplicate",
    ),
    Guard(
        "the shortlist is checked",
        f"{GRAPH}:_shortlisted",
        'sure = build.node("Less", [build.node("Add", [kth, build.by_decision_point(slack)]), '
        "reach])",
        'sure = build.node("LessOrEqual", [kth, kth])',
    ),
    Guard(
        "the check allows for float32's rounding",
        f"{GRAPH}:_shortlisted",
        "u = (c + 8) * 2.0**-23",
        "u = 0.0",
    ),
    Guard(
        "the shortlist is measured in the order of the rows",
        f"{GRAPH}:_shortlisted",
        'ordered, _ = build.nodes("TopK", [picked, ints(count)], ["", ""], largest=0, sorted=1)',
        "ordered = picked",
        "duplicates or equal",
    ),
    Guard(
        "the shortlist's rows are brought to float32's size",
        f"{GRAPH}:_shortlisted",
        "units = [_unit(r) for r in rows]",
        "units = [1.0 for r in rows]",
    ),
    Guard(
        "no shortlist of nearly all rows",
        f"{GRAPH}:_convert",
        "2 * (k + SHORTLIST) <= len(rows[0])",
        "True",
    ),
    Guard(
        "a distance that is no number votes for nothing",
        f"{GRAPH}:_decide",
        'said = build.node("Where", [known, said, build.constant(-1, np.int64)])',
        "pass",
    ),
    Guard(
        "a tie goes to the nearest of the tied",
        f"{GRAPH}:_decide",
        'place = build.node("ArgMax", [own], axis=1, keepdims=1)',
        'place = build.node("ArgMax", [own], axis=1, keepdims=1, select_last_index=1)',
    ),
    Guard(
        "label -1 is refused on the board",
        "edge/model/model.py:decide",
        "if index < 0: ...",
        "if False: ...",
    ),
    Guard(
        "neighbours that rounding may order otherwise are flagged",
        "edge/model/model.py:decide",
        "min(map(sub, far[1:], far)) <= resolved",
        "False",
        beside=GRAPH,
    ),
    Guard(
        "beyond the range of exact sums less is told apart",
        "edge/model/model.py:decide",
        "1.0 if reach <= EXACT_REACH else (len(x) + 4) * reach / EXACT_REACH",
        "1.0",
        beside=GRAPH,
    ),
    Guard(
        "leave-one-out: equal distances at the partition's limit",
        f"{CROSSVAL}:_nearest",
        "among = np.flatnonzero(near)",
        "among = np.argpartition(row, k - 1)[:k]",
    ),
    Guard(
        "leave-one-out: equal trials are equally far",
        f"{CROSSVAL}:split_neighbours",
        "references = exact.project(known, weights)",
        "references = known @ axes.T",
    ),
    Guard(
        "leave-one-out refuses what is not finite",
        f"{CROSSVAL}:neighbours",
        "if not np.isfinite(X).all(): ...",
        "if False: ...",
    ),
    Guard(
        "a fraction of a step, not a slope, meets the values",
        f"{FEATURES}:_resample",
        "np.minimum(fraction, 1.0, out=fraction)",
        "np.minimum(fraction, 2.0, out=fraction)",
    ),
    Guard(
        "a step of no length divides nothing",
        f"{FEATURES}:_resample",
        "step[step == 0.0] = 1.0",
        "pass",
    ),
    Guard(
        "what rounding leaves of a line's width is not its root",
        f"{FEATURES}:width",
        "np.maximum(along * around - slant * slant, 0.0)",
        "along * around - slant * slant",
        "width",
    ),
    Guard(
        "what is infinitely far is no evidence for a label",
        "edge/model/stopping.py:margin",
        "math.sqrt(min(others)) - own if own < math.inf else -math.inf",
        "math.sqrt(min(others)) - own",
    ),
    Guard(
        "a walk keeps the largest limit met",
        "train/stopping.py:certify",
        "max(limit, least)",
        "limit",
    ),
    Guard(
        "two readings of one instant are one",
        f"{CONTACT}:add",
        "if self._n and age <= self._age: ...",
        "if False: ...",
    ),
    Guard(
        "motion counts from the reading that counts",
        f"{CONTACT}:_forget_last",
        "self._starts.pop(which, None)",
        "pass",
    ),
    Guard(
        "a frame's time is finite",
        f"{TRACK}:_check",
        "if not math.isfinite(frame.t): ...",
        "if False: ...",
    ),
    Guard(
        "a chip's time is finite",
        f"{CONTACT}:region_time",
        "if not math.isfinite(t): ...",
        "if False: ...",
    ),
    Guard(
        "one frame alone begins no contact",
        f"{TRACK}:push",
        "if self._run < self._settings.debounce: ...",
        "if False: ...",
    ),
    Guard(
        "equal areas stay with the region followed",
        f"{REGION}:_settle",
        "tied = [bits for bits, overlap in zip(tied, overlaps, strict=True) if overlap == most]",
        "pass",
        "flicker",
    ),
    Guard(
        "a taxel that could not be read is not in contact",
        f"{REGION}:mask",
        "inside &= self._valid",
        "pass",
        "splits",
    ),
    Guard(
        "a region across the seam is averaged on the circle",
        f"{GRID}:col_sum",
        "if self.wraps and all(bits & outside for outside in self._halves): ...",
        "if False: ...",
    ),
    Guard(
        "a clear bit after each row stops carries",
        f"{GRID}:__init__",
        "self.stride = stride = cols + 1",
        "self.stride = stride = cols",
    ),
    Guard(
        "1 - cos as 2 sin^2 of the half angle",
        "edge/touch/arm.py:pose",
        "f, g = np.sin(angles), 2.0 * half * half",
        "f, g = np.sin(angles), 1.0 - np.cos(angles)",
        "tiny",
    ),
    Guard(
        "an angle that is not finite is refused",
        "edge/touch/arm.py:pose",
        "if not np.isfinite(angles).all(): ...",
        "if False: ...",
    ),
    Guard(
        "angles between two lines go the shorter way",
        "edge/runtime/joint_stream.py:at",
        "turned -= 2.0 * math.pi * np.round(turned / (2.0 * math.pi))",
        "pass",
    ),
    Guard(
        "a recording's times are finite",
        "edge/recording.py:_check",
        "if not np.isfinite(t).all(): ...",
        "if False: ...",
        "NaN",
    ),
    Guard(
        "a recording's joint angles are finite",
        "edge/recording.py:_check",
        "if odd.any(): ...",
        "if False: ...",
        "NaN",
    ),
    Guard(
        "a call that the kernel completed in part is no reading",
        "edge/i2c/bus.py:transfer",
        "if done != len(prepared.messages): ...",
        "if False: ...",
        beside="edge/i2c/smbus2.py",
    ),
    Guard(
        "a count that no touch reaches is not valid",
        "edge/skin/skin.py:_assemble",
        "valid &= ~beyond",
        "pass",
    ),
    Guard(
        "an early joint line ahead of time does not set the offset",
        "edge/runtime/joint_stream.py:_ahead",
        "self._delay = [d if d >= quickest - AHEAD_S else quickest for d in self._delay]",
        "pass",
    ),
    Guard(
        "a decision of a model file takes no more than its size accounts for",
        "edge/model/onnx_file.py:_node",
        "self._spend(*made, each=each)",
        "pass",
    ),
    *SIMULATOR,
)


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line a guard; 1 where none of the tests misses one, or one is not found."""
    parser = argparse.ArgumentParser(prog="mutation.guards", description=__doc__)
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--only", default="", help="guards whose description holds this text")
    arguments = parser.parse_args(argv)
    chosen = [guard for guard in GUARDS if arguments.only in guard.keeps]
    try:
        work = [guard.job() for guard in chosen]
    except LookupError as error:
        print(f"NOT FOUND {error.args[0]}")
        return 1
    alive = 0
    for job, noticed, took in runner.run(work, arguments.jobs):
        alive += not noticed
        print(f"{'killed  ' if noticed else 'SURVIVED'} {job.name}")
        print(f"         {job.file}: {noticed or 'no test failed'} [{took:.0f} s]", flush=True)
    print(f"{len(work) - alive} of {len(work)} guards are missed by a test when taken out")
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main())
