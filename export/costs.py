"""What a model in C takes of a microcontroller, about."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from edge.arrays import Floats
from edge.features.kernels import CONVOLUTIONS
from export.image import NOWHERE, SIZES, Image

BOARDS = {"Cortex-M4F": 64, "Cortex-M0+": 133}
"""{processor: usual MHz}, in the order of the instructions below, which are fitted to
what QEMU counted with gcc 12 and -Os."""
CODE_BYTES = 28 * 1024
"""Of all rooms, with the arithmetic of doubles, of a Cortex-M0+."""
DECISION = {
    "task": (7970, 13800),
    "convolution": (7870, 12200),
    "root": (1150, 1720),
    "row": (1008, 2404),
    "product": (12.7, 39.1),
    "trial": (643, 955),
    "square": (21.7, 102),
}
"""Of the parts of a decision: roots and logarithms of values, rows of projections,
products of matrices, trials, and coordinates of these."""
FRAME = {
    "taxel": (342, 565),
    "taxel of a zone": (79, 146),
    "link": (20800, 41400),
    "value": (55.8, 105.4),
}
"""Of the parts of the longest frame, in which the whole skin is touched: links by which
motion is measured, and values of the contact at all decision points."""
SLICE = (180_000, 480_000)
"""Of the longest slice of a decision."""
ROOTS = (1, 2)
"""Transforms that take logarithms and roots."""
REST_OF_RAM = 2048 + 2100
"""Of the stack, and of what does not depend on the model."""


class Costs:
    """What a model takes.

    Attributes:
        flash, ram: bytes.
        decision: (2,) instructions of one at the full window, on each of `BOARDS`.
        frame: (2,) those of the longest frame.
    """

    def __init__(self, image: Image, taxels: int) -> None:
        """Count the parts of an image for a skin of so many taxels."""
        header = image.header()
        sizes = dict(zip(SIZES, header["sizes"].tolist()[0], strict=True))
        self.flash = CODE_BYTES + image.size
        self.ram = _ram(sizes, taxels)
        self.decision = _weighed(
            DECISION, _work(image, sizes, int(header["trials"][0]))
        )
        motions = sizes["motion"] + sizes["force_motion"]
        of_frame = {
            "taxel": taxels,
            "taxel of a zone": sizes["zones"] * taxels,
            "link": motions * int(header["numbers"]["link_count"][0]),
            "value": sizes["points"] * sizes["values"],
        }
        self.frame = _weighed(FRAME, of_frame)

    def __str__(self) -> str:
        """Flash and RAM, and for each of `BOARDS` the time of a decision and the rate
        at which a frame and a slice of a decision fit."""
        parts = [
            f"{self.flash / 1024:.0f} kB of flash",
            f"{self.ram / 1024:.0f} kB of RAM",
        ]
        rates_mhz = 1.0 / (self.frame + SLICE)
        for (name, mhz), n, rate in zip(
            BOARDS.items(), self.decision, rates_mhz, strict=True
        ):
            parts.append(
                f"a decision in about {n / 1e6:.1f} million instructions of a {name} "
                f"({n / mhz / 1e3:.0f} ms at {mhz} MHz, where no frame is lost up to "
                f"{1e6 * mhz * rate:.0f} Hz)"
            )
        return ", ".join(parts)


def _weighed(
    costs: Mapping[str, tuple[float, float]], work: Mapping[str, int]
) -> Floats:
    parts = [np.array(costs[part]) * n for part, n in work.items()]
    return np.asarray(np.sum(parts, axis=0))


def _work(image: Image, sizes: Mapping[str, int], trials: int) -> dict[str, int]:
    """How much of each part of a decision there is at the full window."""
    tables = image.tables
    words = tables["words"].astype(int)
    doubts = tables["doubts"][-1:][: sizes["has_outliers"]]["projection"]
    spaces = tables["projections"][-sizes["spaces"] :]
    rows, components = (
        np.concatenate([spaces[name], doubts[name]]).astype(int)
        for name in ("count", "components")
    )
    whitened = doubts["components"].astype(int)
    near = [
        words[task["counts"] :][: task["labels"]].sum()
        for task in tables["tasks"]
        if task["counts"] != NOWHERE
    ]
    features = tables["features"]
    sampled = tables["sampled"][features["series"]]
    roots = np.isin(features["transforms"], ROOTS).sum(axis=1)
    values = sampled["samples"].astype(int) * sampled["rows"]
    coordinates = tables["places"][-sizes["tasks"] :]["components"].astype(int)
    return {
        "task": sizes["tasks"],
        "convolution": CONVOLUTIONS
        * int(tables["kernels"]["biases_of_dilation"].any(axis=1).sum()),
        "root": int(values @ roots + sum(near)),
        "row": int(rows.sum()),
        "product": int(rows @ components + whitened @ whitened),
        "trial": trials * (sizes["tasks"] + 2 * len(doubts)),
        "square": trials * int(coordinates.sum() + 2 * whitened.sum()),
    }


def _ram(size: Mapping[str, int], taxels: int) -> int:
    zones = max(size["zones"], 1)
    unsure = 2 * size["zones"] + 3 + size["joints"]
    row = 40 + 8 * max(size["joints"], 1) + 121 * zones + 8 * unsure
    row += 4 * max(size["cells"], 1) + 4 * max(size["kernel_cells"], 1)
    answer = 10 * size["labels"] + 10 * size["neighbours"] + 8
    return (
        4 * row
        + 48 * unsure
        + 9 * taxels
        + size["points"] * (8 * size["values"] + 240 * size["channels"])
        + 8 * (size["width"] + size["summed"] + size["nearest"])
        + size["tasks"] * (answer + 8 * size["labels"] + 64)
        + (4 * size["spaces"] + 12) * size["components"]
        + REST_OF_RAM
    )
