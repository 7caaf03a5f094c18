"""The program whose instructions `count.c` counts: a recording, with marks around each step.

Run as `python count_guest.py MODEL RECORDING` under the plugin. It prints the name of a step for
each pair of marks.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load

REPEATS = 20


def counted(step: Callable[[], Any]) -> Any:
    """The step's result; the plugin counts its instructions."""
    os.getppid()
    result = step()
    os.getppid()
    return result


def main() -> None:
    model, recording = Model(sys.argv[1]), load(sys.argv[2])
    contact = first_series(recording, model)
    assert contact is not None, "the recording has no contact"

    def vector() -> Any:
        return model.info.vector(contact[1])

    x = vector()
    steps = {"nothing": lambda: None, "feature vector": vector, "model": lambda: model.decide(x)}
    model.decide(x)
    for _ in range(REPEATS):
        for name, step in steps.items():
            counted(step)
            print(name)
    for _ in range(2):  # caches fill in the first round
        classifier = Classifier(model, recording.layout)
        for frame in recording:
            events = counted(lambda frame=frame, push=classifier.push: push(frame))
            if any(isinstance(event, Decided) for event in events):
                print("frame that decides")
            elif events:
                print("frame with another event")
            elif classifier.tracker.region is not None:
                print("frame in contact")
            else:
                print("frame without contact")


if __name__ == "__main__":
    main()
