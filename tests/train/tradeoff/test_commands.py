"""Commands of the report: they name the data, the folder and the scene that make takes
no default for."""

from pathlib import Path

import pytest

from train.tradeoff.commands import Commands

BUILD = Path("build/tradeoff")


@pytest.mark.parametrize(
    ("commands", "expected"),
    [
        (
            Commands(("build/cody18",), BUILD, "train/scenes/cody18.toml"),
            "make export EXPORT='--window 1'",
        ),
        (
            Commands(("build/household",), BUILD, "train/scenes/household.toml"),
            "make export SCENE=train/scenes/household.toml EXPORT='--window 1'",
        ),
        (
            Commands(("mine",), BUILD),
            "make export DATA=mine EXPORT='--window 1'",
        ),
        (
            Commands(("mine", "kept"), Path("out/tradeoff")),
            "make export DATA='mine kept' OUT=out EXPORT='--window 1'",
        ),
        (
            Commands(("mine",), BUILD, quick=True),
            "make export DATA=mine EXPORT='--quick --window 1'",
        ),
        (
            Commands(("my touches",), BUILD),
            "python -m export --data 'my touches' --out build --window 1",
        ),
        (
            Commands(("build/b c",), BUILD, "b c.toml"),
            "python -m export --data 'build/b c' --out build --window 1",
        ),
        (
            Commands(("mine",), Path("elsewhere")),
            "python -m export --data mine --out elsewhere --window 1",
        ),
    ],
)
def test_a_model_of_a_window(commands, expected):
    assert commands.export("--window 1") == expected


def test_a_point_of_the_front():
    assert (
        Commands(("mine",), BUILD).front("fast") == "make export DATA=mine FRONT=fast"
    )
    assert Commands(("my touches",), Path("a b")).front("0.9") == (
        "python -m export --data 'my touches' --out 'a b' --front 0.9 "
        "--fronts 'a b/front.json'"
    )


COST = "--cost wrong=10,second=1"


def test_the_report_again():
    assert Commands(("mine",), BUILD, quick=True).tradeoff(COST) == (
        f'make tradeoff DATA=mine TRADEOFF="--quick {COST}"'
    )


def test_the_report_again_with_the_board_and_the_other_options_that_it_was_made_with():
    board = Path("pi.json")
    assert Commands(("mine",), BUILD, board=board, task="object").tradeoff(COST) == (
        f'make tradeoff DATA=mine BOARD=pi.json TRADEOFF="--task object {COST}"'
    )


def test_the_report_again_without_make_names_every_file():
    assert Commands(("my touches",), BUILD, "a.toml").tradeoff(COST) == (
        "python -m train tradeoff --data 'my touches' --board build/tradeoff/board.json "
        f"--out build/tradeoff --scene a.toml {COST}"
    )
