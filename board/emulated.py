"""A pytest plugin for tests under emulation, which runs at a tenth of the speed: fewer examples.

Random inputs are searched on the machine itself. Under emulation the question is only whether the
same code gives the same results on another architecture.
"""

from hypothesis import HealthCheck, is_hypothesis_test, settings

EXAMPLES = 20


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
