"""Templates of the page, and files that it includes unchanged."""

from __future__ import annotations

import functools
from importlib import resources

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

_FOLDER = "page_template"


def render(name: str, /, **values: object) -> Markup:
    """Returns a template filled with values, whose text is escaped."""
    return Markup(_environment().get_template(name).render(values))


def read_asset(name: str) -> Markup:
    """Returns a style sheet or a script unchanged."""
    folder = resources.files(__package__) / _FOLDER
    return Markup((folder / name).read_text("utf-8"))


@functools.cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader(__package__, _FOLDER),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
