"""Several contacts at once, each with its own decisions and its place; the map of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from edge import demo
from edge.classifier import Classifier
from edge.cli import main
from edge.errors import InputError
from edge.model.model import Model
from edge.recording import load, save
from edge.runtime import touch_map as touchmap
from edge.touch.arm import Chain
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import MAX_CONTACTS, ContactTracker

FLAT = SkinLayout(rows=6, cols=20, threshold_counts=10, onset_counts=20, release_s=0.05)


def follow(tracks, pictures, t=0.0):
    """Pushes pictures of text ('#' 100 counts, '+' 15, '.' none); contacts after each."""
    out = []
    for i, picture in enumerate(pictures):
        counts = np.zeros(FLAT.shape, dtype=np.uint16)
        for r, row in enumerate(picture.split("/")):
            for c, taxel in enumerate(row):
                counts[r, c] = {"#": 100, "+": 15}.get(taxel, 0)
        out.append(list(tracks.push(Frame(t + i / 100, counts))))
    return out


def every_region():
    return ContactTracker(FLAT, max_contacts=MAX_CONTACTS)


def areas(contact):
    return contact.series().area.tolist()


def test_two_regions_are_two_contacts_with_their_own_onsets():
    seen = follow(every_region(), ["##", "##", "##.....###", "##.....###", "#......###"])
    assert [len(contacts) for contacts in seen] == [0, 1, 1, 2, 2]
    first, second = seen[-1]
    assert (first.onset_s, second.onset_s) == (0.0, 0.02)
    assert areas(first) == [2, 2, 2, 2, 1]
    assert areas(second) == [3, 3, 3]


def test_the_larger_region_does_not_take_over_a_contact():
    """What following the largest region alone would do."""
    seen = follow(every_region(), ["##", "##", "##....####", "##....####"])
    assert areas(seen[-1][0]) == [2, 2, 2, 2]


def test_a_region_that_moves_by_its_width_goes_on():
    (contact,) = follow(every_region(), ["#", "#", ".#", "..#", "..#"])[-1]
    assert areas(contact) == [1] * 5


def test_where_two_grow_into_one_the_older_goes_on_and_the_other_ends():
    apart, one = ".##...##", ".######"
    seen = follow(every_region(), [".##", apart, apart, *[one] * 5])
    assert [c.ended for c in seen[-1]] == [False, True]
    assert areas(seen[-1][0]) == [2, 2, 2, 6, 6, 6, 6, 6]
    assert areas(seen[-1][1]) == [2, 2, 0, 0, 0, 0, 0]


def test_where_one_parts_in_two_the_larger_share_goes_on():
    seen = follow(every_region(), ["######", "######", "##.###", "##.###"])
    old, new = seen[-1]
    assert (areas(old), areas(new)) == ([6, 6, 3, 3], [2, 2])


def test_a_region_below_the_onset_count_begins_nothing():
    assert follow(every_region(), ["++", "++", "++"])[-1] == []


def test_a_contact_ends_by_itself_while_another_goes_on():
    seen = follow(every_region(), ["#....##"] * 2 + [".....##"] * 6)
    assert [len(contacts) for contacts in seen] == [0, 2, 2, 2, 2, 2, 2, 1]
    assert [contact.ended for contact in seen[6]] == [False, True]


def test_a_skin_that_flickers_has_no_more_than_so_many_contacts():
    board = "/".join(["#." * 10, ".#" * 10] * 3)
    assert len(follow(every_region(), [board] * 3)[-1]) == MAX_CONTACTS


def test_a_single_contact_is_followed_as_by_the_largest_region():
    """One code for onset, series and decision: the same events but for number and place."""
    model = Model(demo.MODEL)
    for path in demo.recordings():
        recording = load(path)
        alone, several = Classifier(model), Classifier(model, max_contacts=8)
        expected, seen = (
            [e.to_dict() for f in recording for e in w.push(f)] for w in (alone, several)
        )
        number = next(e["contact"] for e in seen if e["event"] == "decision")
        mine = [e for e in seen if e["contact"] == number]
        assert [strip(e) for e in mine] == [strip(e) for e in expected]


def strip(event):
    return {k: v for k, v in event.items() if k not in ("contact", "place", "latency_ms")}


@pytest.fixture(scope="module")
def both():
    """Two of the demo's touches on one skin, half a turn and 0.3 s apart."""
    a, b = (load(demo.FOLDER / f"cardboard-box-{how}.npz") for how in ("fixed", "movable"))
    late = 15  # at 50 Hz
    n = min(len(a.t), len(b.t)) + late
    frames = np.zeros((n, *a.frames.shape[1:]), dtype=np.uint16)
    frames[: len(a.t)] = np.where(a.frames > 60, a.frames, 0)[:n]
    frames[late : late + len(b.t)] += np.roll(np.where(b.frames > 60, b.frames, 0), 12, 2)[
        : n - late
    ]
    t = np.arange(n) / 50.0
    joints = np.concatenate([a.joints, np.repeat(a.joints[-1:], n, axis=0)])[:n]
    return replace(a, t=t, frames=frames, joints=joints, meta={**a.meta, "labels": {}})


def test_each_contact_is_decided_and_placed_on_its_own(both, tmp_path, capsys):
    save(tmp_path / "both.npz", both)
    place = tmp_path / "touches.jsonl"
    command = ["run", "--model", str(demo.MODEL), "--fake", str(tmp_path / "both.npz")]
    assert main([*command, "--map", str(place)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    decisions = [line for line in lines if line["event"] == "decision"]
    assert len({line["contact"] for line in decisions}) == 2
    found = touchmap.TouchMap(place)
    assert found.head[:2] == (Model(demo.MODEL).info.chain.base, "metre")
    first, second = touches = list(found)
    assert first.labels == {
        "category": "rigid-fixed",
        "mobility": "fixed",
        "object": "cardboard box",
    }
    assert second.onset_s - first.onset_s == pytest.approx(0.35, abs=0.02)  # 0.05 of it their own
    for touch in touches:
        assert on_the_skin(touch.position, both)
    # Opposite sides of the forearm.
    assert np.linalg.norm(np.subtract(first.position, second.position)) > both.layout.radius_m


def on_the_skin(place, recording):
    """Whether a place is on the cylinder in some frame, by the chain alone."""
    layout, chain = recording.layout, Chain.from_dict(recording.meta["arm"])
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
    writer = touchmap.map_writer(path, info)
    for event in events:
        writer.put(event)
    writer.close()
    return writer


def test_runs_add_to_a_map_and_a_line_cut_short_is_left_out(tmp_path):
    path = tmp_path / "map.jsonl"
    info = Model(demo.MODEL).info
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
    others = [{**event, "task": t, "label": t, "flags": ["short"]} for t in ("category", "object")]
    onset = {"event": "onset", "contact": 1, "onset_s": 0.5}
    write(path, info, [onset, event])
    assert not list(touchmap.TouchMap(path))  # two tasks are still open
    path.unlink()
    write(path, info, [onset, event, *others, {**event, "contact": 2, "place": None}])
    with path.open("a") as damaged:
        damaged.write('{"event": "decision", "pla')
    write(path, info, [event, *others])
    first, second = touchmap.TouchMap(path)
    assert first == second
    assert first.position == (0.1, 0.2, 0.3)
    assert first.labels == {"mobility": "fixed", "category": "category", "object": "object"}
    assert first.flags == ("tie", "short")
    assert "\n\n" not in path.read_text()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "not a map"),
        ("[1]\n", "not a map"),
        ("hello\n", "not a map"),
        ('{"event": "decision"}\n', "line 1 is not of a map"),
        ('{"event": "map", "frame": "a", "unit": "metre"}\n', "line 1 is not of a map"),
        (
            '{"event": "map", "frame": "a", "unit": "metre", "tasks": []}\n'
            '{"event": "map", "frame": "b", "unit": "metre", "tasks": []}\n',
            "line 2 begins a run in the frame b",
        ),
    ],
)
def test_what_is_not_a_map_is_named(tmp_path, text, sentence):
    path = tmp_path / "some.jsonl"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        list(touchmap.TouchMap(path))


ANOTHER = json.dumps({"event": "map", "frame": "another", "unit": "metre", "tasks": []})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("what I did today", "not a map"), (ANOTHER, "in the frame another .* keep a map for each")],
)
def test_a_file_that_is_no_map_of_this_arm_is_not_written_to(tmp_path, text, sentence):
    path = tmp_path / "notes.txt"
    path.write_text(text + "\n")
    with pytest.raises(InputError, match=sentence):
        touchmap.map_writer(path, Model(demo.MODEL).info)
    assert path.read_text() == text + "\n"


@pytest.mark.parametrize("left", ['{"ev', '{"event": "map", "fra', '{"event": "map", "fra\n'])
def test_a_first_line_that_a_full_disk_cut_short_is_no_condition_for_a_start(tmp_path, left):
    path = tmp_path / "map.jsonl"
    path.write_text(left)
    write(path, Model(demo.MODEL).info, [])
    assert list(touchmap.TouchMap(path)) == []


def test_a_full_disk_costs_lines_and_not_decisions():
    """/dev/full answers each write as a full disk does; here it stands behind a map's writer."""
    with open("/dev/full", "wb", buffering=0) as full:
        writer = touchmap.LineWriter("map", full.write)
        writer.put({})
        writer.put({})
        writer.close()
    assert (writer.lost, writer.problem) == (2, "No space left on device")


def test_what_is_no_file_is_refused_as_a_map(tmp_path):
    import os

    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "fifo", tmp_path, "/dev/null", "a\0b"):
        with pytest.raises(InputError, match="cannot be (read|written)"):
            touchmap.map_writer(path, Model(demo.MODEL).info)
