"""One recording a contact."""

from dataclasses import replace

from edge.recording import load
from edge.saving import save
from edge.touch.track import ContactTracker
from tests.conftest import in_a_row
from tests.edge.test_writing import left_by_a_dead_run
from train.__main__ import main
from train.data.contacts import contacts


def test_labels_for_too_many_contacts_stop_before_anything_is_written(
    make_touch,
    tmp_path,
    refusal,
):
    touch = make_touch(seconds=0.6)
    three = [{"object": "cup"}] * 3
    save(tmp_path / "a.npz", touch)
    save(tmp_path / "b.npz", replace(touch, meta={**touch.meta, "contacts": three}))
    message = refusal("split", tmp_path, "--out", tmp_path / "out")
    assert "b.npz: meta.contacts labels 3 contacts, 1 are found" in message
    assert not (tmp_path / "out").exists()


def test_recordings_of_one_name_do_not_overwrite_each_other(
    make_touch,
    tmp_path,
    refusal,
):
    for folder in ("monday", "tuesday"):
        save(tmp_path / folder / "a.npz", make_touch(seconds=0.6))
    message = refusal("split", tmp_path, "--out", tmp_path / "out")
    assert "a-00.npz is that of another recording too; rename one of them" in message
    assert not (tmp_path / "out").exists()


def test_each_contact_becomes_a_recording_with_its_own_labels(
    make_touch,
    tmp_path,
):
    two = in_a_row(*[make_touch(seconds=0.6)] * 2)
    labels = [{"object": "one"}, {"object": "other"}]
    save(
        tmp_path / "in" / "two.npz", replace(two, meta={**two.meta, "contacts": labels})
    )
    leftover = left_by_a_dead_run(tmp_path / "out")
    assert main(["split", str(tmp_path / "in"), "--out", str(tmp_path / "out")]) == 0
    assert not leftover.exists()
    unsplit = contacts(two, ContactTracker(two.layout))
    for i, label in enumerate(("one", "other")):
        trial = load(tmp_path / "out" / f"two-{i:02d}.npz")
        assert trial.labels["object"] == label
        assert trial.labels["category"] == two.labels["category"]
        (contact,) = contacts(trial, ContactTracker(trial.layout))
        assert contact[0] == unsplit[i][0]
        assert (contact[1].peak == unsplit[i][1].peak[: len(contact[1].peak)]).all()
        assert "contacts" not in trial.meta
