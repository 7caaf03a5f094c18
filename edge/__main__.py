"""The start of `edge-classify`: Ctrl-C ends it without a traceback, also while it is loading."""

import sys


def main() -> int:
    """Run the command line; returns the exit status."""
    try:
        from edge import cli

        return cli.main()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
