"""JSON from untrusted sources, and numbers for JSON."""

from collections.abc import Mapping
import hashlib
import json
import math
import re
from typing import Any

from evaluation.base.repetitions import repeated

_STRING = re.compile(rb'"(?:[^"\\]|\\.)*"', re.DOTALL)
# An escape of a zero, or of a surrogate, which may lack its other half. JSON in
# UTF-8 can write these characters only as escapes, and neither a zero nor half
# of a pair is text.
_SUSPECT = re.compile(rb"\\u(?:0000|[dD][89a-fA-F])")


def json_values(value: Any) -> Any:
    """Returns a value for JSON, with None for each NaN and each infinity.

    JSON has neither.
    A dictionary or a list is copied, with all that is in it.
    """
    if isinstance(value, dict):
        return {name: json_values(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [json_values(entry) for entry in value]
    is_unknown = isinstance(value, float) and not math.isfinite(value)
    return None if is_unknown else value


def fingerprint(inputs: Mapping[str, object]) -> str:
    """Returns a short hash of inputs, which must be JSON values."""
    text = json.dumps(inputs, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def parse_json(data: bytes) -> Any:
    """Returns the value of UTF-8 bytes that hold JSON.

    Raises:
        ValueError: if the bytes are not JSON, are nested too deep, contain a
            key twice, or hold text that a file, terminal or path cannot
            contain.
    """
    text = data.decode("utf-8-sig")
    try:
        value = json.loads(text, object_pairs_hook=_without_doubles)
    except RecursionError:
        raise ValueError("nested too deep") from None
    # The strings are read one by one only if there is a suspect escape.
    if _SUSPECT.search(data):
        _check_strings(data)
    return value


def _check_strings(data: bytes) -> None:
    """Checks that no string of JSON has a zero or half a pair of surrogates.

    Raises:
        ValueError: a string has one of them.
    """
    for string in _STRING.findall(data):
        text = json.loads(string)
        if "\0" in text:
            raise ValueError("a zero in a text")
        try:
            text.encode()
        except UnicodeEncodeError:
            raise ValueError("half of a pair of surrogates") from None


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns an object's pairs as a dictionary; refuses repeated keys."""
    for key in repeated(key for key, _ in pairs):
        raise ValueError(f"the key {key[:60]!r} is there twice")
    return dict(pairs)
