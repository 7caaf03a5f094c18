"""The report: one page that needs no other file, its tables as CSV, its plots as
PNG."""

import io
import re

from matplotlib.figure import Figure as MatplotlibFigure

from tests import browser
from train.report.page import file_name, page, table_csv, write
from train.report.section import Figure, ReportTable, Section

WIDE = ReportTable(
    "wide",
    "Many columns and rows",
    [{f"a longer heading {i}": f"cell {i} with several words" for i in range(20)}] * 40,
)

HOSTILE = '<script>alert("1 & 2")</script>'


def table(**more):
    rows = [
        {"case": "a,b", "n": 1, "seconds": 0.5},
        {"case": HOSTILE, "n": 2, "seconds": 0.25},
    ]
    return ReportTable("speed", "How fast", rows, **more)


def test_text_from_elsewhere_is_escaped():
    text = page(HOSTILE, [HOSTILE], [Section(HOSTILE, [HOSTILE], [table()])])
    assert "<script>" not in text
    assert text.count("&lt;script&gt;") == 6  # title twice, lead, heading, text, cell


def test_two_tasks_never_share_a_file():
    names = {file_name(f"confusion_{task}", ".png") for task in ("a b", "a_b", "a/b")}
    assert names == {
        "confusion_a_20b.png",
        "confusion_a_b.png",
        "confusion_a_2fb.png",
    }


def test_timings_are_in_a_file_of_their_own():
    files = table_csv(table(timed=("seconds",)))
    assert sorted(files) == ["speed.csv", "speed_timings.csv"]
    assert "seconds" not in files["speed.csv"]
    assert files["speed_timings.csv"].splitlines()[0] == "case,seconds"


def test_the_page_holds_its_pictures_and_no_table_without_rows(tmp_path):
    tables = [table(), ReportTable("empty", "Nothing", [])]
    figures = [Figure("plot", "A plot", b"\x89PNG")]
    section = Section("One", figures=figures, tables=tables)
    text = write(tmp_path, "Title", [], [section]).read_text()
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"plot.png", "report.html", "speed.csv"}
    assert 'src="data:image/png;base64,iVBORw=="' in text
    assert "http" not in text
    assert "Nothing" not in text


def test_a_long_table_is_folded():
    text = page("Title", [], [Section("One", tables=[WIDE])])
    assert "<details><summary>40 rows</summary>" in text


def test_the_first_section_is_open_and_the_others_are_folded():
    text = page("Title", [], [Section("One"), Section("Two", ["below"])])
    assert re.search("One.*<details.*Two.*below", text, re.S)
    assert text.count("<details") == 1


def test_words_are_explained_and_code_is_set_as_code():
    text = page("Title", ["take `make <x>`"], [Section("Words", terms={"k": "a & b"})])
    assert "<code>make &lt;x&gt;</code>" in text
    assert "<dt>k</dt><dd>a &amp; b</dd>" in text


def test_in_a_browser_nothing_overflows_and_no_link_leads_nowhere(tmp_path):
    stream = io.BytesIO()
    MatplotlibFigure(figsize=(16, 2)).savefig(stream, format="png")
    pictures = [Figure("plot", "A plot", stream.getvalue())]
    sections = [Section("One", ["x" * 300], [WIDE, table()], pictures)]
    assert browser.faults(write(tmp_path, "Title", [], sections)) == []
