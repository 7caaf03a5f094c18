"""A program that ends at once, at any step of what it does."""

from contextlib import suppress
from itertools import count

import pytest


class Killed(BaseException):
    """A program ends at once."""


def dies(action, places, last):
    """Do something, and die before the call of that number among those of the functions
    `name` of the owners in `places`; whether it died."""
    steps = count()

    def mortal(function):
        def step(*words, **options):
            if next(steps) == last:
                raise Killed
            return function(*words, **options)

        return step

    with pytest.MonkeyPatch.context() as patch, suppress(Killed):
        for owner, name in places:
            patch.setattr(owner, name, mortal(getattr(owner, name)))
        action()
        return False
    return True
