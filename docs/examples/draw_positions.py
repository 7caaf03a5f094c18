"""Draw where contacts were and what they were, from the JSON lines of `run`.

edge-classify run --contacts 8 ... | python draw_positions.py category positions.png
"""

import json
import sys
from collections import defaultdict

from matplotlib.figure import Figure


def main(task: str, out: str) -> None:
    """Draw the positions of a task's decisions on stdin from above and from the side."""
    places = defaultdict(list)
    for event in map(json.loads, sys.stdin):
        if event["event"] == "decision" and event["task"] == task and event["position"]:
            places[str(event["label"])].append(event["position"])
    figure = Figure(figsize=(11, 5), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, (across, up) in zip(axes, ("xy", "xz"), strict=True):
        for label, positions in sorted(places.items()):
            columns = dict(zip("xyz", zip(*positions, strict=True), strict=True))
            axis.scatter(columns[across], columns[up], label=label, edgecolors="black")
        axis.set(xlabel=f"{across} (m)", ylabel=f"{up} (m)")
        axis.set_aspect("equal", adjustable="datalim")
        axis.grid(alpha=0.3)
    axes[0].legend(title=task)
    figure.savefig(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
