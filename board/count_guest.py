"""The program whose instructions `count.c` counts: a recording, with marks around each step.

Run as `python count_guest.py MODEL RECORDING` under the plugin. It prints the name of a step for
each pair of marks.
"""

from __future__ import annotations

import os
import sys

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load

REPEATS = 20


def main() -> None:
    model, recording = Model(sys.argv[1]), load(sys.argv[2])
    mark = os.getppid
    names = []
    info = model.info
    contact = first_series(recording, model)
    assert contact is not None, "the recording has no contact"
    series = contact[1]
    vector = info.vector(series)
    model.decide(vector)
    for _ in range(REPEATS):
        mark()
        mark()
        mark()
        info.vector(series)
        mark()
        mark()
        model.decide(vector)
        mark()
        names += ["nothing", "feature vector", "model"]
    for _ in range(2):  # caches fill in the first round
        classifier = Classifier(model, recording.layout)
        for frame in recording:
            mark()
            events = classifier.push(frame)
            mark()
            if any(isinstance(event, Decided) for event in events):
                names.append("frame that decides")
            elif events:
                names.append("frame with another event")
            elif classifier.tracker.region is not None:
                names.append("frame in contact")
            else:
                names.append("frame without contact")
    print("\n".join(names))


if __name__ == "__main__":
    main()
