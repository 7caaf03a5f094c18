"""Options that several commands share: numbers with limits."""

import pytest

from edge.app.cli import main


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ["fake", "--trials", "0"],
            "--trials: must be a whole number from 1 to 1000, not '0'",
        ),
        (["fake", "--seed", "1.5"], "--seed: must be a whole number from 0 to 9.2"),
        (
            ["record", "--length", "nan"],
            "--length: must be a number from 0.1 to 600, not 'nan'",
        ),
        (
            ["label", "a.npz", "--set", "object=a\nb"],
            "--set: must be TASK=LABEL, such as",
        ),
        (
            ["run", "--seconds", "soon"],
            "--seconds: must be a number from 0.001 to 1e+09",
        ),
    ],
)
def test_a_value_that_an_option_does_not_take_is_refused(options, sentence, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(options)
    assert sentence in capsys.readouterr().err
