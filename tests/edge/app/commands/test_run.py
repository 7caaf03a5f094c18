"""`scan` and `run` as a user runs them, over the fake."""

import json
import signal

import pytest

from edge.app import source
from edge.record import recording, saving
from edge.wire.skin import file as skinfile
from tests.conftest import decided, lines, python


def answered(event):
    """What an event says of the touch, but for its times.

    The wires' clock shifts times by less than a microsecond, which may tell a touch
    from that of training.
    """
    keys = ("event", "task", "label", "confidence", "window_s")
    answer = {key: event.get(key) for key in keys}
    return {**answer, "flags": set(event.get("flags", ())) - {"as_trained"}}


@pytest.fixture
def run(edge, exported):
    """Run with the exported model."""
    return lambda *options: edge("run", "--model", exported / "model.onnx", *options)


@pytest.mark.parametrize("name", ["hard_0", "soft_3"])
def test_run_over_the_fake_decides_as_replay_does(
    edge,
    run,
    exported,
    recordings,
    name,
):
    """The same frames, once from the file and once through drivers, wires and
    threads."""
    path = recordings / f"{name}.npz"
    status, (*live, end), err = run("--fake", path)
    _, played, _ = edge("replay", "--model", exported / "model.onnx", path)
    assert status == 0
    assert err == ""
    assert list(map(answered, live)) == list(map(answered, played))
    assert live[0]["onset_s"] == pytest.approx(played[0]["onset_s"], abs=1e-6)
    assert end == {
        "event": "end",
        "frames": 180,
        "missed_ticks": 0,
        "period_ms": {"p50": 10.01, "p99": 10.01, "p99.9": 10.01},
    }


@pytest.mark.parametrize(
    ("options", "onsets", "frames"),
    [((), 1, 230), (("--loop", "--seconds", 4.6), 2, 460)],
)
def test_run_ends_with_its_recording_unless_told_to_loop(
    run,
    parted,
    options,
    onsets,
    frames,
):
    events = run("--fake", parted, *options)[1]
    assert sum(event["event"] == "onset" for event in events) == onsets
    assert events[-1]["frames"] == frames


@pytest.fixture
def bare(make_touch, tmp_path):
    """A touch without joint angles, which the model needs."""
    saving.save(tmp_path / "bare.npz", make_touch(arm=False))
    return tmp_path / "bare.npz"


@pytest.mark.parametrize(
    ("options", "flag"),
    [
        (("--joints", "udp:0"), "missing_pose"),  # a sender that is silent
        (("--joints", "udp:0", "--without-joints", "skin"), "skin_motion"),
        (("--without-joints", "skin"), "skin_motion"),
    ],
)
def test_run_flags_a_decision_whose_joints_never_came(run, bare, options, flag):
    status, events, _ = run("--fake", bare, *options)
    assert status == 0
    # A busy machine may miss frames of what is played in real time, which is flagged too.
    assert [flag in flags for flags in decided(events, "flags")] == [True] * 2


def test_run_takes_joints_from_stdin(exported, recordings):
    """All lines come at once: some poses are known, and later ones are missing."""
    trial = recording.load(recordings / "hard_2.npz")
    sent = "".join(
        json.dumps({"t": t, "q": q}) + "\n"
        for t, q in zip(trial.t.tolist()[:63], trial.joints.tolist(), strict=False)
    )
    options = ("--model", exported / "model.onnx", "--fake", recordings / "hard_2.npz")
    command = ("-m", "edge", "run", *options, "--joints", "stdin")
    process = python(*command, input=sent + "nonsense\n", timeout=60)
    assert process.returncode == 0
    flags = decided(lines(process.stdout), "flags")
    assert len(flags) == 2
    assert all("missing_pose" in f for f in flags)
    assert "unusable lines: 1; the last one: a line is not" in process.stderr


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--loop"], "--loop works only with --fake"),
        ([], "give --skin skin.toml, or --fake REC.npz to use no hardware"),
        (["--fake", "no.npz"], "no.npz: cannot be read: No such file"),
        (["--skin", "no.toml"], "no.toml: cannot be read"),
        (
            ["--fake", "REC", "--joints", "tcp:5"],
            "--joints: give stdin or udp:[HOST:]PORT",
        ),
        (["--fake", "REC", "--skin", "PAD"], "the recording has 16 x 24 taxels, the"),
    ],
)
def test_a_bad_option_is_one_sentence(run, recordings, arguments, sentence):
    files = {"REC": recordings / "hard_0.npz", "PAD": skinfile.shipped("mpr121")}
    status, events, err = run(*(files.get(a, a) for a in arguments))
    assert status == 2
    assert events == []
    assert err.startswith("edge-classify: ")
    assert sentence in err
    assert err.count("\n") == 1


def test_a_signal_ends_a_command_at_once_until_the_skin_is_set_up(
    run, recordings, monkeypatch
):
    """A silent serial port may take seconds, and there is nothing to lose yet."""
    handled = []
    open_skin = source.open_skin

    def opened(*arguments, **options):
        handled.append(signal.getsignal(signal.SIGTERM))
        return open_skin(*arguments, **options)

    monkeypatch.setattr(source, "open_skin", opened)
    assert run("--fake", recordings / "soft_1.npz")[0] == 0
    assert handled == [signal.SIG_DFL]
