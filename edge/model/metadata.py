"""The metadata of a model as a file holds it."""

import json
from dataclasses import asdict

from edge.model.info import FORMAT, ModelInfo

OPTIONAL = (
    "decision_points_s stopping novelty joints kernels name trials taught usual".split()
)
"""Keys that are left out where they would be empty."""


def to_json(info: ModelInfo) -> str:
    """The metadata as JSON text, which `ModelInfo.from_json` reads."""
    entries = vars(info) | {
        "format": FORMAT,
        "tasks": {name: vars(task) for name, task in info.tasks.items()},
        "skin": info.layout.to_dict(),
        "tracking": {"debounce": info.debounce},
        "arm": None if info.chain is None else info.chain.to_dict(),
        "stopping": {task: asdict(rules) for task, rules in info.stopping.items()},
        "novelty": info.novelty and asdict(info.novelty),
        "kernels": {name: vars(table) for name, table in info.kernels.items()},
    }
    del entries["layout"], entries["chain"], entries["debounce"]
    for key in OPTIONAL:
        if not entries[key]:
            del entries[key]
    return json.dumps(entries, sort_keys=True, allow_nan=False, ensure_ascii=False)
