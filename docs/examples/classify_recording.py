"""Decide on a recording: `python docs/examples/classify_recording.py MODEL
RECORDING`."""

import sys

import edge

for event in edge.Classifier(edge.Model(sys.argv[1])).classify(edge.load(sys.argv[2])):
    print(event)
