"""Decide live: `python docs/examples/watch_skin.py MODEL SKIN.toml`, until Ctrl-C."""

import sys

import edge

classifier = edge.Classifier(edge.Model(sys.argv[1]), motion_on_skin=True)
with edge.Skin.open(sys.argv[2]) as skin:
    for event in classifier.watch(skin):
        print(event)
