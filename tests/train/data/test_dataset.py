"""Data sets: one skin, one arm, one threshold, the edge's own features."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.recording import load
from edge.record.saving import save
from edge.touch.arm import Chain
from tests.conftest import in_a_row
from tests.edge.record.test_recording import sheared as with_shear
from train.data.dataset import Measurement, load_trials, read


@pytest.fixture
def folder(recordings, tmp_path):
    """Four of the recordings, for a test to add to."""
    for name in ("hard_0", "hard_3", "soft_0", "soft_1"):
        save(tmp_path / "data" / f"{name}.npz", load(recordings / f"{name}.npz"))
    return tmp_path / "data"


def test_trials_and_tasks_of_a_folder(recordings):
    data = load_trials([recordings])
    assert len(data.trials) == 16
    assert data.tasks == ("category", "object")
    assert data.features().shape == (16, 120)
    assert set(data.labels("object")) == {"hard 0", "hard 1", "soft 0", "soft 1"}
    assert data.chain.dof == 5
    assert data.units["contact_motion"] == "metre"


def test_several_processes_follow_the_contacts_as_one_does(recordings, folder):
    alone, shared = (load_trials([recordings], jobs=jobs) for jobs in (1, 2))
    assert [t.path for t in shared.trials] == [t.path for t in alone.trials]
    assert shared.features().tobytes() == alone.features().tobytes()
    touch = load(folder / "soft_1.npz")
    touch.meta["contacts"] = [{}, {}]
    save(folder / "soft_9.npz", touch)
    with pytest.raises(
        InputError, match=r"soft_9.npz: meta.contacts labels 2 contacts, 1 "
    ):
        load_trials([folder], jobs=2)


@pytest.fixture(scope="module")
def sheared(recordings, tmp_path_factory):
    """The recordings of a skin of three axes, whose shear is part of their counts."""
    folder = tmp_path_factory.mktemp("sheared")
    for path in recordings.glob("*.npz"):
        save(folder / path.name, with_shear(load(path)))
    return folder


def test_features_of_shear_are_measured_where_recordings_have_it(sheared):
    names = ["max_force", "contact_shear_ratio"]
    data = load_trials([sheared], Measurement(names))
    assert data.layout.axes == 3
    assert data.features(0.5, 5).shape == (16, 10)
    assert data.of(["max_force"]).layout.axes is None
    assert load_trials([sheared]).layout.axes is None


def test_recordings_without_shear_are_left_out_and_named(sheared, recordings, tmp_path):
    shutil.copytree(sheared, tmp_path / "data")
    shutil.copy(recordings / "hard_0.npz", tmp_path / "data" / "plain.npz")
    data = load_trials([tmp_path / "data"], Measurement(["skin_shear_size"]))
    assert [path.name for path in data.left_out["shear"]] == ["plain.npz"]
    assert len(data.trials) == 16
    with pytest.raises(InputError, match="no recording has shear"):
        load_trials([recordings], Measurement(["skin_shear_size"]))


def test_the_digest_follows_the_data(folder, tmp_path):
    before = load_trials([folder]).digest
    shutil.copytree(folder, tmp_path / "copy")
    assert load_trials([tmp_path / "copy"]).digest == before
    save(folder / "hard_0.npz", load(folder / "hard_3.npz"))
    assert load_trials([folder]).digest != before


def test_one_threshold_for_all(folder):
    low = load_trials([folder])
    high = load_trials([folder], Measurement(threshold=400))
    assert high.layout.threshold_counts == 400
    assert high.layout.onset_counts == 600
    area = slice(40, 80)
    assert high.features()[:, area].sum() < low.features()[:, area].sum()
    higher = load_trials([folder], Measurement(threshold=400, onset=500))
    assert higher.layout.onset_counts == 500


def test_recordings_that_are_never_touched_are_left_out_and_named(folder, make_touch):
    save(folder / "quiet.npz", make_touch(seconds=0.0))
    data = load_trials([folder])
    assert [path.name for path, _ in data.untouched] == ["quiet.npz"]
    assert len(data.trials) == 4


def test_a_taxel_is_dead_that_no_frame_of_any_recording_could_read(
    make_touch, tmp_path
):
    touch = make_touch()
    valid = np.ones((16, 24), dtype=bool)
    valid[0, :3] = False
    by_frame = np.tile(valid, (len(touch.t), 1, 1))
    by_frame[5, 0, 1] = True
    for name, mask, dead in (
        ("a", valid, (0, 1, 2)),
        ("b", by_frame, (0, 2)),
        ("c", None, ()),
    ):
        save(tmp_path / f"{name}.npz", replace(touch, valid=mask))
        assert load_trials([tmp_path]).layout.dead == dead


def test_a_dead_taxel_that_the_skin_does_not_have_is_refused(folder):
    with pytest.raises(InputError, match="--dead 16,0 lies outside .* 16 x 24"):
        load_trials([folder], Measurement(dead=[(15, 23), (16, 0)]))


def test_the_few_that_lack_joint_angles_do_not_take_them_from_the_others(
    folder, make_touch
):
    save(folder / "bare.npz", make_touch(arm=False))
    data = load_trials([folder])
    assert data.chain is not None
    assert [path.name for path in data.left_out["joint angles"]] == ["bare.npz"]
    assert len(data.trials) == 4
    assert load_trials([folder], Measurement(["max_force"])).left_out == {}


def test_where_most_lack_joint_angles_motion_is_on_the_skin(make_touch, tmp_path):
    for i in range(3):
        save(tmp_path / f"{i}.npz", make_touch(seed=i, arm=i == 0))
    data = load_trials([tmp_path])
    assert data.chain is None
    assert len(data.trials) == 3
    assert data.left_out == {}


@pytest.fixture
def two(make_touch):
    """Two contacts, half a second apart."""
    touch = make_touch(seconds=0.6)
    return in_a_row(touch, touch)


def described(recording, **meta):
    return replace(recording, meta={**recording.meta, **meta})


def test_of_several_contacts_the_first_is_used_unless_the_labels_say_more(
    two, tmp_path
):
    save(tmp_path / "two.npz", two)
    data = load_trials([tmp_path])
    assert len(data.trials) == 1
    assert [path.name for path in data.unused] == ["two.npz"]
    save(tmp_path / "two.npz", described(two, contacts="alike"))
    data = load_trials([tmp_path])
    assert len(data.trials) == 2
    assert data.unused == ()
    assert data.trials[1].onset_s == data.trials[0].onset_s + 1.3
    assert data.trials[1].labels == data.trials[0].labels
    save(
        tmp_path / "two.npz",
        described(two, contacts=[{"object": "one"}, {"object": "other"}]),
    )
    assert load_trials([tmp_path]).labels("object").tolist() == ["one", "other"]


@pytest.mark.parametrize(
    ("contacts", "word"),
    [
        ([{"object": "one"}], "labels 1 contacts, 2 are found"),
        ("both", 'must be "alike" or a list'),
        ([{"object": None}, {}], "must map task names to labels, both text"),
    ],
)
def test_labels_of_contacts_that_do_not_fit_are_one_sentence(
    contacts,
    word,
    two,
    tmp_path,
):
    save(tmp_path / "two.npz", described(two, contacts=contacts))
    with pytest.raises(InputError, match=f"two.npz: .*meta.contacts .*{word}"):
        load_trials([tmp_path])


def skinned(recording, **skin):
    return described(recording, skin={**recording.meta["skin"], **skin})


def with_angles(recording, count):
    return replace(recording, joints=np.zeros((len(recording.t), count)))


ONE_JOINT = {"joint": [{"axis": [0, 0, 1]}]}


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (
            lambda r: skinned(r, wraps=False),
            "odd.npz: this skin has 16 x 24 taxels, flat",
        ),
        (lambda r: with_angles(r, 3), "odd.npz: has 3 joint angles and names no arm"),
        (lambda r: described(with_angles(r, 1), arm=ONE_JOINT), "is not that of"),
        (
            lambda r: described(r, arm=ONE_JOINT),
            "odd.npz: has 5 joint angles, its arm takes 1",
        ),
    ],
)
def test_recordings_that_do_not_belong_together_are_refused(
    change,
    word,
    folder,
    make_touch,
):
    save(folder / "odd.npz", change(make_touch()))
    with pytest.raises(InputError, match=word):
        load_trials([folder])


def test_a_threshold_that_no_contact_reaches_is_said(recordings):
    with pytest.raises(InputError, match="no contact in any of 16 recordings"):
        load_trials([recordings], Measurement(threshold=60000))


def test_angles_are_measured_by_the_names_of_their_joints(
    recordings,
    make_touch,
    tmp_path,
):
    """A recording whose columns are reversed, with a wheel between them, has the same
    features."""
    arm = Chain.cody()
    trial = make_touch()
    save(tmp_path / "a" / "one.npz", trial)
    names = list(arm.names)[::-1]
    shuffled = np.insert(trial.joints[:, ::-1], 2, 7.0, axis=1)
    meta = {**trial.meta, "joint_names": [*names[:2], "wheel", *names[2:]]}
    save(tmp_path / "b" / "one.npz", replace(trial, joints=shuffled, meta=meta))
    straight = load_trials([tmp_path / "a"])
    reordered = load_trials([tmp_path / "b"], Measurement(arm=arm))
    np.testing.assert_array_equal(reordered.features(), straight.features())


def test_a_damaged_file_is_refused_or_named_and_left_out(folder):
    (folder / "soft_2.npz").write_bytes(b"PK")
    with pytest.raises(InputError, match=r"soft_2.npz: "):
        read([folder])
    data = read([folder], skip_damaged=True)
    assert len(data.paths) == len(data.recordings) == 4
    (sentence,) = data.damaged
    assert sentence.startswith(f"{folder / 'soft_2.npz'}: ")
    assert data.digest != read([folder / "soft_0.npz"]).digest
    with pytest.raises(InputError, match="no recording can be used"):
        read([folder / "soft_2.npz"], skip_damaged=True)


def test_features_are_measured_once_and_those_of_other_trials_anew(recordings):
    data = load_trials([recordings], Measurement(["max_force", "contact_area"]))
    X = data.features(0.5, 5)
    count = len(data.scratch.tables)
    assert data.of(["contact_area"]).features(0.5, 5).tolist() == X[:, 5:].tolist()
    assert len(data.scratch.tables) == count
    some = data.part(np.array([3, 1]))
    assert some.features(0.5, 5).tolist() == X[[3, 1]].tolist()
    assert data.at_points((0.5, 0.7), 5)[0].tolist() == X.tolist()
