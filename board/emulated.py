"""A pytest plugin for tests under emulation: a tenth of the speed, so fewer random examples.

Random inputs are searched on the machine itself; here it is asked whether the same code does the
same on another architecture. What a test waits for another process gets as much longer.
"""

import functools
import subprocess

from hypothesis import HealthCheck, is_hypothesis_test, settings

EXAMPLES = 20
SLOWER = 10
"""How many times as long another process may take."""


def pytest_configure():
    """Wait longer for other processes."""
    for name in ("communicate", "wait"):
        setattr(subprocess.Popen, name, patient(getattr(subprocess.Popen, name)))


def patient(wait):
    """A method of `Popen` with its time limit stretched."""

    @functools.wraps(wait)
    def longer(self, *arguments, timeout=None, **named):
        limit = None if timeout is None else SLOWER * timeout
        return wait(self, *arguments, timeout=limit, **named)

    return longer


def pytest_collection_modifyitems(items):
    """Cut the number of examples, and let them take their time."""
    for test in {getattr(item, "function", None) for item in items}:
        if test is not None and is_hypothesis_test(test):
            own = test._hypothesis_internal_use_settings
            test._hypothesis_internal_use_settings = settings(
                own,
                max_examples=min(own.max_examples, EXAMPLES),
                deadline=None,
                suppress_health_check=list(HealthCheck),
            )
