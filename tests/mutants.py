"""`make mutants`: change the code a little, at random places, and see whether a test
fails.

mutmut makes the changes in a copy of the tree, `mutants/`, and runs the tests that
reach the changed function; `[tool.mutmut]` in pyproject.toml names the files and the
tests. A run tries `--count` mutants drawn by `--seed` until `--minutes` are over, and
prints the difference of each mutant that no test noticed. Results are kept in
`mutants/`, and no mutant is tried twice.
"""

import argparse
import shutil
import signal
import subprocess
import sys
from collections import Counter
from random import Random

from edge.commands.options import within
from tests.conftest import ended

MUTMUT = (sys.executable, "-m", "mutmut")
UNNOTICED = ("survived", "no tests")


def output(*arguments):
    """The output of a mutmut command; its errors pass through."""
    return subprocess.check_output([*MUTMUT, *arguments], text=True)


def statuses():
    """{name of a mutant: its status}, "not checked" where it was not tried yet."""
    lines = output("results", "--all", "true").splitlines()
    return dict(line.strip().rsplit(": ", 1) for line in lines if "__mutmut_" in line)


def generate():
    """Make all mutants, and measure which tests reach which function.

    Raises:
        SystemExit: a test fails on the unchanged code.
    """
    # mutmut copies tests anew, but leaves those that were deleted here since.
    shutil.rmtree("mutants/tests", ignore_errors=True)
    process = ended(*MUTMUT, "run", "no such mutant")
    if "nothing matches" not in process.stderr:
        raise SystemExit(process.stdout + process.stderr)


def run(names, minutes):
    """Try these mutants until the time is over."""
    process = subprocess.Popen([*MUTMUT, "run", *names], stdout=subprocess.DEVNULL)
    try:
        process.wait(60.0 * minutes)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        process.wait()


def main(argv=None):
    """Try a sample of mutants; print those that no test notices, and a count of each
    status."""
    parser = argparse.ArgumentParser(
        prog="mutants", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument(
        "--count",
        type=within(int, 1, 1e6),
        default=200,
        help="mutants to draw (%(default)s)",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=2012,
        help="of the draw (%(default)s)",
    )
    parser.add_argument(
        "--minutes",
        type=float,
        default=15.0,
        help="at most (%(default)s)",
    )
    parser.add_argument(
        "--only",
        default="",
        help="draw from mutants whose name contains this",
    )
    arguments = parser.parse_args(argv)
    generate()
    names = [name for name in statuses() if arguments.only in name]
    if not names:  # mutmut would try all
        parser.error(f"no mutant's name contains {arguments.only!r}")
    names = Random(arguments.seed).sample(names, min(arguments.count, len(names)))
    run(names, arguments.minutes)
    results = statuses()
    for name in sorted(names):
        if results[name] in UNNOTICED:
            print(f"{results[name]}: {name}\n{output('show', name)}")
    counts = Counter(results[name] for name in names)
    print(", ".join(f"{status}: {count}" for status, count in counts.most_common()))


if __name__ == "__main__":
    main()
