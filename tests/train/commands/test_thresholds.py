"""The command that proposes thresholds."""

from edge.record.saving import save
from tests.train.data.test_thresholds import noisy
from train.__main__ import main


def test_the_command_says_what_to_use(make_touch, tmp_path, capsys):
    for seed in range(3):
        save(tmp_path / f"{seed}.npz", noisy(make_touch(seed=seed), seed))
    assert main(["thresholds", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("use: --threshold 8")
    row = next(line for line in lines if line.startswith("proposed"))
    assert row.split()[-1] == "3"
