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


def test_a_front_that_was_never_measured_is_named(tmp_path):
    done = subprocess.run(
        ["make", "export", f"DATA={tmp_path}", f"OUT={tmp_path}", "FRONT=fast"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if not (ROOT / "build" / "tradeoff" / "front.json").exists():
        assert done.returncode == 2
        assert "FRONT needs the points of `make tradeoff`" in done.stderr


def test_a_front_of_its_own_folder_comes_first(tmp_path):
    (tmp_path / "tradeoff").mkdir()
    (tmp_path / "tradeoff" / "front.json").write_text("{}")
    done = subprocess.run(
        ["make", "-n", "export", f"DATA={tmp_path}", f"OUT={tmp_path}", "FRONT=fast"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"--front fast --fronts {tmp_path}/tradeoff/front.json" in done.stdout
