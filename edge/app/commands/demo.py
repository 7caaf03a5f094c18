"""Decide on recorded touches that come with the program.

Plays the simulated recordings that come with the program onto fake chips, reads these
with the real drivers, and decides with the model that comes with the program.
Everything but the wires works as on a robot. The exit status is 1 if a decision is
wrong.
"""

import argparse

from edge import demo
from edge.app.output import Output
from edge.decide.classifier import Classifier
from edge.decide.events import Decided
from edge.decide.model import Model
from edge.record.recording import load
from edge.wire.fake.player import play, skin_file


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 1 if a decision differs from its recording's label."""
    classifier = Classifier(Model(demo.MODEL))
    output = Output.of(arguments)
    right = []
    for path in demo.recordings():
        recording = load(path)
        if not output.as_json:
            output.text(path.stem.replace("-", " "))
        skin, playback = play(skin_file(recording.layout), recording)
        with skin:
            events = list(
                classifier.watch(skin, joints=playback, lasts_s=playback.ends)
            )
        for event in events:
            line = {"source": path.stem, **event.to_dict()}
            if isinstance(event, Decided):
                line["expected"] = recording.labels[event.task]
                right.append(line["expected"] == event.label)
            output.event(line)
    score = f"{sum(right)} of {len(right)} decisions are right"
    output.text(
        f"{score}; `edge-classify view --fake REC.npz` shows a touch as it happens."
    )
    return 0 if right and all(right) else 1
