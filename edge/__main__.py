"""The start of a program: Ctrl-C ends it without a traceback, also while it is
loading."""

import sys
from collections.abc import Sequence
from importlib import import_module


def start(module: str, argv: Sequence[str] | None = None) -> int:
    """Import a module and run its `main(argv)`; returns the exit status."""
    try:
        from edge.interrupt import delayed

        with delayed():
            program = import_module(module)
        status: int = program.main(argv)
        return status
    except KeyboardInterrupt:
        return 130


def main() -> int:
    """Run the command line; returns the exit status."""
    return start("edge.app.cli")


if __name__ == "__main__":
    sys.exit(main())
