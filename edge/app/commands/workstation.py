"""Commands that run in a checkout of the project, on the workstation."""

import os
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import edge

COMMANDS = (
    "export",
    "import",
    "simulate",
    "study",
    "tradeoff",
    "show",
    "thresholds",
)
"""`export` is a program of its own; `python -m train` runs the others."""

MEANT = {
    **dict.fromkeys(("predict", "classify", "decide", "test"), ("replay", "run")),
    **dict.fromkeys(("train", "fit"), ("export",)),
    **dict.fromkeys(("plot", "draw"), ("show",)),
}
"""{the word of other programs: the commands that do this}."""


def run(words: Sequence[str]) -> int:
    """Become the command in the checkout that this package is part of, so that signals
    reach it and no process waits for it.

    Elsewhere a sentence says where it runs, and the status is 2.
    """
    command, *options = words
    module = ["export"] if command == "export" else ["train", command]
    checkout = Path(edge.__file__).resolve().parents[1]
    if not (checkout / module[0] / "__main__.py").is_file():
        print(
            f"edge-classify: {command} runs on the workstation, in a checkout of the "
            "project (see its README): this machine has the board's package alone",
            file=sys.stderr,
        )
        return 2
    paths = [str(checkout), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    # Without -P a folder `train` or `export` of the user's would run instead.
    program = [sys.executable, "-P", "-m", *module, *options]
    os.execve(sys.executable, program, environment)


def refuse_command(program: str, word: str, commands: Sequence[str]) -> int:
    """Say that there is no such command, and which may have been meant; returns 2."""
    similar = MEANT.get(word) or get_close_matches(word, commands, 1, 0.5)
    hint = f"the commands are {', '.join(commands)}"
    if similar:
        hint = f"did you mean {' or '.join(map(repr, similar))}?"
    print(f"{program}: there is no command {word!r}; {hint}", file=sys.stderr)
    return 2
