"""A model in C gives the bits of `replay`: on this machine, and on Cortex-M0+, M4F and
M33 under QEMU."""

import json
import shutil
import subprocess
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from edge import demo
from edge.decide.classifier import Classifier
from edge.decide.events import Decided
from edge.decide.info import OutlierLimits, margin
from edge.decide.model import Model
from edge.elementary import logistic
from edge.errors import InputError
from edge.features.kernels import BITS, KernelTable, channels_of
from edge.features.names import feature
from edge.features.names import names as all_names
from edge.features.quantities import KERNELS, OF_ZONES, Quantity
from edge.record.recording import load
from edge.record.saving import save
from edge.touch.layout import SkinLayout
from edge.wire.skin import file as skinfile
from export import c_code, skin_code
from export.c_text import literal
from export.costs import SLICE
from tests.conftest import ROOT, ended, export, in_a_row, touch
from tests.edge.decide.test_knn import hostile
from tests.export.microcontroller import machine
from tests.export.microcontroller.comparison import (
    assert_same,
    assert_same_events,
    needs_gcc,
    needs_qemu,
    same,
)
from tests.export.microcontroller.recordings import (
    damaged,
    on_the_edges,
    recordings_for,
)
from tests.export.test_early_stopping import pressed
from train.data.feature_sets import expand, unit
from train.importers import sdh2


@pytest.fixture(scope="module")
def early(tmp_path_factory):
    """A model that decides early, of features of every kind, with a joint task and
    ties, and touches new to it."""
    folder = tmp_path_factory.mktemp("early")
    for i, recording in enumerate(pressed(touch, range(8))):
        save(folder / "data" / f"{i:02d}.npz", recording)
    words = ["--features", "contact", "moments", "joints", "--quick", "--scaling", "IV"]
    words += ["--k", "2", "--decision-points", "0.3,0.6,1.2", "--c", folder / "c"]
    out = export(folder / "out", "--data", folder / "data", *words)
    model = Model(out / "model.onnx")
    assert model.info.joint_tasks.keys() == {"category"}
    rng = np.random.default_rng(5)
    touches = list(pressed(touch, range(30, 32)))
    touches.append(in_a_row(touch(seed=50, seconds=0.5), touch(seed=51)))
    touches += [damaged(recording, rng) for recording in touches]
    return model, [*touches, *on_the_edges(model.info.layout)]


@pytest.mark.slow
@needs_gcc
def test_the_demo_has_the_same_bits(tmp_path):
    model = Model(demo.MODEL)
    rng = np.random.default_rng(1)
    touches = [load(path) for path in sorted(demo.FOLDER.glob("*.npz"))]
    touches += [damaged(recording, rng) for recording in touches * 25]
    golden = np.load(Path(__file__).parents[1] / "golden" / "demo.npz")["vectors"]
    near = np.nextafter(golden[:20], np.inf)
    assert_same(
        model, tmp_path, touches, [*golden, *near, *hostile(model.info.width, rng)]
    )


@pytest.mark.slow
@needs_gcc
def test_early_decisions_have_the_same_bits(early, tmp_path):
    model, touches = early
    vectors = hostile(model.info.width, np.random.default_rng(2))
    errors = {s.rules[i].error for s in model.info.stopping.values() for i in (0, -1)}
    for i, error in enumerate([None, *sorted(errors)]):
        assert_same(model, tmp_path / str(i), touches, vectors, error)


def on_its_limits(model, recording, ulps):
    """Metadata whose certified confidences are a contact's own, but for softness, which
    is never sure, and whose limits are its scores less so many ulps."""
    info = model.info
    points = range(len(info.decision_points_s))
    vectors = machine.vectors(model, points, recording)[1:].reshape(len(points), -1)
    answers = [model.run(vectors[i : i + 1], i) for i in points]
    limits, far = (
        tuple((a[name] - ulps * np.spacing(a[name])).item() for a in answers)
        for name in ("outlier_score", "known_distance")
    )
    stopping = {}
    for task, of_task in info.stopping.items():
        label = answers[0][f"{task}_label"].item()
        evidence = margin(answers[0][f"{task}_label_distances"][0].tolist(), label)
        log_odds = of_task.slope * evidence + of_task.intercept
        excess = info.outlier_score.excess(0, answers[0]["outlier_score"].item())
        sure = logistic(log_odds - of_task.doubt * excess)
        sure += task == "softness"
        rules = [replace(r, confidence=sure, last=points[-1]) for r in of_task.rules]
        known_distance = of_task.known_distance and replace(
            of_task.known_distance, limits=far
        )
        stopping[task] = replace(
            of_task, rules=tuple(rules), known_distance=known_distance
        )
    outlier_score = replace(info.outlier_score, limits=limits)
    return replace(info, stopping=stopping, outlier_score=outlier_score)


def half_millionths(info):
    """Metadata by which every confidence lies closer than a float tells to half-way
    between two millionths, above it or below it."""
    stopping = {}
    places = cycle((600000.5, 600001.5))
    for task, of_task in info.stopping.items():
        likely = next(places) / 1e6
        x = np.log(likely / (1.0 - likely))
        near = (x + np.spacing(x) * np.arange(-99, 99)).tolist()
        x = next(value for value in near if logistic(value) == likely)
        zeros = (0.0,) * len(of_task.slopes)
        curves = {"slopes": zeros, "doubts": zeros, "intercepts": (x,) * len(zeros)}
        stopping[task] = replace(of_task, known_distance=None, **curves)
    return replace(info, stopping=stopping)


@pytest.mark.slow
@needs_gcc
def test_scores_on_a_limit_have_the_same_bits(early, tmp_path, monkeypatch):
    model, touches = early
    error = max(s.rules[-1].error for s in model.info.stopping.values())
    metadata = [on_its_limits(model, touches[0], ulps) for ulps in (0, 1)]
    for i, info in enumerate([*metadata, half_millionths(model.info)]):
        monkeypatch.setattr(model, "info", info)
        assert_same(model, tmp_path / str(i), touches[:9], error=error)


@pytest.mark.slow
@needs_gcc
def test_a_pair_of_labels_that_was_never_met_has_no_name(tmp_path, monkeypatch):
    """Mobility is decided at once, softness at the end: they agree on nothing."""
    unmet = "soft-by 5"
    for i, recording in enumerate(pressed(touch, range(8))):
        if recording.labels["category"] != unmet:
            save(tmp_path / "data" / f"{i:02d}.npz", recording)
    words = ["--features", "contact", "--quick", "--decision-points", "0.3,0.6,1.2"]
    out = export(tmp_path / "out", "--data", tmp_path / "data", *words)
    model = Model(out / "model.onnx")
    stopping = {}
    for task, of_task in model.info.stopping.items():
        confidence = 0.0 if task == "mobility" else 2.0
        rules = [replace(r, confidence=confidence, last=2) for r in of_task.rules]
        stopping[task] = replace(of_task, rules=tuple(rules))
    monkeypatch.setattr(model, "info", replace(model.info, stopping=stopping))
    error = max(s.rules[-1].error for s in stopping.values())
    touches = list(pressed(touch, range(30, 32)))
    events = Classifier(model, error=error).classify(touches[-1])
    labels = {e.task: e.label for e in events if isinstance(e, Decided)}
    assert labels["mobility"] == "by 5"
    assert labels["softness"] == "soft"
    assert labels["category"] is None
    assert_same(model, tmp_path / "c", touches, error=error)


@pytest.mark.slow
@needs_gcc
def test_of_joint_labels_that_are_as_near_the_first_is_named(tmp_path):
    """Each training touch stands under both labels of mobility."""
    for i, recording in enumerate(pressed(touch, range(8))):
        for mobility in ("by 0", "by 5"):
            labels = {**recording.labels, "mobility": mobility}
            labels["category"] = f"{labels['softness']}-{mobility}"
            meta = {**recording.meta, "labels": labels}
            path = tmp_path / "data" / f"{i:02d}-{mobility[-1]}.npz"
            save(path, replace(recording, meta=meta))
    words = ["--features", "contact", "--quick", "--window", "1.2"]
    out = export(tmp_path / "out", "--data", tmp_path / "data", *words)
    model = Model(out / "model.onnx")
    touches = list(pressed(touch, range(30, 32)))
    events = Classifier(model).classify(touches[0])
    labels = {e.task: e.label for e in events if isinstance(e, Decided)}
    assert labels["mobility"] == min(model.info.tasks["mobility"].labels)
    assert_same(model, tmp_path / "c", touches)


@pytest.mark.slow
@needs_gcc
def test_export_writes_a_program_that_reads_touches_as_text(tmp_path):
    """Its lines are those of `replay`, but for what C lacks; with letters of two, three
    and four bytes in labels."""
    model = machine.without_an_arm(Model(demo.MODEL))
    tasks = {
        name: replace(task, labels=tuple(f"{label} ü€🧸" for label in task.labels))
        for name, task in model.info.tasks.items()
    }
    model.info = replace(model.info, tasks=tasks)
    c_code.export(model, tmp_path)
    sources = map(str, tmp_path.glob("*.c"))
    build = ["gcc", *machine.COMMON, *machine.SANITIZED, *sources, "-o", "decide"]
    subprocess.run(build, cwd=tmp_path, check=True)
    touch = replace(load(demo.FOLDER / "pillow-movable.npz"), joints=None)
    frames = zip(touch.t, touch.frames, strict=True)
    text = " ".join(f"{float(t)!r} {' '.join(map(str, f.ravel()))}" for t, f in frames)
    words = {"input": text, "text": True, "check": True}
    program = [str(tmp_path / "decide")]
    lines = subprocess.run(program, capture_output=True, **words).stdout.splitlines()
    expected = [event.to_dict() for event in Classifier(model).classify(touch)]
    for line, event in zip(lines, expected, strict=True):
        lacking = {key: event.pop(key, 0) for key in ("latency_ms", "unusual", "model")}
        shown = json.loads(line)
        assert {**lacking, **shown} == {**event, **lacking, "latency_ms": 0.0}


@pytest.mark.slow
@needs_gcc
@needs_qemu
@pytest.mark.parametrize("board", machine.BOARDS)
def test_a_microcontroller_has_the_same_bits(early, tmp_path, board):
    model, touches = early
    error = max(s.rules[-1].error for s in model.info.stopping.values())
    vectors = hostile(model.info.width, np.random.default_rng(3))
    assert_same(model, tmp_path, touches[::3], vectors, error, board)


SKINS = [
    SkinLayout(
        16, 24, True, 0.0098, 0.0375, -0.1, threshold_counts=40, onset_counts=60
    ),
    SkinLayout(10, 9, pitch_m=(0.004, 0.006), threshold_counts=0, release_s=0.11),
    SkinLayout(
        7,
        5,
        True,
        0.01,
        0.02,
        column_angles_deg=(0.0, 70.0, 150.0, 220.0, 300.0),
        dead=(3, 7, 20, 34),
        counts_per_newton=33.3,
    ),
    SkinLayout(
        22, 18, counts_per_newton=100.0, dead=tuple(range(60)), threshold_counts=9
    ),
]


def spelled(rng):
    """Names of features of every kind, with transforms and summaries."""
    names = []
    for name in all_names():
        if name not in KERNELS and "shear" not in name:
            signed = feature(name).quantity.signed
            prefixes = ["", "sqrt_", "relative_"]
            prefixes += [] if signed else ["log_", "log_relative_", "sqrt_log_"]
            prefix, second = rng.choice(prefixes, 2)
            summaries = ["", "_rate", "_mean", "_deviation", "_roughness"]
            names.append(f"{prefix}{name}{rng.choice(summaries)}@{rng.integers(2, 30)}")
            names.append(f"{second}{name}{rng.choice(summaries)}")
    return [*dict.fromkeys(names), *KERNELS]


class NoFormula:
    """In place of the formula of a model with other features."""

    tables = MappingProxyType({})
    sizes = MappingProxyType({"tasks": 1, "labels": 1, "neighbours": 1})
    trials = naming = 0

    def __init__(self, *arguments):
        pass


def measuring(layout, features, **changes):
    """The demo's model, of another skin and other features."""
    model = Model(demo.MODEL)
    model.info = replace(
        model.info,
        layout=layout,
        features=features,
        chain=model.info.chain if layout.wraps else None,
        joints=5,
        **changes,
    )
    return model


def assert_same_vectors(model, recordings, folder, monkeypatch):
    """The C of a model makes the vectors of Python."""
    monkeypatch.setattr(c_code, "Formula", NoFormula)
    c_code.export(model, folder)
    questions = [
        machine.about_recording(machine.VECTORS_OF_RECORDING, r) for r in recordings
    ]
    expected = [machine.vectors(model, [0], recording) for recording in recordings]
    answers = machine.ask(machine.compiled(folder), folder, questions)
    assert same(answers, np.concatenate(expected))


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("skin", range(len(SKINS)))
def test_every_feature_of_damaged_recordings_has_the_same_bits(
    tmp_path, monkeypatch, skin
):
    rng = np.random.default_rng(skin)
    layout = SKINS[skin]
    tables = {}
    for name, biases in KERNELS.items():
        shifts = rng.integers(-20, 3, channels_of(name, layout)).tolist()
        small = rng.integers(-30, 99, biases)
        of_cut_off = rng.integers(-12, 13, biases) * (2**BITS - 1)
        limits = np.where(rng.random(biases) < 0.5, small, of_cut_off - 1).tolist()
        tables[name] = KernelTable(tuple(shifts), tuple(limits))
    model = measuring(
        layout,
        tuple(spelled(rng)),
        samples=int(rng.choice([2, 7, 8, 17, 40, 128])),
        kernels=tables,
        debounce=int(rng.integers(1, 4)),
    )
    recordings = [*recordings_for(layout, 25, rng), *on_the_edges(layout)]
    assert_same_vectors(model, recordings, tmp_path, monkeypatch)


@needs_gcc
def test_a_quantity_is_a_record_and_reaches_the_c(tmp_path, monkeypatch):
    toy = Quantity(
        "toy",
        "{force}/taxel",
        lambda zone: zone.peak / zone.taxels,
        "(double)zone[0] / (double)(zone[1] > 1 ? zone[1] : 1)",
    )
    monkeypatch.setitem(OF_ZONES, toy.name, toy)
    names = ("skin_toy", "log_left_toy@5", "sqrt_contact_toy_mean")
    assert {"skin_toy", "left_toy"} < set(all_names())
    assert len(expand(["moments"])) == 30  # it names its members
    assert unit(feature("skin_toy_rate"), SKINS[2]) == "newton/taxel/s"
    model = measuring(SKINS[2], (*names, "skin_width"))
    recordings = recordings_for(SKINS[2], 2, np.random.default_rng(1))
    assert_same_vectors(model, recordings, tmp_path, monkeypatch)


@needs_gcc
@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no C++ compiler")
def test_the_sketch_suits_the_headers_with_a_model_and_without(tmp_path, monkeypatch):
    """Checked against the declarations of Arduino's core."""
    model = Model(demo.MODEL)
    skin = skinfile.load(skinfile.shipped("electrodes"))
    model.info = replace(model.info, layout=SkinLayout(*skin.layout.shape))
    monkeypatch.setattr(c_code, "Formula", NoFormula)
    for name in ("Wire.h", "EEPROM.h"):
        shutil.copy(ROOT / "tests" / "arduino.h", tmp_path / name)
    skin_code.export(skin, tmp_path)
    sketch = ROOT / "docs" / "examples" / "firmware" / "decide" / "decide.ino"
    command = [
        "g++",
        "-std=c++11",
        "-Wall",
        "-Werror",
        "-fsyntax-only",
        f"-I{tmp_path}",
        "-xc++",
    ]
    for write in (lambda: None, lambda: c_code.export(model, tmp_path)):
        write()
        compiled = ended(*command, sketch)
        assert compiled.returncode == 0, compiled.stderr


RATES = (50, 100, 125, 200, 500, 1000)


@pytest.mark.slow
@needs_gcc
def test_a_stream_of_any_rate_has_the_same_events(early, tmp_path):
    """At once, and with few slices of work after each frame, so that a contact begins
    while the last is being decided; smoothly, and in bursts."""
    model, _ = early
    error = max(s.rules[-1].error for s in model.info.stopping.values())
    streams = []
    for rate in RATES:
        parts = [
            touch(seed=i, seconds=seconds, rate=float(rate))
            for i, seconds in enumerate((0.7, 0.7, 1.6))
        ]
        stream = in_a_row(*parts, rest=round(0.4 * rate))
        stream = replace(stream, t=np.arange(len(stream.t)) / rate)
        bursts = np.floor(stream.t * 12.0) / 12.0 + stream.t * 1e-3
        streams += [stream, replace(stream, t=bursts)]
    for error_rate in (None, error):
        c_code.export(model, tmp_path, error_rate)
        command = machine.compiled(tmp_path)
        for slices in (0, 1, 40):
            assert_same_events(model, tmp_path, command, streams, error_rate, slices)
    kinds = {kind for s in streams for kind in machine.events(model, s)[:, 0].tolist()}
    assert kinds == {0.0, 1.0, 2.0}


EVERY = 24
"""Of the 856 real grasps one of so many is fitted; all are decided."""


@pytest.mark.slow
@needs_gcc
def test_real_grasps_have_the_same_events(real, tmp_path):
    grasps = [sdh2.grasp(file) for file in sdh2.files(real / "sdh2_grasps")]
    for i, grasp in enumerate(grasps[::EVERY]):
        labels = {"object": f"{i % 4}"}
        trained = replace(grasp, meta={**grasp.meta, "labels": labels})
        save(tmp_path / "data" / f"{i:03d}.npz", trained)
    words = ["--features", "contact", "moments", "--quick", "--window", "1.2"]
    out = export(tmp_path / "out", "--data", tmp_path / "data", *words)
    model = Model(out / "model.onnx")
    c_code.export(model, tmp_path / "c")
    command = machine.compiled(tmp_path / "c")
    assert_same_events(model, tmp_path / "c", command, grasps)


@pytest.mark.slow
@needs_gcc
def test_a_frame_that_cannot_be_taken_in_is_an_error(tmp_path):
    c_code.export(Model(demo.MODEL), tmp_path)
    command = machine.compiled(tmp_path)
    recording = touch()
    t = recording.t
    joints = recording.joints
    for changed, error in (
        (replace(recording, t=np.where(t == t[5], -1.0, t)), "error -2"),
        (replace(recording, t=np.where(t == t[5], np.nan, t)), "error -2"),
        (
            replace(recording, joints=np.where(t[:, None] == t[5], 2e6, joints)),
            "error -3",
        ),
    ):
        question = machine.about_recording(machine.EVENTS_OF_RECORDING, changed)
        with pytest.raises(RuntimeError, match=error):
            machine.ask(command, tmp_path, [question])


@needs_gcc
def test_options_that_change_bits_do_not_compile(tmp_path):
    c_code.export(Model(demo.MODEL), tmp_path)
    options = "-ffast-math -funsafe-math-optimizations -ffinite-math-only -mfma"
    for option in options.split():
        words = ["gcc", option, "-c", "formula.c", "-o", "formula.o"]
        ended = subprocess.run(words, cwd=tmp_path, capture_output=True, check=False)
        assert b"#error" in ended.stderr


@needs_gcc
@pytest.mark.skipif(
    " fma " not in Path("/proc/cpuinfo").read_text(),
    reason="this machine fuses nothing",
)
@pytest.mark.parametrize("contract", ["off", "fast"])
def test_the_selftest_tells_fused_instructions(tmp_path, contract):
    c_code.export(Model(demo.MODEL), tmp_path)
    options = f"-mfma -ffp-contract={contract} -DEC_NO_CONTRACTION".split()
    command = machine.compiled(tmp_path, options=options)
    passed = machine.ask(command, tmp_path, [machine.ABOUT_ITSELF])
    assert passed.tolist() == [contract == "off"]


@pytest.mark.slow
@needs_qemu
@pytest.mark.parametrize(("board", "index"), [("M4F", 0), ("M0+", 1)])
def test_the_cost_that_export_prints_is_what_qemu_counts(early, tmp_path, board, index):
    for model, recording in (
        (early[0], early[1][0]),
        (Model(demo.MODEL), load(demo.FOLDER / "pillow-movable.npz")),
    ):
        source = c_code.Source(model)
        source.write(tmp_path)
        costs = source.costs
        command = [*machine.compiled(tmp_path, board), "-icount", "shift=0"]
        question = machine.about_recording(machine.COSTS, recording)
        peaks = recording.frames.max((1, 2), keepdims=True)
        wide = replace(recording, frames=peaks.repeat(16, 1).repeat(24, 2))
        questions = [question, machine.about_recording(machine.COSTS, wide)]
        costs_of = machine.ask(command, tmp_path, questions).reshape(2, 4)
        (_, _, slice_, decision), (frame, *_) = costs_of
        assert costs.decision[index] == pytest.approx(decision, rel=0.1)
        assert costs.frame[index] == pytest.approx(frame, rel=0.1)
        assert slice_ < SLICE[index]


def test_what_c_lacks_is_one_sentence(tmp_path):
    model = Model(demo.MODEL)
    info = model.info
    for change, sentence in (
        ({"layout": replace(info.layout, axes=3)}, "it takes no shear"),
        ({"onset": "event"}, "by the skin alone"),
        ({"layout": replace(info.layout, rows=200)}, "the sums of 200 x 24 taxels"),
        ({"features": ("max_force_mean@200",)}, "more than 128 samples"),
    ):
        model.info = replace(info, **change)
        with pytest.raises(InputError, match=f"written in C, as .*{sentence}"):
            c_code.export(model, tmp_path)


@pytest.mark.slow
@needs_gcc
def test_what_does_not_fit_the_flash_is_left_out_and_said(early, tmp_path, monkeypatch):
    model, touches = early
    error = model.info.stopping["object"].rules[-1].error
    sizes = [
        c_code.Source(model, *options).costs.flash // 1024
        for options in ((error,), (None,), (None, False))
    ]
    early_out = "; early decisions are left out to fit --flash"
    no_outlier_score = (
        "; the outlier score is left out to fit --flash: nothing is unusual or unknown"
    )
    for error_rate, flash_kb, said in (
        (error, sizes[0] + 1, " Hz)"),
        (error, sizes[0], f" Hz){early_out}"),
        (None, sizes[1], f" Hz){no_outlier_score}"),
        (error, sizes[1], f" Hz){early_out}{no_outlier_score}"),
    ):
        text = c_code.export(model, tmp_path, error_rate, flash_kb)
        assert text.split(", and confidence")[0].endswith(said)
    with pytest.raises(InputError, match="kB of flash in C, above --flash"):
        c_code.export(model, tmp_path / "none", error, sizes[2])
    assert not (tmp_path / "none").exists()
    info = model.info
    never = (np.inf,) * len(model.decision_points_s)
    stopping = {k: replace(v, known_distance=None) for k, v in info.stopping.items()}
    outlier_score = OutlierLimits(never, never)
    monkeypatch.setattr(
        model, "info", replace(info, outlier_score=outlier_score, stopping=stopping)
    )
    assert_same_events(model, tmp_path, machine.compiled(tmp_path), touches)


def test_what_cannot_be_written_is_one_sentence_and_leaves_no_file(tmp_path):
    model = Model(demo.MODEL)
    folder = tmp_path / "c"
    folder.touch()
    with pytest.raises(InputError, match="c: cannot be written: it is no folder"):
        c_code.export(model, folder)
    folder.unlink()
    (folder / "main.c").mkdir(parents=True)
    with pytest.raises(InputError, match="main.c: cannot be written"):
        c_code.export(model, folder)
    assert [path.name for path in folder.iterdir()] == ["main.c"]


def test_every_float_has_a_literal():
    values = [np.inf, -np.inf, np.nan, np.float32(0.5)]
    assert [literal(value) for value in values] == [
        "(double)INFINITY",
        "-(double)INFINITY",
        "(double)NAN",
        "0x1.0000000000000p-1",
    ]
