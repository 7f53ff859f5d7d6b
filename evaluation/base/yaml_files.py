"""Reading YAML strictly."""

from pathlib import Path
import re
from typing import Any, ClassVar

import yaml

from evaluation.base.budget import reading
from evaluation.base.errors import value_errors
from evaluation.base.expansion import check_expansion
from evaluation.base.files import read_bytes

_WHOLE = "tag:yaml.org,2002:int"
# Numbers to the base 8 in YAML 1.1, and names to most people.
_OCTAL = re.compile(r"([-+]?)0([0-7_]+)")
# Python reads these as numbers, YAML 1.2 as texts.
_UNDERSCORES = re.compile(r"[-+]?[0-9]+_[0-9_.]*")
_WORDS = {"yes": "true", "on": "true", "no": "false", "off": "false"}
# Texts that PyYAML reads as numbers, without numbers to the bases 2, 8, 16 and
# 60 and without numbers with underscores.
_FLOAT = "tag:yaml.org,2002:float"
_MERGE = "tag:yaml.org,2002:merge"
_RESOLVERS = (
    (_WHOLE, r"[-+]?(0|[1-9][0-9]*)", "-+0123456789"),
    (
        _FLOAT,
        r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?"
        r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        "-+.0123456789",
    ),
    (
        "tag:yaml.org,2002:bool",
        "true|True|TRUE|false|False|FALSE",
        "tTfF",
    ),
    ("tag:yaml.org,2002:null", "~|null|Null|NULL|", ["~", "n", "N", ""]),
    (_MERGE, "<<", "<"),
)
# Tag of numbers -> their form, also where the tag is written.
_NUMBERS = {
    tag: re.compile(form)
    for tag, form, _ in _RESOLVERS
    if tag in (_WHOLE, _FLOAT)
}
_NUMBERS[_FLOAT] = re.compile(f"{_NUMBERS[_FLOAT].pattern}|[-+]?[0-9]+")
# Types of YAML 1.1 that no file here needs. A set has no order, for example.
_UNREAD = re.compile(r"tag:yaml\.org,2002:(set|omap|pairs|binary|timestamp)")


class _PlainScalars:
    """Reads scalars without quotes as they are written.

    YAML 1.1, and so PyYAML, reads 010 as 8, 1:30 as 90, 1_0 as 10, `on` as true
    and `no` as false. Here such numbers and dates are texts, which a field for
    numbers reads or refuses.
    """

    yaml_implicit_resolvers: ClassVar[dict] = {}


for _tag, _form, _first in _RESOLVERS:
    for _letter in _first:
        _PlainScalars.yaml_implicit_resolvers.setdefault(_letter, []).append(
            (_tag, re.compile(f"(?:{_form})\\Z"))
        )


class YamlLoader(_PlainScalars, yaml.CSafeLoader):
    """Loads YAML as `parse_yaml` does."""


class MarkedYamlLoader(_PlainScalars, yaml.SafeLoader):
    """A slower loader, whose nodes contain their positions in the text."""


def read_yaml(path: Path) -> Any:
    """Returns the content of a YAML file; None if it is empty.

    Raises:
        InputError: the file cannot be read, is not YAML, expands to too many
            values or has a key twice.
    """
    with reading(path), value_errors(path):
        return parse_yaml(read_bytes(path))


def parse_yaml(text: str | bytes, loader: type = YamlLoader) -> Any:
    """Returns the content of a YAML document.

    A document whose aliases expand to too many values is refused, because a few
    lines of aliases could fill the memory. A repeated key is an error; YAML
    libraries would silently use the last value. Some values are errors because
    libraries read them in different ways: yes, no, on and off without quotes;
    whole numbers without quotes that begin with a zero or contain underscores;
    numbers in another form after !!int and !!float; other types such as !!set;
    and a << that merges several mappings.

    Args:
        text: the document.
        loader: the loader of PyYAML that converts it.

    Returns:
        The content as Python values; None for an empty document.

    Raises:
        ValueError: if the text is not YAML or expands to too many values; the
            message is one line.
    """
    try:
        parser = loader(text)
        try:
            node = parser.get_single_node()
            if node is None:
                return None
            # The document itself may be a scalar.
            whole: yaml.Node = yaml.SequenceNode("", [node], node.start_mark)
            check_expansion(
                whole, _checked_parts, lambda one: 1 + len(_values_in(one))
            )
            return parser.construct_document(node)
        finally:
            parser.dispose()
    except RecursionError:
        raise ValueError("not readable as YAML: nested too deep") from None
    except (
        yaml.YAMLError,
        # Errors of the constructors of numbers and dates.
        ArithmeticError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
    ) as error:
        fault = " ".join(str(error).split())
        raise ValueError(f"not readable as YAML: {fault}") from error


def _values_in(node: yaml.Node) -> list[yaml.Node]:
    """Returns the nodes directly in a node."""
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return [] if isinstance(node, yaml.ScalarNode) else node.value


def _checked_parts(node: yaml.Node) -> list[yaml.Node]:
    """Returns the collections in a node, of which all values are checked."""
    if isinstance(node, yaml.MappingNode):
        _check_keys(node)
    values = _values_in(node)
    for value in values:
        _check_tag(value)
        if isinstance(value, yaml.ScalarNode) and not value.style:
            _check_plain(value.value, value.start_mark.line + 1)
    return [one for one in values if not isinstance(one, yaml.ScalarNode)]


def _check_tag(node: yaml.Node) -> None:
    """Refuses types that are not read, and numbers in another form."""
    line = node.start_mark.line + 1
    if found := _UNREAD.fullmatch(node.tag):
        raise ValueError(f"line {line}: the type !!{found[1]} is not read")
    form = _NUMBERS.get(node.tag)
    if form and not form.fullmatch(str(node.value)):
        raise ValueError(f"line {line}: {node.value!r} is not a number")


def _check_plain(text: str, line: int) -> None:
    """Refuses a scalar without quotes that is read in several ways."""
    instead = _WORDS.get(text.lower())
    if match := _OCTAL.fullmatch(text):
        instead = f"{match[1]}{match[2].lstrip('0') or '0'}"
    if _UNDERSCORES.fullmatch(text):
        instead = text.replace("_", "")
    if instead is not None:
        raise ValueError(
            f'line {line}: {text}: quote it ("{text}"), or write {instead}'
        )


def _check_keys(node: yaml.MappingNode) -> None:
    seen = set()
    for key, value in node.value:
        if key.tag == _MERGE and isinstance(value, yaml.SequenceNode):
            # Libraries disagree on which of them comes first.
            raise ValueError(
                f"line {key.start_mark.line + 1}: << merges several mappings; "
                "write one"
            )
        if isinstance(key, yaml.ScalarNode):
            if (key.tag, key.value) in seen:
                raise ValueError(
                    f"line {key.start_mark.line + 1}: {key.value!r} is there"
                    " twice"
                )
            seen.add((key.tag, key.value))
