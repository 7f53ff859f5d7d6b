"""YAML that must not be expanded."""

import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.yaml_files import parse_yaml, read_yaml

# Nine lines that stand for 9 ** 9 values.
_LAUGHS = "a0: &a0 [x]\n" + "".join(
    f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(9)
)


def test_what_people_write_is_read():
    text = "base: &b {x: 1, y: [2, 3.5]}\nmore: {<<: *b, y: no}\nlast: *b\n"
    assert parse_yaml(text) == {
        "base": {"x": 1, "y": [2, 3.5]},
        "more": {"x": 1, "y": False},
        "last": {"x": 1, "y": [2, 3.5]},
    }
    assert parse_yaml("") is None
    assert parse_yaml("a: \u00fc".encode("utf-16")) == {"a": "\u00fc"}
    assert parse_yaml("[" * 50 + "]" * 50) is not None


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (_LAUGHS, "stands for more than"),
        ("a: &a [*a]", "line 1: contains itself"),
        ("[" * 51 + "]" * 51, "nested more than 50"),
        ("[" * 100_000, "nesting|nested"),
        ("a: 1\nb: {c: 1,\n  c: 2}", "line 3: 'c' is there twice"),
        ("a: 2001-99-99", "month must be"),
        ("a: " + "9" * 5000, "4300 digits"),
        ("a: 0x" + "f" * 4000, "line 1: a number of 4002 letters"),
        ("a: 1" + ":59" * 3000, "line 1: a number of 9001 letters"),
        ("a: !!int x", "invalid literal"),
        ("!!timestamp x", "groupdict"),
        ("? [1]\n: 2", "unhashable"),
        ("!!python/object/apply:os.system [ls]", "could not determine"),
        (b"\xff\xfe\x00", "byte string"),
        ("a: [", "while parsing"),
    ],
)
def test_bad_text_is_one_line(text, fault, tmp_path):
    with pytest.raises(ValueError, match=fault) as error:
        parse_yaml(text)
    assert "\n" not in str(error.value)
    path = tmp_path / "file.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=rf"file\.yaml: not .*({fault})"):
        read_yaml(path)
