"""The command that proposes thresholds."""

from edge.saving import save
from tests.train.data.test_thresholds import noisy, weaker
from train.__main__ import main


def test_the_command_says_what_to_use(make_touch, tmp_path, capsys):
    for seed in range(3):
        save(tmp_path / f"{seed}.npz", noisy(make_touch(seed=seed), seed))
    assert main(["thresholds", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("use: --threshold 8")
    row = next(line for line in lines if line.startswith("proposed"))
    assert row.split()[-1] == "3"


def test_the_command_says_what_its_proposal_hides(make_touch, tmp_path, capsys):
    for seed, peak in enumerate((900.0, 900.0, 70.0, 50.0)):
        touch = make_touch(seed=seed)
        save(
            tmp_path / f"{seed}.npz",
            noisy(weaker(touch, peak / touch.frames.max()), seed),
        )
    assert main(["thresholds", str(tmp_path)]) == 0
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith(
        "other thresholds show a contact in 1 more of the recordings"
    )
