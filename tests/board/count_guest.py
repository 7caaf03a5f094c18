"""The program whose instructions `count.c` counts: a recording, with marks around each
frame.

Run as `python count_guest.py MODEL RECORDING` under the plugin. It prints a line for
each pair of marks: what kind of frame it was.
"""

import os
import sys

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model
from edge.recording import load

model = Model(sys.argv[1])
recording = load(sys.argv[2])
for _ in range(10):  # caches fill in the first ones
    classifier = Classifier(model, recording.layout)
    for frame in recording:
        os.getppid()
        events = classifier.push(frame)
        os.getppid()
        if any(isinstance(event, Decided) for event in events):
            print("frame that decides")
        elif events:
            print("frame with another event")
        elif classifier.tracker.tracker.region is not None:
            print("frame in contact")
        else:
            print("frame without contact")
