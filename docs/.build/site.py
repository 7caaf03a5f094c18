"""A hook of MkDocs: pages include measured tables, and the style sheet gets colours of code."""

import re
from pathlib import Path
from typing import Any

from pygments.formatters import HtmlFormatter

TABLE = re.compile(r"^\[[^\]]*\]\((measured/[\w-]+\.md)\)$", re.M)
"""A line that is nothing but a link to a measured table."""


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Put each measured table in the place of the line that links to it."""
    folder = Path(config["docs_dir"])

    def text_of(link: re.Match[str]) -> str:
        return (folder / link[1]).read_text(encoding="utf-8").strip()

    return TABLE.sub(text_of, markdown)


def on_post_build(config: Any, **_: Any) -> None:
    """Add the colours of code, for a light and a dark page, to the site's style sheet.

    The theme's script would switch the style sheets of highlight.js, which is off.
    """
    script = Path(config["site_dir"]) / "js" / "darkmode.js"
    lines = script.read_text(encoding="utf-8").splitlines(keepends=True)
    script.write_text("".join(line for line in lines if ".disabled" not in line))
    light = HtmlFormatter(style="default").get_style_defs(".highlight")
    dark = HtmlFormatter(style="github-dark").get_style_defs(
        "[data-bs-theme=dark] .highlight"
    )
    with (Path(config["site_dir"]) / "style.css").open("a", encoding="utf-8") as sheet:
        sheet.write(f"{light}\n{dark}\n")
