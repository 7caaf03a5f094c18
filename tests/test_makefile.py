"""The Makefile refuses data that is not there."""

import subprocess

import pytest

from tests.conftest import ROOT


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["DATA="], "DATA is empty; name a folder of recordings"),
        (["data=x"], "give DATA=x in capitals"),
        (["DATA=none/at all"], "DATA names none/at, which does not exist"),
    ],
)
def test_data_that_is_not_there_is_refused(words, sentence):
    done = subprocess.run(
        ["make", "export", *words], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert sentence in done.stderr


def test_a_dry_run_says_what_it_would_do_with_data_that_are_not_there_yet():
    done = subprocess.run(
        ["make", "-n", "export", "DATA=later kept"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert "--data later kept" in done.stdout
