"""The programs in examples/ run unchanged; the ROS node runs over a stand-in for
rclpy."""

import json
import re
import runpy
import sys
from collections import defaultdict
from dataclasses import replace
from importlib import import_module
from types import ModuleType, SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import edge
from edge import demo
from edge.wire.fake.player import play, skin_file
from tests.conftest import ROOT, python, save_touches
from tests.edge.record.test_recording import sheared
from train.__main__ import main as train_main

EXAMPLES = ROOT / "docs" / "examples"
PACKAGE = EXAMPLES / "ros2" / "edge_classify_ros"
PILLOW = demo.FOLDER / "pillow-movable.npz"


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs an example; returns the lines that it prints."""

    def run(program, *arguments):
        path = EXAMPLES / program
        assert len(path.read_text().splitlines()) <= 10
        monkeypatch.setattr(sys, "argv", [program, *map(str, arguments)])
        runpy.run_path(str(path))
        return capsys.readouterr().out.splitlines()

    return run


def test_a_recording_is_classified(run):
    onset, *decided = run("classify_recording.py", demo.MODEL, PILLOW)
    assert onset.startswith("Onset(onset_s=")
    assert [line.split(",")[:2] for line in decided] == [
        ["Decided(task='category'", " label='soft-movable'"],
        ["Decided(task='mobility'", " label='movable'"],
        ["Decided(task='object'", " label='pillow'"],
    ]


def test_positions_are_drawn_from_the_lines_of_a_run(edge, tmp_path):
    words = ("--model", demo.MODEL, "--fake", PILLOW, "--contacts", 4)
    _, lines, _ = edge("run", *words)
    piped = "".join(f"{json.dumps(line)}\n" for line in lines)
    out = tmp_path / "positions.png"
    drawn = python(EXAMPLES / "draw_positions.py", "category", out, input=piped)
    assert drawn.returncode == 0, drawn.stderr
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_model_is_fitted_and_exported(run, make_touch, tmp_path):
    trials = save_touches(tmp_path / "trials", 5)
    run("fit_and_export.py", trials, tmp_path / "model.onnx")
    model = edge.Model(tmp_path / "model.onnx")
    events = edge.Classifier(model).classify(make_touch(kind="hard", seed=9))
    decided = [event for event in events if isinstance(event, edge.Decided)]
    (category,) = (event.label for event in decided if event.task == "category")
    assert category == "rigid-fixed"


def test_tables_are_written_into_their_folder_whatever_the_objects_name(
    make_touch, tmp_path
):
    for number, name in enumerate(("foam block", "../up", "/etc/x")):
        touch = make_touch(seed=number, seconds=0.0, labels={"object": name})
        edge.save(tmp_path / "touches" / f"{number}.npz", touch)
    tables = tmp_path / "tables"
    result = python(EXAMPLES / "to_csv.py", tmp_path / "touches", tables)
    assert result.stderr == ""
    paths = [path.relative_to(tables).as_posix() for path in tables.rglob("*.csv")]
    assert sorted(paths) == ["-etc-x/2.csv", "-up/1.csv", "foam-block/0.csv"]


def program(name):
    """The function `main` of an example."""
    return runpy.run_path(str(EXAMPLES / name))["main"]


def imported(table, *options):
    """The recordings that `import csv` makes of a table."""
    out = table.parent / "recordings"
    words = ["import", "csv", table, "--out", out, *options]
    assert train_main([*map(str, words)]) == 0
    return [edge.load(path) for path in sorted(out.glob("*.npz"))]


TASKS = ("grasp the cup", "grasp the box")
COUNTS = np.arange(30)[:, None] + 10 * np.arange(6)
SHEARED = np.stack([COUNTS // 2, -(COUNTS // 4), COUNTS], axis=2)


def in_files(folder, tasks, episodes):
    """A data set of LeRobot v2.1: a file for each episode."""
    tasks.reset_index().to_json(
        folder / "meta" / "tasks.jsonl", orient="records", lines=True
    )
    for number, data in enumerate(episodes):
        data.to_parquet(folder / "data" / "chunk-000" / f"file-{number:03}.parquet")


def in_one(folder, tasks, episodes):
    """One of v3: a file for many episodes."""
    tasks.to_parquet(folder / "meta" / "tasks.parquet")
    pd.concat(episodes).to_parquet(folder / "data" / "chunk-000" / "file-000.parquet")


AXES = ("--axes", "xyz")


@pytest.mark.parametrize(
    ("write", "counts", "options"), [(in_files, COUNTS, ()), (in_one, SHEARED, AXES)]
)
def test_a_lerobot_data_set_is_imported(tmp_path, write, counts, options):
    pytest.importorskip("pyarrow")
    folder = tmp_path / "set"
    for name in ("meta", "data/chunk-000"):
        (folder / name).mkdir(parents=True)
    tasks = pd.DataFrame({"task_index": [0, 1]}, index=pd.Index(TASKS, name="task"))
    rows = {"observation.state": [[0.1, -0.2]] * 30, "timestamp": 0.02 * np.arange(30)}
    rows["observation.tactile"] = counts.tolist()
    write(
        folder,
        tasks,
        [pd.DataFrame({**rows, "episode_index": n, "task_index": n}) for n in (0, 1)],
    )
    table = tmp_path / "all.parquet"
    columns = ("observation.tactile", "observation.state")
    program("import_lerobot.py")(str(folder), str(table), *columns)
    options = ("--shape", "2x3", "--joints", "joint_1-joint_2", *options)
    first, second = imported(table, *options)
    assert (first.labels["object"], second.labels["object"]) == TASKS
    assert (second.frames.reshape(30, 6) == COUNTS).all()
    assert second.t[-1] == pytest.approx(0.58)
    assert second.joints[9].tolist() == [0.1, -0.2]
    if counts is SHEARED:
        assert (second.shear.reshape(30, 6, 2) == SHEARED[:, :, :2]).all()


@pytest.mark.parametrize(
    ("change", "options"), [(lambda trial: trial, ()), (sheared, AXES)]
)
def test_import_reads_a_table_of_recordings_back(make_touch, tmp_path, change, options):
    pytest.importorskip("pyarrow")
    trials = []
    for number in range(2):
        trial = change(make_touch(seed=number, labels={"object": f"thing {number}"}))
        valid = np.ones(trial.frames.shape, dtype=bool)
        valid[3, 4, 5] = number == 0
        trials.append(replace(trial, valid=valid))
        edge.save(tmp_path / "in" / f"touch_{number}.npz", trials[-1])
    table = tmp_path / "all.parquet"
    program("save_table.py")(str(tmp_path / "in"), str(table))
    options = ("--joints", "joint_1-joint_5", "--shape", "16x24", *options)
    read = imported(table, *options)
    for trial, back in zip(trials, read, strict=True):
        assert back.labels == trial.labels
        assert (back.frames == trial.frames * trial.valid).all()
        assert back.t == pytest.approx(trial.t - trial.t[0])
        assert back.joints == pytest.approx(trial.joints)
        assert np.array_equal(back.shear, trial.shear)
    assert not read[1].valid[3, 4, 5]


def test_a_skin_is_watched(monkeypatch, run):
    """A fake skin feels a touch, and then the owner presses Ctrl-C."""
    recording = edge.load(PILLOW)
    skin, playback = play(skin_file(recording.layout), recording)
    read = skin.read

    def until_the_end():
        if skin.clock.now() - playback.start > playback.ends:
            raise KeyboardInterrupt
        return read()

    monkeypatch.setattr(skin, "read", until_the_end)
    monkeypatch.setattr(edge.Skin, "open", lambda file: skin)
    printed = []
    monkeypatch.setattr("builtins.print", printed.append)
    with pytest.raises(KeyboardInterrupt):
        run("watch_skin.py", demo.MODEL, "skin.toml")
    onset, *decided = printed
    assert isinstance(onset, edge.Onset)
    assert {event.task for event in decided} == set(edge.Model(demo.MODEL).info.tasks)


FIELDS = {
    "Classification": {"header": object, "results": list},
    "DiagnosticArray": {"header": object, "status": list},
    "DiagnosticStatus": {
        "level": bytes,
        "name": str,
        "message": str,
        "hardware_id": str,
        "values": list,
    },
    "Header": {"stamp": str, "frame_id": str},
    "JointState": {"header": object, "name": list, "position": list},
    "KeyValue": {"key": str, "value": str},
    "ObjectHypothesis": {"class_id": str, "score": float},
    "ParameterDescriptor": {"dynamic_typing": bool},
    "String": {"data": str},
}
"""The fields of the messages, as their .msg files declare them, with their types."""


class Message:
    """A message that takes its own fields alone, each of its own type, as those of
    rosidl do."""

    def __init__(self, **fields):
        if "header" in FIELDS[type(self).__name__]:
            fields.setdefault("header", MESSAGES["Header"]())
        for name, value in fields.items():
            setattr(self, name, value)

    def __setattr__(self, name, value):
        kind = FIELDS[type(self).__name__][name]
        assert isinstance(value, kind), f"{name} is {kind}, not {value!r}"
        super().__setattr__(name, value)


MESSAGES = {name: type(name, (Message,), {}) for name in FIELDS}
MESSAGES["DiagnosticStatus"].OK = b"\0"
MESSAGES["DiagnosticStatus"].WARN = b"\1"


class Ros:
    """The part of rclpy and its messages that the node uses: one node, spun until it
    has ended."""

    def __init__(self, model=demo.MODEL, fake=PILLOW, **more):
        parameters = {"model": str(model), "fake": str(fake), **more}
        self.topics = defaultdict(list)
        self.heard = {}
        ros = self

        class Node:
            def __init__(self, name):
                self.name = name

            def declare_parameter(self, name, default, descriptor):
                assert descriptor.dynamic_typing
                return SimpleNamespace(value=parameters.get(name, default))

            def create_publisher(self, kind, topic, depth):
                return SimpleNamespace(publish=ros.topics[topic].append)

            def create_subscription(self, kind, topic, callback, depth):
                ros.heard[topic] = callback

            def create_timer(self, period_s, callback):
                assert period_s == 1.0

            def get_clock(self):
                stamp = SimpleNamespace(to_msg=lambda: "now")
                return SimpleNamespace(now=lambda: stamp)

            def destroy_node(self):
                ros.destroyed = self

        messages = SimpleNamespace(**MESSAGES)
        spin = SimpleNamespace(spin=self.spin, ok=lambda: True)
        spin.init = spin.try_shutdown = lambda: None
        stopped = type("ExternalShutdownException", (Exception,), {})
        self.modules = {
            "rclpy": spin,
            "rclpy.node": SimpleNamespace(Node=Node),
            "rclpy.executors": SimpleNamespace(ExternalShutdownException=stopped),
        }
        packages = "diagnostic_msgs rcl_interfaces sensor_msgs std_msgs vision_msgs"
        for package in packages.split():
            self.modules[package] = ModuleType(package)
            self.modules[f"{package}.msg"] = messages

    def spin(self, node):
        node._reading.join()
        node.diagnose()

    def run(self, monkeypatch):
        for name, module in self.modules.items():
            monkeypatch.setitem(sys.modules, name, module)
        monkeypatch.syspath_prepend(str(PACKAGE))
        monkeypatch.delitem(sys.modules, "edge_classify_ros.node", raising=False)
        return import_module("edge_classify_ros.node").main()


def test_the_ros_node_publishes_each_decision_and_the_state_of_its_chips(monkeypatch):
    """ROS reads `error: 0` as a whole number."""
    ros = Ros(frame_id="arm_skin", error=0)
    assert ros.run(monkeypatch) == 0
    (mobility,) = ros.topics["~/mobility"]
    assert vars(mobility.header) == {"stamp": "now", "frame_id": "arm_skin"}
    (answer,) = mobility.results
    assert answer.class_id == "movable"
    assert 0.9 < answer.score < 1.0
    events = [json.loads(message.data)["event"] for message in ros.topics["~/events"]]
    tasks = len(edge.Model(demo.MODEL).info.tasks)
    assert events == ["onset", *["decision"] * tasks]
    (status,) = ros.topics["/diagnostics"][0].status
    assert status.level == status.OK
    values = {pair.key: pair.value for pair in status.values}
    assert values == {"chips": "32", "decisions": str(tasks)}


def test_the_ros_node_takes_joint_angles_by_name(monkeypatch):
    """The skin is played from a recording, and JointState gives the angles."""
    recording = edge.load(PILLOW)
    model = edge.Model(demo.MODEL)
    chain = edge.Chain.cody()
    model.info = replace(model.info, chain=chain)
    monkeypatch.setattr(edge, "Model", lambda path: model)
    skin, _ = play(skin_file(recording.layout), recording)
    monkeypatch.setattr(edge.Skin, "open", lambda file: skin)
    ros = Ros(fake="", skin="skin.toml")
    spun = []

    def spin(node):
        spun.append(node._joints.at(skin.clock.now()))
        stamp = SimpleNamespace(sec=7, nanosec=5 * 10**8)
        message = SimpleNamespace(
            header=SimpleNamespace(stamp=stamp),
            name=["wheel", *chain.names[::-1]],
            position=[9.0, *range(chain.dof)],
        )
        ros.heard["joint_states"](message)
        spun.append(node._joints.at(skin.clock.now()))

    ros.modules["rclpy"].spin = spin
    monkeypatch.setattr(edge.Classifier, "watch", lambda self, skin, **more: iter(()))
    ros.run(monkeypatch)
    assert spun[0] is None
    assert spun[1].tolist() == [4.0, 3.0, 2.0, 1.0, 0.0]


@pytest.mark.parametrize(("is_up", "status"), [(True, 2), (False, 0)])
def test_an_error_that_ended_the_reading_ends_the_ros_node(
    monkeypatch, capsys, is_up, status
):
    """What is published after Ctrl-C raises an error of its own, which is no
    failure."""

    def unplugged(self, skin, **more):
        raise edge.EdgeError("i2c-1: no chip answers")
        yield

    monkeypatch.setattr(edge.Classifier, "watch", unplugged)
    ros = Ros()
    ros.modules["rclpy"].ok = lambda: is_up
    assert ros.run(monkeypatch) == status
    sentence = "edge_classify: i2c-1: no chip answers\n"
    assert capsys.readouterr().err == sentence * is_up
    assert ros.destroyed.name == "edge_classify"


def test_the_ros_node_names_an_error_that_is_no_number(monkeypatch, capsys):
    assert Ros(error="few").run(monkeypatch) == 2
    assert "error must be a number" in capsys.readouterr().err


def test_the_ros_node_names_the_chips_that_are_not_read(monkeypatch):
    ros = Ros()

    def spin(node):
        node._reading.join()
        first, second, *_ = node._skin.status()
        down = [replace(first, state="down"), second]
        monkeypatch.setattr(node._skin, "status", lambda: down)
        node.diagnose()

    ros.modules["rclpy"].spin = spin
    ros.run(monkeypatch)
    (status,) = ros.topics["/diagnostics"][0].status
    assert status.level == status.WARN
    assert status.message.startswith("not read: ")
    assert status.message.count("0x") >= 1


def test_a_task_becomes_a_valid_topic(monkeypatch):
    Ros("no.onnx").run(monkeypatch)
    tasks = {"object": "object", "36 things": "task_36_things"}
    tasks |= {"Größe/x": "gr_e_x", "--": "task"}
    topic = sys.modules["edge_classify_ros.node"].topic
    assert {task: topic(task) for task in tasks} == tasks


def test_the_launch_file_gives_every_parameter_of_the_node():
    launch = (PACKAGE / "launch" / "classify.launch.py").read_text()
    node = (PACKAGE / "edge_classify_ros" / "node.py").read_text()
    declared = set(re.findall(r'^                \("(\w+)", ', node, re.M))
    assert declared == {"model", "skin", "fake", "error", "frame_id"}
    assert declared <= set(re.findall(r'^    "(\w+)": \(', launch, re.M))
