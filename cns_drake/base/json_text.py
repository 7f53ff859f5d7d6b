"""JSON from untrusted sources, and numbers for JSON."""

import itertools
import json
import math
import re
from typing import Any

# The deepest nesting; real data stay far below it.
_DEEPEST = 50
_STRING = re.compile(rb'"(?:[^"\\]|\\.)*"', re.DOTALL)
_NO_BRACKET = re.compile(rb"[^][{}]+")
# Escapes of a zero, or of half a pair of surrogates.
_SUSPECT = re.compile(rb"\\u(?:0000|[dD][89a-fA-F])")


def json_number(value: float) -> float | None:
    """Returns a number for JSON: None instead of NaN, which JSON lacks."""
    return None if math.isnan(value) else value


def parse_json(data: bytes) -> Any:
    """Returns the value of UTF-8 bytes that hold JSON.

    Raises:
        ValueError: if it is not JSON, is nested too deep, has a key twice, or
            holds text that cannot stand in a file, terminal or path.
    """
    text = data.decode("utf-8-sig")
    brackets = _NO_BRACKET.sub(b"", _STRING.sub(b"", data))
    steps = (1 if one in b"[{" else -1 for one in brackets)
    if max(itertools.accumulate(steps), default=0) > _DEEPEST:
        raise ValueError(f"nested more than {_DEEPEST} deep")
    if _SUSPECT.search(data):
        # Both can be written only as escapes, and neither is text.
        for string in _STRING.findall(data):
            if "\0" in (word := json.loads(string)):
                raise ValueError("a zero in a text")
            try:
                word.encode()
            except UnicodeEncodeError:
                raise ValueError("half of a pair of surrogates") from None
    return json.loads(text, object_pairs_hook=_without_doubles)


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns an object's pairs as a dictionary; refuses repeated keys."""
    value = dict(pairs)
    if len(value) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:60]!r} is there twice")
    return value
