"""Reading YAML strictly and within bounds."""

from pathlib import Path
from typing import Any

import yaml

from cns_drake.base.errors import value_errors
from cns_drake.base.files import read_bytes

# Files written by hand stay far below both.
_DEEPEST = 50
_MOST_NODES = 1_000_000
_LONGEST_NUMBER = 100
_WHOLE = "tag:yaml.org,2002:int"


def read_yaml(path: Path) -> Any:
    """Returns the content of a YAML file; None if it is empty.

    Raises:
        InputError: the file cannot be read, is not YAML, expands to too many
            values or has a key twice.
    """
    text = read_bytes(path)
    with value_errors(path):
        return parse_yaml(text)


def parse_yaml(text: str | bytes, loader: type = yaml.CSafeLoader) -> Any:
    """Returns the content of a YAML document.

    A document whose aliases expand to too many values is refused, since a few
    lines of aliases could fill the memory. A repeated key is an error; YAML
    libraries would silently use the last value.

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
        _check_depth(text, loader)
        parser = loader(text)
        try:
            node = parser.get_single_node()
            if node is None:
                return None
            _check(node, {})
            return parser.construct_document(node)
        finally:
            parser.dispose()
    except (
        yaml.YAMLError,
        # Errors of the constructors of numbers and dates.
        ArithmeticError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        fault = " ".join(str(error).split())
        raise ValueError(f"not readable as YAML: {fault}") from error


def _check_depth(text: str | bytes, loader: type) -> None:
    """Refuses YAML whose nesting is too deep for the parser of nodes."""
    depth = 0
    for event in yaml.parse(text, Loader=loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > _DEEPEST:
            # An error of the parser has a line.
            assert event.start_mark is not None
            line = event.start_mark.line + 1
            raise ValueError(f"line {line}: nested more than {_DEEPEST} deep")


def _check(node: yaml.Node, sizes: dict[int, int]) -> int:
    """Returns the number of nodes of a tree when aliases are resolved."""
    line = node.start_mark.line + 1
    if isinstance(node, yaml.ScalarNode):
        # Python cannot print what `0xff...` stands for.
        text = node.value
        if (
            node.tag == _WHOLE
            and len(text) > _LONGEST_NUMBER
            and not text.isdecimal()
        ):
            raise ValueError(f"line {line}: a number of {len(text)} letters")
        return 1
    if id(node) in sizes:
        if sizes[id(node)] == 0:
            raise ValueError(f"line {line}: contains itself")
        return sizes[id(node)]
    sizes[id(node)] = 0
    children = node.value
    if isinstance(node, yaml.MappingNode):
        _check_keys(node)
        children = [part for pair in node.value for part in pair]
    size = 1 + sum(_check(child, sizes) for child in children)
    if size > _MOST_NODES:
        raise ValueError(
            f"line {line}: stands for more than {_MOST_NODES} values"
        )
    sizes[id(node)] = size
    return size


def _check_keys(node: yaml.MappingNode) -> None:
    seen = set()
    for key, _ in node.value:
        if isinstance(key, yaml.ScalarNode):
            if (key.tag, key.value) in seen:
                raise ValueError(
                    f"line {key.start_mark.line + 1}: {key.value!r} is there"
                    " twice"
                )
            seen.add((key.tag, key.value))
