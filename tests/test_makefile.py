"""The Makefile refuses data that is not there."""

import pytest

from tests.conftest import ROOT, ended


def make(*words, **options):
    """An ended `make`."""
    return ended("make", "-f", ROOT / "Makefile", *words, **options)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["DATA="], "DATA is empty; name a folder of recordings"),
        (["data=x"], "give DATA=x in capitals"),
        (["DATA=none/at all"], "DATA names none/at, which does not exist"),
    ],
)
def test_data_that_is_not_there_is_refused(words, sentence):
    result = make("export", *words)
    assert result.returncode == 2
    assert sentence in result.stderr


def test_a_dry_run_says_what_it_would_do_with_data_that_are_not_there_yet():
    result = make("-n", "export", "DATA=later kept")
    assert "--data later kept" in result.stdout


def test_a_front_of_its_own_folder_comes_first_and_must_have_been_measured(tmp_path):
    words = ("export", f"DATA={tmp_path}", f"OUT={tmp_path}", "FRONT=fast")
    result = make(*words, cwd=tmp_path)  # where no earlier run has left a front
    assert result.returncode == 2
    assert "FRONT needs the points of `make tradeoff`" in result.stderr
    (tmp_path / "tradeoff").mkdir()
    (tmp_path / "tradeoff" / "front.json").write_text("{}")
    result = make("-n", *words)
    assert result.returncode == 0
    assert f"--front fast --fronts {tmp_path}/tradeoff/front.json" in result.stdout
