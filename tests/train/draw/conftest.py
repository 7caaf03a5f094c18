"""Fixtures that the tests of pictures share."""

import pytest
from matplotlib.figure import Figure


@pytest.fixture(scope="module")
def drawn():
    """The figures that are saved."""
    figures = []
    save = Figure.savefig

    def spy(figure, *arguments, **options):
        figures.append(figure)
        save(figure, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", spy)
        yield figures
