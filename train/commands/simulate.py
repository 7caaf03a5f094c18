"""Simulate a scene into recordings.

Simulates the touches that a scene file describes, and only the effects that it calls
for. The same scene gives the same files, whatever the batch or the machine.
"""

import argparse
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from train import former_recordings

if TYPE_CHECKING:
    from train.simulate.run import Written
    from train.simulate.scene_model import Scene


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    option = parser.add_argument
    option("scene", help="a TOML file like train/scenes/cody18.toml")
    option("--out", metavar="DIR", help="folder for the recordings")
    text = "effects that run, with the reason for each, and the error of the step"
    option("--explain", action="store_true", help=text)
    option("--seed", type=int, help="seed, instead of the scene's")
    text = "trials of each object in each condition, instead of the scene's"
    option("--trials", type=int, metavar="N", help=text)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, or explain."""
    from edge.errors import InputError
    from train.simulate import scene as scenes
    from train.simulate.account import explain
    from train.simulate.plan import summary

    scene = scenes.load(arguments.scene, seed=arguments.seed, count=arguments.trials)
    if not arguments.out and not arguments.explain:
        raise InputError("simulate: give --out DIR, --explain or both")
    print(*summary(scene), sep="\n", file=sys.stderr)
    if arguments.explain:
        print(explain(scene))
    if arguments.out:
        from train.progress import bar
        from train.simulate.run import total_trials, write

        with bar(total=total_trials(scene), unit="trial", desc=scene.name) as progress:
            written = write(scene, arguments.out, progress=progress.update)
        headline = f"recordings written to {arguments.out}: {len(written.paths)}"
        print(headline, *remarks(scene, written), sep="\n", file=sys.stderr)
    return 0


def remarks(scene: "Scene", written: "Written") -> Iterator[str]:
    """What a user should know of recordings that were written."""
    yield from former_recordings.warnings(written.paths[0].parent, written.paths)
    if written.redrawn:
        reasons = (f"{count} {reason}" for reason, count in written.redrawn.items())
        yield (
            "drawn again until they fitted their labels within "
            f"{scene.labels['window_s']:g} s of the touch: {', '.join(reasons)}"
        )
    if written.unfelt:
        yield (
            f"in {written.unfelt} of them no taxel rises above skin.onset_counts "
            f"({scene.skin.onset}), so no touch is felt"
        )
