"""`make mutants`: change the code a little, at random places, and see whether a test
fails.

mutmut makes the changes in a copy of the tree, `mutants/`, and runs the tests that
reach the changed function; `[tool.mutmut]` in pyproject.toml names the files and the
tests. A run draws `--count` mutants, tries them until `--minutes` are over, and prints
the difference of each mutant that no test noticed. Results are kept in `mutants/`, and
no mutant is tried twice. The C that export writes is changed by `tests.checks.c_mutants`, a word
at a time, for half as many mutants. The draws are of `ROOMS`, or of all whose name
contains `--only`; the exit status is 1 if more than one of 50 is not noticed.
"""

import shutil
import signal
import subprocess
import sys
from collections import Counter
from random import Random

from edge.errors import EdgeError
from tests.checks import c_mutants
from tests.checks.bench.program import start
from tests.conftest import ended

MUTMUT = (sys.executable, "-m", "mutmut")
UNNOTICED = ("survived", "no tests")
MOST_UNNOTICED = 1 / 50
ROOMS = (
    "edge.wire.bus.",
    "edge.wire.skin.",
    "edge.record.labels",
    "edge.record.saving",
    "edge.app.commands.label",
    "edge.app.sinks.page",
    "edge.app.sinks.web",
    "export/c/",
)
"""Begin the names of the mutants that are drawn from."""


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


def tried_in_python(count, minutes, only):
    """{name: status} of mutmut's mutants."""
    generate()
    names = drawn(statuses(), count, only)
    if names:  # mutmut would try all
        run(names, minutes)
    return {name: status for name, status in statuses().items() if name in names}


def measure(count, minutes, only):
    """Try a sample of mutants; print those that no test notices, and a count of each
    status. 1 if too many are not noticed.

    Raises:
        EdgeError: no mutant's name contains `only`.
    """
    in_c = c_mutants.changes()
    of_c = drawn(in_c, count // 2, only)
    results = {}
    if not only.startswith("export/c"):
        results = tried_in_python(count - len(of_c), minutes, only)
    if not (results or of_c):
        raise EdgeError(f"no mutant's name contains {only!r}")
    with c_mutants.copied() as folder:
        for name in of_c:
            results[name] = c_mutants.status_of(in_c[name], folder)
    unnoticed = sorted(name for name in results if results[name] in UNNOTICED)
    for name in unnoticed:
        print(f"{results[name]}: {name}\n{in_c.get(name) or output('show', name)}")
    counts = Counter(results.values())
    print(", ".join(f"{status}: {n}" for status, n in counts.most_common()))
    tried = len(results) - counts["not checked"]
    return 1 if len(unnoticed) > MOST_UNNOTICED * tried else 0


def drawn(names, count, only):
    """So many of the names, of `ROOMS` or those that contain a text."""
    wanted = [n for n in names if (only in n if only else n.startswith(tuple(ROOMS)))]
    return Random(2012).sample(wanted, min(count, len(wanted)))


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--count", 200, "mutants to draw"),
        ("--minutes", 15.0, "at most"),
        ("--only", "", "draw from mutants whose name contains this"),
    )
