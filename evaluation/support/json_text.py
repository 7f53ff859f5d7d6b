"""JSON as it is read here: within bounds, and of text that can be written."""

from __future__ import annotations

import itertools
import json
import re
from typing import Any

# Data of people and programs are far from it.
_DEEPEST = 50
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
_BRACKET = re.compile(r"[\[\]{}]")


def parse_json(data: bytes) -> Any:
    """Returns the value of a text in JSON.

    Args:
        data: in UTF-8.

    Raises:
        ValueError: if it is none, is nested too deep, or holds text that no
            file, terminal or path takes.
    """
    text = data.decode("utf-8-sig")
    steps = (
        1 if bracket[0] in "[{" else -1
        for bracket in _BRACKET.finditer(_STRING.sub("", text))
    )
    if max(itertools.accumulate(steps), default=0) > _DEEPEST:
        raise ValueError(f"nested more than {_DEEPEST} deep")
    # The only way to write either: both are no text.
    for string in _STRING.findall(text) if "\\u" in text else ():
        if "\0" in (word := json.loads(string)):
            raise ValueError("a zero in a text")
        try:
            word.encode()
        except UnicodeEncodeError:
            raise ValueError("half of a pair of surrogates") from None
    return json.loads(text)
