"""The report: one page that needs no other file, its tables as CSV, its plots as PNG."""

import csv
import io

from train.report.html import page, table_csv, write
from train.report.tables import Figure, Section, Table

HOSTILE = '<script>alert("1 & 2")</script>'


def table(**more):
    columns = ("case", "n", "seconds")
    return Table("speed", "How fast", columns, [("a,b", 1, 0.5), (HOSTILE, 2, 0.25)], **more)


def test_what_is_not_ours_is_escaped():
    text = page(HOSTILE, [HOSTILE], [Section(HOSTILE, [HOSTILE], [table()])])
    assert "<script>" not in text
    assert text.count("&lt;script&gt;") == 7  # title twice, lead, contents, heading, text, cell


def test_a_table_is_the_same_in_its_csv():
    ((name, text),) = table_csv(table()).items()
    assert name == "speed.csv"
    assert list(csv.reader(io.StringIO(text))) == [
        ["case", "n", "seconds"], ["a,b", "1", "0.5"], [HOSTILE, "2", "0.25"]
    ]  # fmt: skip


def test_what_a_clock_measured_stands_in_a_file_of_its_own():
    files = table_csv(table(timed=("seconds",)))
    assert sorted(files) == ["speed.csv", "speed_timings.csv"]
    assert "seconds" not in files["speed.csv"]
    assert files["speed_timings.csv"].splitlines()[0] == "case,n,seconds"


def test_the_page_holds_its_pictures(tmp_path):
    sections = [Section("One", figures=[Figure("plot", "A plot", b"\x89PNG")], tables=[table()])]
    report = write(tmp_path, "Title", [], sections)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["plot.png", "report.html", "speed.csv"]
    text = report.read_text()
    assert 'src="data:image/png;base64,iVBORw=="' in text
    assert "http" not in text
