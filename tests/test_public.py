"""Public names have examples; every example in a docstring runs."""

import doctest
from importlib import import_module

import pytest

import edge
from tests.conftest import ROOT

WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "edge").rglob("*.py")
    if "    >>> " in path.read_text()
)


@pytest.mark.parametrize("name", edge.__all__)
def test_every_public_name_is_there_with_an_example_in_its_docstring(name):
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(edge, name), name)
    assert example.examples
    assert not any(doctest.SKIP in line.options for line in example.examples)
    assert name in dir(edge)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_the_examples_in_docstrings_run(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(import_module(module))
    assert result.failed == 0


def test_a_name_that_is_not_public_is_no_attribute():
    with pytest.raises(AttributeError, match="no attribute 'Watcher'"):
        edge.Watcher  # noqa: B018
