"""Parts of what notebooks show."""

from __future__ import annotations

from html import escape


def page(title: str, body: str) -> str:
    """Returns a body below its title, which may be empty."""
    return f"<p><b>{escape(title)}</b></p>\n{body}" if title else body


def preformatted(text: str) -> str:
    """Returns a text with its line breaks."""
    return f"<pre>{escape(text)}</pre>\n"


def picture(svg: str | None) -> str:
    """Returns a drawing that is not wider than the page; empty without one."""
    return "" if svg is None else svg.replace("<svg ", '<svg style="max-width:100%;height:auto" ', 1)
