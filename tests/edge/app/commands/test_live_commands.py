"""`scan` and `run` as a user runs them, over the fake."""

import json
import signal
from dataclasses import replace

import numpy as np
import pytest

from edge.app import source
from edge.app.commands.scan import below_rest
from edge.record import recording, saving
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses
from edge.wire.fake.touches import still
from edge.wire.skin import file as skinfile
from edge.wire.skin.skin import Skin
from tests.conftest import decided, lines, python


def test_scan_over_the_fake_maps_the_whole_skin(edge, quiet):
    status, events, err = edge("scan", "--fake", quiet)
    assert status == 0
    assert [e["state"] for e in events] == ["running"] * 32
    assert err.count("|" + "#" * 24 + "|") == 16


@pytest.mark.parametrize(("threshold", "count"), [(12, 7), (0, 0)])
def test_scan_counts_taxels_that_were_touched_when_they_were_calibrated(
    threshold, count
):
    """Without a threshold nothing tells them from noise."""
    file = calibrated(skinfile.load(skinfile.shipped("mpr121")))
    layout = replace(file.layout, threshold_counts=threshold)
    file = replace(file, layout=layout)
    clock = VirtualClock()
    silence = np.zeros(file.layout.shape, np.uint16)
    buses = fake_buses(file, lambda t: silence, clock)
    touched = file.calibration.baseline.astype(np.int32)
    touched.flat[:7] -= 100
    calibration = replace(file.calibration, baseline=touched)
    with Skin(replace(file, calibration=calibration), buses, clock=clock) as skin:
        skin.start()
        skin.read()
        assert below_rest(skin) == count


def test_a_microcontroller_that_hangs_with_an_intact_frame_is_heard_of(
    edge,
    tmp_path,
    monkeypatch,
    capsys,
):
    """Its sequence number stands still."""
    monkeypatch.setattr("edge.wire.fake.block.RATE_HZ", 0.0)
    skin = skinfile.shipped("matrix")
    rest = tmp_path / "rest.npz"
    saving.save(rest, still(skinfile.load(skin), 2.0))
    monkeypatch.setattr("edge.wire.fake.player.NOISE_COUNTS", 0.0)
    fake = ("--skin", skin, "--fake", rest)
    status, (chip,), err = edge("scan", *fake)
    assert status == 1
    assert chip["state"] == "running"
    assert chip["invalid"] == 100
    assert err.count("|" + "." * 10 + "|") == 10
    assert err.endswith("0 of 1 chips answer; taxels without a valid value: 100\n")


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
