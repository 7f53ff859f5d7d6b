import json

import pytest

from evaluation.base import parse_json


@pytest.mark.parametrize(
    "value",
    [None, 1.5, "a[[[\\u0000", [{"a": ["\u00e9", "\U0001f600"]}], "\\", '"]"'],
)
def test_what_json_writes_is_read(value):
    assert parse_json(json.dumps(value).encode()) == value
    text = json.dumps(value, ensure_ascii=False)
    assert parse_json(text.encode()) == value


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"[" * 100_000, "nested"),
        (rb'{"map": "a\u0000b"}', "a zero"),
        (rb'{"map": "\ud800"}', "surrogates"),
        (rb'{"\uDFFF": 1}', "surrogates"),
        (b'{"map": "\xed\xa0\x80"}', "utf-8"),
        (b"{", "line 1"),
        (b"9" * 5000, "digits"),
    ],
)
def test_refused_values(data, fault):
    with pytest.raises(ValueError, match=fault):
        parse_json(data)


def test_a_key_that_is_there_twice_is_refused():
    with pytest.raises(ValueError, match="the key 'a' is there twice"):
        parse_json(b'{"b": {"a": 1, "a": 2}}')
