"""`python -m export`: recordings to model.onnx and golden.npz (`make export`)."""

import sys
from collections.abc import Sequence

from edge.__main__ import start
from edge.interrupt import exit_on_sigterm


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 for success, 2 for bad usage or input."""
    return start("export.cli", argv)


if __name__ == "__main__":
    exit_on_sigterm()
    sys.exit(main())
