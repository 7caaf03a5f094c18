"""A hook of MkDocs: pages include measured tables, folded; the style sheet gets colours of code;
and what scrolls is within reach of the keyboard."""

import re
import textwrap
from pathlib import Path
from typing import Any

from pygments.formatters import HtmlFormatter

TABLE = re.compile(r"^\[([^\]]*)\]\((measured/[\w-]+\.md)\)$", re.M)
"""A line that is nothing but a link to a measured table."""


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Put each measured table in the place of the line that links to it."""
    folder = Path(config["docs_dir"])

    def text_of(link: re.Match[str]) -> str:
        text = (folder / link[2]).read_text(encoding="utf-8").strip()
        return f'??? abstract "{link[1]}"\n\n{textwrap.indent(text, "    ")}'

    return TABLE.sub(text_of, markdown)


def on_post_page(output: str, **_: Any) -> str:
    """Let the keyboard reach what may scroll, and call the bar what it is."""
    bar = '<div role="navigation" aria-label="pages" class="navbar '
    output = output.replace('<div class="navbar ', bar)
    return re.sub(r"<(pre|table)\b", r'<\1 tabindex="0"', output)


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
