"""The report as one HTML file, with each table as CSV and each plot as PNG beside
it."""

import base64
import re
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup, escape

from edge.writing import write_whole
from train.report.section import ReportTable, Section

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")
CODE = re.compile(r"`([^`]+)`")


def table_csv(table: ReportTable) -> dict[str, str]:
    """{file name: CSV text} of the table; columns measured by a clock have a file of
    their own."""
    frame = table.frame
    timed = list(table.timed)
    files = {"": frame.drop(columns=timed)}
    if timed:
        files["_timings"] = frame[[frame.columns[0], *timed]]
    return {
        file_name(table.name, f"{suffix}.csv"): part.to_csv(
            index=False, lineterminator="\n"
        )
        for suffix, part in files.items()
    }


def file_name(name: str, suffix: str) -> str:
    """A file's name from that of a table or figure, which may hold a task's name: other
    signs are told by their numbers, so that two tasks never share a file."""
    return re.sub(r"[^\w.-]", lambda sign: f"_{ord(sign[0]):x}", name) + suffix


def _prose(text: object) -> Markup:
    """The text as HTML; words between backquotes become code."""
    return Markup(CODE.sub(r"<code>\1</code>", str(escape(text))))


def _cells(table: ReportTable) -> Markup:
    """The table as HTML."""
    with pd.option_context("display.max_colwidth", None):
        text = table.frame.to_html(
            index=False, border=0, justify="left", float_format="{:.2f}".format
        )
    return Markup(CODE.sub(r"<code>\1</code>", text))


def _png(data: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"


PAGES = Environment(
    loader=FileSystemLoader(Path(__file__).parent), autoescape=True, trim_blocks=True
)
PAGES.filters |= {"prose": _prose, "cells": _cells, "csv": table_csv, "png": _png}


def page(title: str, lead: Sequence[str], sections: Sequence[Section]) -> str:
    """The report as HTML; the first section is open, the others are folded."""
    return PAGES.get_template("page.html").render(
        title=title, lead=lead, sections=sections, style=Markup(STYLE)
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
        for table in section.tables:
            if table.rows:
                for name, text in table_csv(table).items():
                    files[name] = text.encode()
    files["report.html"] = page(title, lead, sections).encode()
    for name, data in files.items():
        with write_whole(out / name) as file:
            file.write(data)
    return out / "report.html"
