"""Several contacts at once, each with its own decisions and its place; the map of
them."""

import json
import os
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from edge import demo
from edge.classifier import Classifier
from edge.errors import InputError
from edge.model.model import Model
from edge.output.event_writer import LineWriter
from edge.output.touch_map import map_writer
from edge.recording import load
from edge.saving import save
from edge.touch.arm import Chain
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import MAX_CONTACTS, ContactTracker
from tests.conftest import decided
from train.touch_map import TouchMap

MODEL = Model(demo.MODEL)
FLAT = SkinLayout(rows=6, cols=20, threshold_counts=10, onset_counts=20, release_s=0.05)


MERGED, PARTED = ".######", "##.###"
FLICKER = "/".join(["#." * 10, ".#" * 10] * 3)


@pytest.mark.parametrize(
    ("pictures", "areas", "ended"),
    [
        # Two regions are two contacts, also where the later one is larger.
        (
            ["##", "##", *["##....####"] * 2, "#.....####"],
            [[2, 2, 2, 2, 1], [4, 4, 4]],
            [0, 0],
        ),
        # A region that moves by its width goes on.
        (["#", "#", ".#", "..#", "..#"], [[1] * 5], [0]),
        # Where two grow into one, the older goes on and the other ends.
        (
            [".##", *[".##...##"] * 2, *[MERGED] * 5],
            [[2, 2, 2, 6, 6, 6, 6, 6], [2, 2, 0, 0, 0, 0, 0]],
            [0, 1],
        ),
        # Where one parts in two, the larger share goes on.
        (["######", "######", PARTED, PARTED], [[6, 6, 3, 3], [2, 2]], [0, 0]),
        # A region below the onset count begins nothing.
        (["++", "++", "++"], [], []),
        # A contact ends by itself while another goes on.
        (
            [*["#....##"] * 2, *[".....##"] * 5],
            [[2] * 7, [1, 1, 0, 0, 0, 0, 0]],
            [0, 1],
        ),
        # A skin that flickers has no more than so many contacts.
        ([FLICKER] * 3, [[1] * 3] * MAX_CONTACTS, [0] * MAX_CONTACTS),
    ],
)
def test_each_region_is_a_contact_of_its_own(pictures, areas, ended):
    """Pictures are rows of taxels: '#' has 100 counts, '+' 15, '.' none."""
    tracks = ContactTracker(FLAT, max_contacts=MAX_CONTACTS)
    levels = {"#": 100, "+": 15, ".": 0}
    for i, picture in enumerate(pictures):
        counts = np.zeros(FLAT.shape, dtype=np.uint16)
        for r, row in enumerate(picture.split("/")):
            counts[r, : len(row)] = [levels[taxel] for taxel in row]
        contacts = list(tracks.push(Frame(i / 100, counts)))
    assert [contact.series().area.tolist() for contact in contacts] == areas
    assert [contact.ended for contact in contacts] == ended


def test_a_single_contact_is_followed_as_by_the_largest_region():
    """One code for onset, series and decision: the same events but for number and
    place."""
    for path in demo.recordings():
        recording = load(path)
        expected, events = (
            [event.to_dict() for event in classifier.classify(recording)]
            for classifier in (Classifier(MODEL), Classifier(MODEL, max_contacts=8))
        )
        number = decided(events, "contact")[0]
        mine = [e for e in events if e["contact"] == number]
        assert [strip(e) for e in mine] == [strip(e) for e in expected]


def strip(event):
    unequal = ("contact", "place", "latency_ms")
    return {key: value for key, value in event.items() if key not in unequal}


@pytest.fixture(scope="module")
def two_touches():
    """Two of the demo's touches on one skin, half a turn and 0.32 s apart."""
    a, b = (
        load(demo.FOLDER / f"cardboard-box-{how}.npz") for how in ("fixed", "movable")
    )
    late = 8  # at 25 Hz
    n = min(len(a.t), len(b.t)) + late
    frames = np.zeros((n, *a.frames.shape[1:]), dtype=np.uint16)
    frames[: len(a.t)] = np.where(a.frames > 60, a.frames, 0)[:n]
    frames[late : late + len(b.t)] += np.roll(
        np.where(b.frames > 60, b.frames, 0),
        12,
        2,
    )[: n - late]
    t = np.arange(n) / 25.0
    joints = np.concatenate([a.joints, np.repeat(a.joints[-1:], n, axis=0)])[:n]
    return replace(a, t=t, frames=frames, joints=joints, meta={**a.meta, "labels": {}})


def test_each_contact_is_decided_and_placed_on_its_own(two_touches, tmp_path, edge):
    save(tmp_path / "both.npz", two_touches)
    place = tmp_path / "touches.jsonl"
    options = ("--model", demo.MODEL, "--fake", tmp_path / "both.npz", "--map", place)
    status, lines, _ = edge("run", *options)
    assert status == 0
    assert len(set(decided(lines, "contact"))) == 2
    touch_map = TouchMap(place)
    assert touch_map.head[:2] == (MODEL.info.chain.base, "metre")
    first, second = touches = list(touch_map)
    assert first.labels == {
        "category": "rigid-fixed",
        "mobility": "fixed",
        "object": "cardboard box",
    }
    assert second.onset_s - first.onset_s == pytest.approx(
        0.36, abs=0.02
    )  # 0.04 their own
    for touch in touches:
        assert on_the_skin(touch.position, two_touches)
    # Opposite sides of the forearm.
    assert (
        np.linalg.norm(np.subtract(first.position, second.position))
        > two_touches.layout.radius_m
    )


def on_the_skin(place, recording):
    """Whether a place is on the cylinder in some frame, by the chain alone."""
    layout = recording.layout
    chain = Chain.cody()
    for q in recording.joints:
        pose = chain.pose(q)
        x, y, z = pose[:3, :3].T @ (np.array(place) - pose[:3, 3])
        if abs(np.hypot(x, y) - layout.radius_m) < 1e-5 and 0 < z < 0.2:
            return True
    return False


def test_a_place_is_the_centroid_turned_and_moved_by_the_arm():
    layout = replace(FLAT, pitch_m=0.01)
    chain = Chain.cody()
    joints = np.array([0.1, -0.2, 0.3, 0.4, -0.5])
    tracks = ContactTracker(layout, chain=chain, max_contacts=2)
    counts = np.zeros(FLAT.shape, dtype=np.uint16)
    counts[2, 3:5] = 100
    for i in range(2):
        (*_, contact) = [None, *tracks.push(Frame(i / 100, counts, joints=joints))]
    expected = (chain.pose(joints) @ [0.035, 0.02, 0.0, 1.0])[:3]
    assert contact.position() == pytest.approx(expected, abs=1e-15)


def write(path, info, events):
    writer = map_writer(path, info)
    for event in events:
        writer.put(event)
    writer.close()
    return writer


def test_runs_add_to_a_map_and_a_line_cut_short_is_left_out(tmp_path):
    path = tmp_path / "map.jsonl"
    info = MODEL.info
    event = {
        "event": "decision",
        "contact": 1,
        "onset_s": 0.5,
        "place": [0.1, 0.2, 0.3],
        "task": "mobility",
        "label": "fixed",
        "confidence": 0.5,
        "flags": ["tie"],
    }
    further = [{**event, "task": t, "label": t} for t in ("category", "object")]
    onset = {"event": "onset", "contact": 1, "onset_s": 0.5}
    write(path, info, [onset, event])
    assert not list(TouchMap(path))  # two tasks are still open
    path.unlink()
    write(path, info, [onset, event, *further, {**event, "contact": 2, "place": None}])
    with path.open("a") as damaged:
        damaged.write('{"event": "decision", "pla')
    write(path, info, [event, *further])
    first, second = TouchMap(path)
    assert first == second
    assert first.position == (0.1, 0.2, 0.3)
    assert first.labels == {
        "mobility": "fixed",
        "category": "category",
        "object": "object",
    }
    assert "\n\n" not in path.read_text()


ANOTHER = json.dumps({"event": "map", "frame": "another", "unit": "metre", "tasks": []})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("what I did today", "not a map"),
        (ANOTHER, "in the frame another .* keep a map for each"),
    ],
)
def test_a_file_that_is_no_map_of_this_arm_is_not_written_to(tmp_path, text, sentence):
    path = tmp_path / "notes.txt"
    path.write_text(text + "\n")
    with pytest.raises(InputError, match=sentence):
        map_writer(path, MODEL.info)
    assert path.read_text() == text + "\n"


@pytest.mark.parametrize(
    "beginning", ['{"ev', '{"event": "map", "fra', '{"event": "map", "fra\n']
)
def test_a_first_line_that_a_full_disk_cut_short_is_no_condition_for_a_start(
    tmp_path, beginning
):
    path = tmp_path / "map.jsonl"
    path.write_text(beginning)
    write(path, MODEL.info, [])
    assert list(TouchMap(path)) == []


def test_a_full_disk_costs_lines_and_not_decisions():
    """/dev/full answers each write as a full disk does; here it stands behind a map's
    writer."""
    with open("/dev/full", "wb", buffering=0) as full:
        writer = LineWriter("map", full.write)
        writer.put({})
        writer.put({})
        writer.close()
    assert writer.lost == 2
    assert writer.problem == "No space left on device"


def test_only_the_head_of_a_long_map_is_read_before_a_run(tmp_path):
    path = tmp_path / "map.jsonl"
    info = MODEL.info
    write(path, info, [])
    before = path.stat().st_size
    os.truncate(path, 1 << 31)  # takes no room
    tracemalloc.start()
    try:
        write(path, info, [])
        assert TouchMap(path).head.frame == info.chain.base
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()
    assert path.stat().st_size == (1 << 31) + 1 + before


def test_what_is_no_file_is_refused_as_a_map(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "fifo", tmp_path, "/dev/null", "a\0b"):
        with pytest.raises(InputError, match="cannot be (read|written)"):
            map_writer(path, MODEL.info)
