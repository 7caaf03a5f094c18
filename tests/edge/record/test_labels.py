"""A category is softness by mobility, and a table beside recordings has their labels."""

import pytest

from edge.errors import InputError
from edge.record.labels import CATEGORY, TABLE, Standing, plain, read_table

WHOLE = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}


def test_labels_follow_from_a_category_and_the_reverse():
    assert CATEGORY.completed({"category": "soft-fixed"}) == WHOLE
    assert CATEGORY.completed({"softness": "soft", "mobility": "fixed"}) == WHOLE


def test_labels_from_which_nothing_follows_are_left():
    for labels in ({"category": "none", "object": "cup"}, {"mobility": "fixed"}):
        assert CATEGORY.completed(labels) == labels
        assert CATEGORY.label(labels) is None


def test_a_label_that_a_person_gave_is_not_replaced():
    contradictory = {**WHOLE, "category": "rigid-fixed"}
    assert CATEGORY.completed(contradictory) == contradictory
    assert CATEGORY.label(contradictory) == "soft-fixed"
    assert CATEGORY.contradiction(contradictory).endswith("which say 'soft-fixed'")


@pytest.mark.parametrize("labels", [WHOLE, {"mobility": "fixed"}, {"category": "none"}])
def test_labels_that_agree_are_no_contradiction(labels):
    assert CATEGORY.contradiction(labels) == ""


def test_what_a_model_could_not_hold_is_read_without_it_and_said(caplog):
    labels = {"object ": "tin\u00a0can", "softness": "\u200dsoft"}
    assert plain(labels, "a.npz") == {"object": "tin_can", "softness": "_soft"}
    assert caplog.text.count("a.npz: the labels") == 1


def write_table(folder, text):
    (folder / TABLE).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


META = {"labels": {"object": "box", "softness": "hard"}}


def test_a_row_wins_over_a_recordings_own_labels_in_the_columns_of_the_table(tmp_path):
    table = read_table(
        write_table(tmp_path, "file,object,left_out\na.npz,cup,\nb.npz,,x\n")
    )
    assert table.standing("a.npz", META) == (
        {"object": "cup", "softness": "hard"},
        False,
    )
    assert table.standing("b.npz", META) == ({"softness": "hard"}, True)
    assert table.standing("c.npz", META) == Standing(META["labels"])
    assert read_table(tmp_path / "other").rows == {}


def test_what_is_left_out_is_said_in_the_words_of_spreadsheets(tmp_path):
    words = {"": 0, "no": 0, "False": 0, "0": 0, "Yes": 1, "TRUE": 1, "x": 1, "1": 1}
    lines = "".join(f"{number},{word}\n" for number, word in enumerate(words))
    rows = read_table(write_table(tmp_path, f"file,left_out\n{lines}")).rows
    assert [row.left_out for row in rows.values()] == list(words.values())


def test_empty_cells_at_the_ends_of_lines_are_no_columns(tmp_path):
    table = read_table(write_table(tmp_path, "file,\na.npz\n"))
    assert table.standing("a.npz", META) == Standing(META["labels"])


def test_a_spreadsheet_may_save_it_with_semicolons_and_a_mark(tmp_path):
    text = 'file;object;left_out;\r\na.npz;"Dose; groß";;\r\n;;;\r\nb.npz;x;WAHR;\r\n'
    with pytest.raises(InputError, match="line 4: left_out is yes or empty"):
        read_table(write_table(tmp_path, text.encode("utf-8-sig")))
    table = read_table(
        write_table(tmp_path, text.replace("WAHR", "TRUE").encode("utf-8-sig"))
    )
    assert table.standing("a.npz", {}) == Standing({"object": "Dose; groß"})
    again = read_table(
        write_table(tmp_path, table.encoded({"a.npz": Standing({"a": "1"})}))
    )
    assert again.delimiter == ";"
    assert again.standing("a.npz", {}) == Standing({"a": "1"})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "line 1: has no column file"),
        ("trial,object\na,cup\n", "line 1: has no column file"),
        ("file,object\na.npz,x\n\na.npz,y\n", "line 4: a.npz has line 2 too"),
        ("file,object,object\na.npz,x,y\n", "line 1: has the column 'object' twice"),
        ("file,Left out\na.npz,x\n", "line 1: the column 'Left out' is unknown"),
        ("file,object\na.npz,x,y\n", "line 2: has not the 2 cells"),
        ("file,object,\na.npz,x,y\n", "line 2: has not the 2 cells"),
        ("file,object\na.npz,x\nb.n", "line 3: has not the 2 cells"),
        ("file,object\n,x\n", "line 2: names no file"),
        ('file,object\na.npz,"x\n', "not a table of labels: unexpected end of data"),
        ("file,object\na.npz,\x1b[2J\n", "line 2: has a label that cannot be printed"),
        (b"file,object\na.npz,gro\xdf\n", "not UTF-8 text; save it as CSV in UTF-8"),
    ],
)
def test_a_damaged_table_is_refused_with_its_line(tmp_path, text, sentence):
    with pytest.raises(InputError, match=rf"{TABLE}.*{sentence}"):
        read_table(write_table(tmp_path, text))


def test_labels_of_contacts_are_not_overruled(tmp_path):
    table = read_table(write_table(tmp_path, "file,object,left_out\na.npz,cup,yes\n"))
    meta = {"labels": {"object": "cup"}, "contacts": [{"object": "box"}]}
    assert table.standing("a.npz", meta).left_out
    with pytest.raises(InputError, match="the contacts of a.npz have labels of"):
        table.standing("a.npz", {**meta, "labels": {}})


def test_a_task_takes_no_other_columns_name(tmp_path):
    with pytest.raises(InputError, match="a task cannot be called File"):
        read_table(tmp_path).encoded({"a.npz": Standing({"File": "x"})})
