"""The report: one HTML file that needs no other, with every table as CSV and plot as PNG."""

from __future__ import annotations

import base64
import csv
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from edge.files import write_whole
from train.report.tables import Section, Table

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1b2430; margin: 0 auto; max-width: 62rem;
  padding: 1.5rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.6rem;
  border-bottom: 1px solid #cfd6df; } h3 { font-size: 1rem; margin: 1.4rem 0 .3rem; }
p { max-width: 46rem; } nav li { line-height: 1.4; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
.scroll { overflow: auto; max-height: 34rem; }
th { position: sticky; top: 0; background: #eef2f6; text-align: left; }
th, td { padding: .18rem .6rem; border-bottom: 1px solid #e3e8ee; white-space: nowrap; }
td.number { text-align: right; } tr.no td { background: #fdf0ec; }
"""


KEYS = 4
"""First columns that are repeated beside timings, to tell the rows apart."""


def table_csv(table: Table) -> dict[str, str]:
    """{file name: CSV text} of the table, what a clock measured in a file of its own."""
    timed = {table.columns.index(column) for column in table.timed}
    every = range(len(table.columns))
    files = {f"{table.name}.csv": [i for i in every if i not in timed]}
    if timed:
        files[f"{table.name}_timings.csv"] = [i for i in every if i in timed or i < KEYS]
    return {name: _csv(table, places) for name, places in files.items()}


def _csv(table: Table, places: Sequence[int]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([row[i] for i in places] for row in [table.columns, *table.rows])
    return text.getvalue()


def _cell(value: Any) -> str:
    number = isinstance(value, int | float)
    text = f"{value:.2f}" if isinstance(value, float) else str(value)
    return f'<td class="number">{text}</td>' if number else f"<td>{html.escape(text)}</td>"


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(column)}</th>" for column in table.columns)
    rows = "\n".join(
        f'<tr class="{"no" if row[-1] == "no" else ""}">{"".join(map(_cell, row))}</tr>'
        for row in table.rows
    )
    return (
        f"<h3>{html.escape(table.title)}</h3>\n"
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table>'
        f"</div><p>{' '.join(f'<small>{name}</small>' for name in table_csv(table))}</p>"
    )


def page(title: str, lead: Sequence[str], sections: Sequence[Section]) -> str:
    """The whole report as HTML; images are in it."""
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head><body>",
        f"<h1>{html.escape(title)}</h1>",
        *(f"<p>{html.escape(text)}</p>" for text in lead),
        "<nav><ol>",
        *(
            f'<li><a href="#s{i}">{html.escape(section.title)}</a></li>'
            for i, section in enumerate(sections)
        ),
        "</ol></nav>",
    ]
    for i, section in enumerate(sections):
        parts.append(f'<h2 id="s{i}">{html.escape(section.title)}</h2>')
        parts += [f"<p>{html.escape(text)}</p>" for text in section.text]
        for figure in section.figures:
            data = base64.b64encode(figure.png).decode()
            parts.append(
                f'<figure><img alt="{html.escape(figure.title)}" '
                f'src="data:image/png;base64,{data}"></figure>'
            )
        parts += [_table(table) for table in section.tables]
    return "\n".join([*parts, "</body></html>\n"])


def write(out: Path, title: str, lead: Sequence[str], sections: Sequence[Section]) -> Path:
    """Write report.html, PNGs and CSVs into a folder, each whole or not at all."""
    files: dict[str, bytes] = {}
    for section in sections:
        files |= {f"{figure.name}.png": figure.png for figure in section.figures}
        for table in section.tables:
            files |= {name: text.encode() for name, text in table_csv(table).items()}
    files["report.html"] = page(title, lead, sections).encode()
    for name, data in files.items():
        with write_whole(out / name) as file:
            file.write(data)
    return out / "report.html"
