"""The fault campaign: what the skin makes of all that can go wrong on its wires.

`python -m bench.faults` prints tables; the same seed gives the same tables. Scripts of faults, and
the loss of all settings between two frames, are played onto fake skins in virtual time, which
advances with the bits on the wire and `--overhead` microseconds for each transaction. Then one
fault of each kind is played at every transaction of a frame and of the set-up; `--every 10` takes
every tenth. The exit status is 1 if a valid value is wrong, or a taxel is not valid again within
half a second of the fault's end.
"""

from __future__ import annotations

import argparse
import math
import sys

from joblib import Parallel, delayed

from tests.edge.skin.campaign import (
    BACK_S,
    KINDS,
    SKINS,
    Outcome,
    brown_out,
    run,
    scripts,
    sweep,
)
from train.progress import bar

REPEATED = (3, 20, 37, 54)
"""Frames before which all chips lose their settings, where that repeats."""
UNKNOWABLE = r"""
\* The protocol cannot tell. An AD7147's words carry no check, so that a flipped bit is a value
unless it gives 0, 0xFFFF or a count that no touch reaches; an MPR121's words have six spare bits of
sixteen. A chip that serves old bytes is found after 100 frames if its calibration saw noise. A
wrong channel is found by reading the mux back, which a skin file may switch off."""


def table(outcomes: list[Outcome], first: str) -> str:
    """Markdown."""
    lines = [
        f"| fault | {first} | wrong values called valid | taxels missing, worst frame "
        "| readings lost on other chips | ticks left out | all back after, ms |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {o.name} | {o.met} | {o.wrong} | {o.missing} | {o.others} | {o.missed} "
        f"| {1e3 * o.back_s:.0f} |"
        for o in outcomes
    ]
    return "\n".join(lines)


def main() -> None:
    """Run the campaign and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="every so many positions")
    parser.add_argument("--first", type=int, default=0, help="the first of them")
    parser.add_argument(
        "--overhead", type=float, nargs="+", default=[0.0, 50.0, 100.0], help="us a transaction"
    )
    arguments = parser.parse_args()
    positions = {"every": arguments.every, "first": arguments.first}
    failed = []
    for overhead in arguments.overhead:
        cost = {"overhead_s": overhead * 1e-6}
        played = [
            run(name, file, faults, seed=arguments.seed, **more, **cost)
            for name, file, faults, more in scripts()
        ]
        for name, file in SKINS.items():
            played.append(brown_out(f"all reset, {name}", file, **cost))
            played.append(brown_out(f"all reset 4 times, {name}", file, at=REPEATED, **cost))
        jobs = [
            delayed(sweep)(f"{kind}, {name}", file, fault, set_up=set_up, **positions, **cost)
            for name, file in SKINS.items()
            for kind, fault in KINDS.items()
            for set_up in (False, True)
        ]
        sweeps = Parallel(n_jobs=-1)(bar(jobs, desc="positions", unit=" sweeps"))
        print(
            f"\nOverhead of {overhead:g} us a transaction:\n\n{table(played, 'met')}{UNKNOWABLE}\n"
        )
        print(table(sweeps, "positions"))
        knowable = [o for o in played if not o.name.endswith("*")] + sweeps
        late = [o for o in knowable if o.wrong or math.isnan(o.back_s) or o.back_s > BACK_S]
        failed += [f"{o.name} ({overhead:g} us)" for o in late]
        longest = max(knowable, key=lambda o: o.back_s)
        print(f"\nLongest time until all were back: {longest.back_s:.3f} s, {longest.name}")
    if failed:
        sys.exit(f"not as promised: {'; '.join(failed)}")


if __name__ == "__main__":
    main()
