"""The fault campaign: what the skin makes of all that can go wrong on its wires.

`python -m bench.faults` prints tables; the same seed gives the same tables. Scripts of faults, and
the loss of all settings between two frames, are played onto fake skins in virtual time, which
advances with the bits on the wire and with the software's overhead for each transaction. Then one
fault of each kind is played at every transaction of a frame and of the set-up; `--every 10` takes
every tenth. The exit status is 1 if a valid value is wrong, or a taxel is not valid again within
half a second of the fault's end.
"""

from __future__ import annotations

import argparse
import math
import sys

from joblib import Parallel, delayed

from tests.edge.skin import campaign
from tests.edge.skin.campaign import KINDS, SKINS, Outcome, brown_out, sweep
from train.progress import bar

OVERHEADS_US = (0.0, 50.0, 100.0)
"""Microseconds a transaction."""
REPEATED = (3, 20, 37, 54)
"""Frames before which all chips lose their settings, where that repeats."""
UNKNOWABLE = r"""
\* The protocol cannot tell. An AD7147's words carry no check, so that a flipped bit is a value
unless it gives 0, 0xFFFF or a count that no touch reaches; an MPR121's words have six spare bits of
sixteen. A chip that serves old bytes is found after 100 frames if its calibration saw noise. A
wrong channel is found by reading the mux back, which a skin file may switch off."""
HEAD = """\
| fault | {} | wrong values called valid | taxels missing, worst frame \
| readings lost on other chips | ticks left out | all back after, ms |
|---|---|---|---|---|---|---|"""


def table(outcomes: list[Outcome], first: str) -> str:
    """The outcomes as a Markdown table."""
    row = "| {0.name} | {0.met} | {0.wrong} | {0.missing} | {0.others} | {0.missed} | {1:.0f} |"
    return "\n".join([HEAD.format(first), *(row.format(o, 1e3 * o.back_s) for o in outcomes)])


def main() -> None:
    """Run the campaign and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="every so many positions")
    arguments = parser.parse_args()
    failed = []
    for overhead in OVERHEADS_US:
        cost = {"overhead_s": overhead * 1e-6}
        played = [
            campaign.run(name, file, faults, seed=arguments.seed, **more, **cost)
            for name, file, faults, more in campaign.scripts()
        ]
        for name, file in SKINS.items():
            played.append(brown_out(f"all reset, {name}", file, **cost))
            played.append(brown_out(f"all reset 4 times, {name}", file, at=REPEATED, **cost))
        jobs = [
            delayed(sweep)(
                f"{kind}, {name}", file, fault, set_up=set_up, every=arguments.every, **cost
            )
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
        late = [
            o for o in knowable if o.wrong or math.isnan(o.back_s) or o.back_s > campaign.BACK_S
        ]
        failed += [f"{o.name} ({overhead:g} us)" for o in late]
        longest = max(knowable, key=lambda o: o.back_s)
        print(f"\nLongest time until all were back: {longest.back_s:.3f} s, {longest.name}")
    if failed:
        sys.exit(f"not as promised: {'; '.join(failed)}")


if __name__ == "__main__":
    main()
