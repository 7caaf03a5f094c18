"""An extension of griffe: the examples in docstrings become blocks of code."""

from __future__ import annotations

import re
from typing import Any

import griffe

EXAMPLE = re.compile(r"(?:^>>> .*\n?)(?:^\S.*\n?|^ .*\n?)*", re.M)


class Doctests(griffe.Extension):
    """Fence each `>>>` example, which Markdown would otherwise read as a quotation."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite an object's docstring as it is collected."""
        if obj.docstring is not None:
            obj.docstring.value = EXAMPLE.sub(
                lambda example: f"```pycon\n{example[0].rstrip()}\n```\n",
                obj.docstring.value,
            )
