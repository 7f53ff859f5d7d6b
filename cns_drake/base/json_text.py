"""Reading JSON within bounds, and only with text that can be written."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

# Real data stay far below this.
_DEEPEST = 50
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
# A backslash is found in strings only.
_ESCAPE = re.compile(rb"\\.", re.DOTALL)
# Escapes of a zero, or of half a pair of surrogates.
_SUSPECT = re.compile(rb"\\u(?:0000|[dD][89a-fA-F])")
# Brackets are counted in pieces, for memory's sake [bytes].
_PIECE = 1 << 24


def parse_json(data: bytes) -> Any:
    """Returns the value of a text in JSON.

    Args:
        data: in UTF-8.

    Raises:
        ValueError: if it is not JSON, is nested too deep, has a key twice, or
            holds text that cannot stand in a file, terminal or path.
    """
    text = data.decode("utf-8-sig")
    if _depth(data) > _DEEPEST:
        raise ValueError(f"nested more than {_DEEPEST} deep")
    if _SUSPECT.search(data):
        # Both can be written only as escapes, and neither is text.
        for string in _STRING.findall(text):
            if "\0" in (word := json.loads(string)):
                raise ValueError("a zero in a text")
            try:
                word.encode()
            except UnicodeEncodeError:
                raise ValueError("half of a pair of surrogates") from None
    return json.loads(text, object_pairs_hook=_without_doubles)


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns an object; refuses a key that is there twice."""
    value = dict(pairs)
    if len(value) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:60]!r} is there twice")
    return value


def _depth(data: bytes) -> int:
    """Returns how deep brackets are nested in what may be JSON."""
    if b"\\" in data:
        data = _ESCAPE.sub(b"__", data)
    deepest, depth, in_string = 0, 0, False
    for start in range(0, len(data), _PIECE):
        octets = np.frombuffer(data, np.uint8)[start : start + _PIECE]
        # Quotes begin and end strings in turn.
        quotes = np.flatnonzero(octets == ord('"'))
        opening = np.flatnonzero((octets == ord("[")) | (octets == ord("{")))
        closing = np.flatnonzero((octets == ord("]")) | (octets == ord("}")))
        places = np.concatenate([opening, closing])
        steps = np.repeat([1, -1], [len(opening), len(closing)])
        outside = (np.searchsorted(quotes, places) % 2 == 1) == in_string
        order = np.argsort(places[outside])
        depths = depth + np.cumsum(steps[outside][order])
        if len(depths):
            deepest = max(deepest, int(depths.max()))
            depth = int(depths[-1])
        in_string ^= len(quotes) % 2 == 1
    return deepest
