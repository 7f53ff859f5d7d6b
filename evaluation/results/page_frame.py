"""The frame of all pages: one style, sections that unfold, sortable tables.

A page needs neither a network nor other files.
"""

from collections.abc import Callable, Iterable, Mapping
from importlib import resources
import json
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup

# Package and folder of the templates of all pages.
_FRAME = ("evaluation.results", "page_template")


class PageSection(NamedTuple):
    """A section of a page.

    Attributes:
        name: identifier of the section, to which links lead.
        word: name of the section among the links at the top.
        body: contents of the section as HTML.
        is_open: whether the section is shown from the start. Otherwise, the
            section unfolds when a reader clicks its name.
    """

    name: str
    word: str
    body: Markup
    is_open: bool = False


def framed_page(
    title: str,
    heading: str,
    intro: Markup,
    sections: Iterable[PageSection],
    *,
    made_by: Iterable[str] = (),
    notes: Iterable[str] = (),
    style: str = "",
    scripts: Iterable[str] = (),
    data: Mapping[str, Any] | None = None,
) -> str:
    """Returns a page as HTML.

    Args:
        title: title of the window.
        heading: heading of the page.
        intro: paragraphs below the heading, as HTML.
        sections: sections of the page, in order.
        made_by: what made the page, for the end of the page.
        notes: sentences on how the page was made, for the end of the page.
        style: further style sheet.
        scripts: further scripts. A script uses only the scripts before it.
        data: values for these scripts, as JSON in an element with the id
            `data`.
    """
    scripts = list(scripts)
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return (
        environment(*_FRAME)
        .get_template("frame.html")
        .render(
            title=title,
            heading=heading,
            intro=intro,
            sections=list(sections),
            made_by=list(made_by),
            notes=list(notes),
            style=Markup("\n").join([read_asset(*_FRAME, "frame.css"), style]),
            script=Markup("\n").join(
                [read_asset(*_FRAME, "tables.js"), *scripts]
            ),
            # JSON cannot end the script element around it.
            data=Markup(text.replace("<", "\\u003c")) if scripts else None,
        )
    )


def environment(
    package: str,
    folder: str,
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> jinja2.Environment:
    """Returns the environment of the templates in a folder of a package.

    HTML and SVG escape their text.
    """
    found = jinja2.Environment(
        loader=jinja2.PackageLoader(package, folder),
        autoescape=jinja2.select_autoescape(["html", "svg"]),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    found.filters |= dict(filters or {})
    return found


def read_asset(package: str, folder: str, name: str) -> Markup:
    """Returns the unchanged text of a style sheet or script in a package."""
    path = resources.files(package) / folder / name
    return Markup(path.read_text("utf-8"))
