"""The frame of a study's page: one style, sections that unfold, sorted tables.

A page needs neither a network nor other files.
"""

from collections.abc import Iterable, Mapping, Sequence
import functools
from importlib import resources
import json
import math
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup

from evaluation.results.method_names import title

_FOLDER = "page_template"
# The scripts of a section with data. A script uses only the scripts before it.
_BROWSER = ("browser_state.js", "browser_pictures.js", "browser.js")


class PageSection(NamedTuple):
    """A section of a page.

    Attributes:
        name: identifier of the section, to which links lead.
        word: name of the section among the links at the top.
        source: the rows of the tables, or other data, that the section shows.
        body: contents of the section as HTML.
        is_open: whether the section is shown from the start. Otherwise, the
            section unfolds when a reader clicks its name.
        data: values for the scripts of the query browser; None for any other
            section.
    """

    name: str
    word: str
    source: str
    body: Markup
    is_open: bool = False
    data: Mapping[str, Any] | None = None


def page_section(
    name: str,
    word: str,
    source: str,
    *,
    is_open: bool = False,
    data: Mapping[str, Any] | None = None,
    **values: object,
) -> PageSection:
    """Returns a section whose template `<name>.html` is filled with values.

    Values can be functions, which the template then calls.
    """
    return PageSection(
        name, word, source, rendered(f"{name}.html", **values), is_open, data
    )


def framed_page(
    name: str,
    heading: str,
    intro: Markup,
    sections: Sequence[PageSection],
    *,
    made_by: Iterable[str] = (),
    notes: Iterable[str] = (),
) -> str:
    """Returns a page as HTML.

    Args:
        name: title of the window.
        heading: heading of the page.
        intro: paragraphs below the heading, as HTML.
        sections: sections of the page, in order. At most one has data.
        made_by: what made the page, for the end of the page.
        notes: sentences on how the page was made, for the end of the page.
    """
    data = next((one.data for one in sections if one.data is not None), None)
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    scripts = ["tables.js", *(_BROWSER if data is not None else ())]
    return rendered(
        "frame.html",
        name=name,
        heading=heading,
        intro=intro,
        sections=sections,
        made_by=list(made_by),
        notes=list(notes),
        style=_asset("frame.css"),
        script=Markup("\n").join(map(_asset, scripts)),
        # JSON cannot end the script element around it.
        data=None if data is None else Markup(text.replace("<", "\\u003c")),
    )


def rendered(name: str, /, **values: object) -> Markup:
    """Returns a template filled with values; HTML and SVG escape their text."""
    return Markup(_environment().get_template(name).render(values))


def value_text(value: object) -> str:
    """Returns a value as text for a reader; templates call it `shown`."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if value == math.inf:
        return "more"
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float) and 0.0 < abs(value) < 0.1:
        return f"{value:.2g}"
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) < 100.0 else f"{value:.0f}"
    return str(value)


@functools.cache
def _environment() -> jinja2.Environment:
    found = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, _FOLDER),
        autoescape=jinja2.select_autoescape(["html", "svg"]),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    found.globals |= {"shown": value_text, "title": title}
    return found


def _asset(name: str) -> Markup:
    """Returns the unchanged text of a style sheet or script."""
    path = resources.files(__package__) / _FOLDER / name
    return Markup(path.read_text("utf-8"))
