"""YAML that must not be expanded."""

import math
import re

import pytest
import yaml

from evaluation.base import InputError, parse_yaml, read_yaml

# Nine lines that stand for 9 ** 9 values.
_LAUGHS = "a0: &a0 [x]\n" + "".join(
    f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(9)
)


def test_what_people_write_is_read():
    text = "base: &b {x: 1, y: [2, 3.5]}\nmore: {<<: *b, y: false}\nlast: *b\n"
    assert parse_yaml(text) == {
        "base": {"x": 1, "y": [2, 3.5]},
        "more": {"x": 1, "y": False},
        "last": {"x": 1, "y": [2, 3.5]},
    }
    assert parse_yaml("") is None
    assert parse_yaml("a: \u00fc".encode("utf-16")) == {"a": "\u00fc"}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # Numbers as people write them.
        ("0", 0),
        ("-12", -12),
        ("+7", 7),
        ("007.5", 7.5),
        ("1.5e+3", 1500.0),
        (".5", 0.5),
        ("-.inf", -math.inf),
        # PyYAML reads 90, 90.5, 5, 31, a date, and an error.
        *[(one, one) for one in ("1:30", "1:30.5", "0b101", "0x1F")],
        *[(one, one) for one in ("2012-01-15", "2001-99-99", "=")],
        # It leaves these as texts, so that older files have them.
        *[(one, one) for one in ("08", "-09", "2e-2", "0o17", "y", "N")],
        ("~", None),
        ("", None),
        ("True", True),
        ("false", False),
        ("'010'", "010"),
        ('"on"', "on"),
        ("'no'", "no"),
        ("!!str 1", "1"),
        ("!!int '12'", 12),
        ("!!float 3", 3.0),
        *[(one, one) for one in ("a_1", "_1", "1_a", "1__x")],
    ],
)
def test_a_scalar_is_what_is_written(text, value):
    found = parse_yaml(f"a: {text}")["a"]
    assert (type(found), found) == (type(value), value)


def test_what_pyyaml_writes_is_read_as_it_was():
    values = ["010", "08", "1:30", "1_0", "on", "No", "2e-2", "1e5", "2.e+3"]
    values += ["0x1F", "0b1", "0o7", "2012-01-15", "~", "", "true", ".inf"]
    values += [0, -8, 1e-7, 1e300, 0.1, True, None, "=", "<<", "y"]
    assert parse_yaml(yaml.safe_dump(values)) == values
    named = {str(value): value for value in values}
    assert parse_yaml(yaml.safe_dump(named)) == named


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (_LAUGHS, "parts stand for"),
        ("a: &a [*a]", "contains itself"),
        ("[" * 100_000, "nesting|nested"),
        ("a: 1\nb: {c: 1,\n  c: 2}", "line 3: 'c' is there twice"),
        ("a: " + "9" * 5000, "4300 digits"),
        ("a: !!int x", "line 1: 'x' is not a number"),
        ("a: !!int 1:30", "line 1: '1:30' is not a number"),
        ("a: !!float 1:30", "line 1: '1:30' is not a number"),
        ("a: !!int 0b11", "line 1: '0b11' is not a number"),
        ("a: !!int [1]", "is not a number"),
        ("!!timestamp x", "line 1: the type !!timestamp is not read"),
        ("a:\n- !!set {1, 2}", "line 2: the type !!set is not read"),
        ("a: !!binary aGk=", "line 1: the type !!binary is not read"),
        ("a: {<<: [{b: 1}, {b: 2}]}", "line 1: << merges several mappings"),
        ("? [1]\n: 2", "unhashable"),
        ("!!python/object/apply:os.system [ls]", "could not determine"),
        (b"\xff\xfe\x00", "byte string"),
        ("a: [", "while parsing"),
        ("x: 1\na: 010", 'line 2: 010: quote it ("010"), or write 10'),
        ("[-0017]", 'quote it ("-0017"), or write -17'),
        ("{1: 2, 01: 3}", 'line 1: 01: quote it ("01"), or write 1'),
        ("a: 1_000", 'line 1: 1_000: quote it ("1_000"), or write 1000'),
        ("[-1_5.5]", 'line 1: -1_5.5: quote it ("-1_5.5"), or write -15.5'),
        ("a: off", 'line 1: off: quote it ("off"), or write false'),
        ("YES: 1", 'line 1: YES: quote it ("YES"), or write true'),
    ],
)
def test_bad_text_is_one_line(text, fault, tmp_path):
    if "quote it" in fault:
        fault = re.escape(fault)
    with pytest.raises(ValueError, match=fault) as error:
        parse_yaml(text)
    assert "\n" not in str(error.value)
    path = tmp_path / "file.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=rf"file\.yaml: not .*({fault})"):
        read_yaml(path)
