import json

import pytest

from cns_drake.base import parse_json


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
        (b"[" * 51 + b"]" * 51, "nested"),
        (b'{"a":' * 60 + b"1" + b"}" * 60, "nested"),
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


def test_only_brackets_outside_of_texts_nest():
    value = {'"[{\\': ["[" * 60 + '\\"', "]" * 60, [1, {"]": [2]}]] * 30}
    assert parse_json(json.dumps(value).encode()) == value
    deep = "[" * 50 + "1" + "]" * 50
    assert parse_json(f'{{"a": 1}}{deep}'[8:].encode())
    with pytest.raises(ValueError, match="more than 50 deep"):
        parse_json(f'[{deep}, "["]'.encode())
