"""`make mutants`: change the code a little, at random places, and see whether a test
fails.

mutmut makes the changes in a copy of the tree, `mutants/`, and runs the tests that
reach the changed function; `[tool.mutmut]` in pyproject.toml names the files and the
tests. A run draws `--count` mutants, tries them until `--minutes` are over, and prints
the difference of each mutant that no test noticed. Results are kept in `mutants/`, and
no mutant is tried twice.
"""

import shutil
import signal
import subprocess
import sys
from collections import Counter
from random import Random

from edge.errors import EdgeError
from tests.bench.program import start
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


def measure(count, minutes, only):
    """Try a sample of mutants; print those that no test notices, and a count of each
    status.

    Raises:
        EdgeError: no mutant's name contains `only`; mutmut would try all.
    """
    generate()
    names = [name for name in statuses() if only in name]
    if not names:
        raise EdgeError(f"no mutant's name contains {only!r}")
    names = Random(2012).sample(names, min(count, len(names)))
    run(names, minutes)
    results = statuses()
    for name in sorted(names):
        if results[name] in UNNOTICED:
            print(f"{results[name]}: {name}\n{output('show', name)}")
    counts = Counter(results[name] for name in names)
    print(", ".join(f"{status}: {n}" for status, n in counts.most_common()))


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--count", 200, "mutants to draw"),
        ("--minutes", 15.0, "at most"),
        ("--only", "", "draw from mutants whose name contains this"),
    )
