"""Propose thresholds from the recordings' own noise.

Takes the first 0.1 s of each recording as noise, and finds the level that one in ten
recordings exceeds there. Proposes twice this level as threshold, or the level itself
where its double misses touches. Proposes 1.5 times the threshold as onset. Counts the
contacts that these and other thresholds give.
"""

import argparse

from train.data.dataset import read
from train.data.thresholds import count_contacts, proposed


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("data", nargs="+", help=".npz recordings or folders of them")


def run(arguments: argparse.Namespace) -> int:
    """Print the proposal, and the contacts that it and other thresholds give."""
    recordings = read(arguments.data, progress=True).recordings
    proposal = proposed(recordings)
    threshold = proposal.threshold
    onset = proposal.onset
    recorded = recordings[0].layout
    rows = [
        ("recorded", recorded.threshold_counts, recorded.onset),
        ("proposed", threshold, onset),
    ]
    for name, factor in (("half", 0.5), ("twice", 2), ("four times", 4)):
        # Multiples of nothing say nothing, so those of one count stand in.
        low, high = (round(factor * max(level, 1)) for level in (threshold, onset))
        rows.append((name, min(low, 65534), min(high, 65534)))
    print(f"{'':<11}threshold  onset  recordings with a contact  contacts")
    for name, low, high in rows:
        touched, total = count_contacts(recordings, low, high)
        print(
            f"{name:<11}{low:>9}  {high:>5}  {touched:>12} of {len(recordings):<10}  "
            f"{total:>8}"
        )
    print(f"proposed from {proposal.source}")
    print(f"use: --threshold {threshold} --onset {onset}")
    return 0
