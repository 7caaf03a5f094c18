"""The report as one HTML file, with each table as CSV and each plot as PNG beside
it."""

import base64
import csv
import html
import io
import re
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from edge.writing import write_whole
from train.report.section import Figure, Section, Table

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")
LONGEST = 20
"""A table with more rows is folded."""
CODE = re.compile(r"`([^`]+)`")


def table_csv(table: Table) -> dict[str, str]:
    """{file name: CSV text} of the table; columns measured by a clock have a file of
    their own."""
    columns = table.columns
    files = {"": [c for c in columns if c not in table.timed]}
    if table.timed:
        files["_timings"] = [columns[0], *table.timed]
    texts = {}
    for suffix, names in files.items():
        text = io.StringIO()
        writer = csv.DictWriter(text, names, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(table.rows)
        texts[file_name(table.name, f"{suffix}.csv")] = text.getvalue()
    return texts


def file_name(name: str, suffix: str) -> str:
    """A file's name from that of a table or figure, which may hold a task's name: other
    signs are told by their numbers, so that two tasks never share a file."""
    return re.sub(r"[^\w.-]", lambda sign: f"_{ord(sign[0]):x}", name) + suffix


def _text(text: str) -> str:
    """The text as HTML; words between backquotes become code."""
    return CODE.sub(r"<code>\1</code>", html.escape(text, quote=False))


def _decimals(values: Sequence[Any]) -> int:
    """The number of decimals that a column needs, at most two."""
    texts = (f"{value:.2f}".rstrip("0") for value in values if isinstance(value, float))
    return max((len(text) - text.index(".") - 1 for text in texts), default=0)


def _cell(value: Any, more: bool, decimals: int) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    text = f"{value:.{decimals}f}" if isinstance(value, float) else str(value)
    kinds = " ".join(["number"] * number + ["more"] * more)
    style = f' class="{kinds}"' if kinds else ""
    return f"<td{style}>{_text(text)}</td>"


def _table(table: Table) -> str:
    head = "".join(
        f"<th{' class=more' if i >= table.narrow else ''}>{_text(column)}</th>"
        for i, column in enumerate(table.columns)
    )
    decimals = [_decimals(column) for column in zip(*table.cells, strict=True)]
    rows = "\n".join(
        f"<tr{' class=no' if row[-1] == 'no' else ''}>"
        + "".join(
            _cell(value, i >= table.narrow, decimals[i]) for i, value in enumerate(row)
        )
        + "</tr>"
        for row in table.cells
    )
    files = ", ".join(f'<a href="{name}">{name}</a>' for name in table_csv(table))
    body = f"<table><thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table>"
    name = html.escape(table.title)
    body = f'<div class="table" tabindex="0" role="region" aria-label="{name}">{body}</div>'
    if len(table.rows) > LONGEST:
        body = f"<details><summary>{len(table.rows)} rows</summary>\n{body}</details>"
    return f"<h3>{_text(table.title)}</h3>\n{body}<p><small>{files}</small></p>"


def _figure(figure: Figure) -> str:
    def source(png: bytes) -> str:
        return f"data:image/png;base64,{base64.b64encode(png).decode()}"

    narrow = f'<source media="(max-width: 700px)" srcset="{source(figure.narrow)}">'
    image = f'<img alt="{html.escape(figure.title)}" src="{source(figure.png)}">'
    caption = f"<figcaption>{_text(figure.title)}</figcaption>"
    return f"<figure>{caption}<picture>{narrow}{image}</picture></figure>"


def _section(section: Section, folded: bool) -> str:
    heading = f"<h2>{_text(section.title)}</h2>"
    terms = [
        f"<dt>{_text(a)}</dt><dd>{_text(b)}</dd>" for a, b in section.terms.items()
    ]
    body = [
        section.widget,
        *(f"<p>{_text(text)}</p>" for text in section.text),
        *map(_figure, section.figures),
        *(_table(table) for table in section.tables if table.rows),
        *(["<dl>", *terms, "</dl>"] if terms else []),
    ]
    if not folded:
        return "\n".join([heading, *body])
    head = f'<details class="section"><summary>{heading}</summary>'
    return "\n".join([head, *body, "</details>"])


def page(title: str, lead: Sequence[str], sections: Sequence[Section]) -> str:
    """The report as HTML; the first section is open, the others are folded."""
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>"
            "<body><main>",
            f"<h1>{_text(title)}</h1>",
            *(f"<p>{_text(text)}</p>" for text in lead),
            *(_section(section, i > 0) for i, section in enumerate(sections)),
            "</main></body></html>\n",
        ]
    )


def write(
    out: Path,
    title: str,
    lead: Sequence[str],
    sections: Sequence[Section],
) -> Path:
    """Write report.html, PNGs and CSVs into a folder, each whole or not at all.

    Args:
        out: the folder.
        title: of the page.
        lead: paragraphs below the title.
        sections: in their order.

    Returns:
        The path of report.html.
    """
    files: dict[str, bytes] = {}
    for section in sections:
        for figure in section.figures:
            files[file_name(figure.name, ".png")] = figure.png
        for table in filter(attrgetter("rows"), section.tables):
            for name, text in table_csv(table).items():
                files[name] = text.encode()
    files["report.html"] = page(title, lead, sections).encode()
    for name, data in files.items():
        with write_whole(out / name) as file:
            file.write(data)
    return out / "report.html"
