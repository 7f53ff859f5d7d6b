"""Makes code of the examples in docstrings, for the reference of the site."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import griffe

_EXAMPLE = re.compile(r"^Example:\n((?:[ \t]+.+\n?|\n)+)", re.MULTILINE)


class CodeExamples(griffe.Extension):
    """Sets the section `Example` of every docstring as a block of code."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Changes the docstring of an object that was read."""
        if obj.docstring is not None:
            obj.docstring.value = _EXAMPLE.sub(_fenced, obj.docstring.value)


def _fenced(match: re.Match[str]) -> str:
    code = textwrap.dedent(match[1]).strip()
    block = textwrap.indent(f"```python\n{code}\n```\n", "    ")
    return f"Example:\n{block}\n"
