"""The metadata of a model as a file holds it."""

import json

from edge.decide.info import FORMAT, ModelInfo

OPTIONAL = (
    "decision_points_s",
    "stopping",
    "outlier_score",
    "joints",
    "kernels",
    "name",
    "trials",
    "usual",
    "speeds",
    "repeats",
    "onset",
)
"""Keys that are left out where they would be empty."""


def to_json(info: ModelInfo) -> str:
    """The metadata as JSON text, which `edge.decide.metadata_reader.from_json`
    reads."""
    entries = vars(info) | {
        "format": FORMAT,
        "skin": info.layout.to_dict(),
        "tracking": {"debounce": info.debounce},
        "arm": None if info.chain is None else info.chain.to_dict(),
    }
    del entries["layout"], entries["chain"], entries["debounce"]
    for key in OPTIONAL:
        if not entries[key]:
            del entries[key]
    return json.dumps(
        entries,
        default=vars,
        sort_keys=True,
        allow_nan=False,
        ensure_ascii=False,
    )
