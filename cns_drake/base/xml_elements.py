"""Reading XML from untrusted sources."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path
from xml.parsers import expat

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes

_MOST_BYTES = 256 * 2**20
_MOST_ELEMENTS = 1_000_000
_DEEPEST = 100
_LONGEST_VALUE = 1000
# Larger than any number in a road network [m, rad, 1/m].
_LARGEST = 1e8


class Element:
    """An element and its children with known tags.

    Attributes:
        tag: its name.
        line: on which it begins.
        attributes: as texts.
        children: in their order.
        content: the beginning of its text.
    """

    __slots__ = ("attributes", "children", "content", "line", "tag")

    def __init__(self, tag: str, line: int, attributes: dict[str, str]):
        self.tag, self.line, self.attributes = tag, line, attributes
        self.children: list[Element] = []
        self.content = ""

    def all(self, *path: str) -> Iterator[Element]:
        """Yields the elements at the end of a path of tags."""
        for child in self.children:
            if child.tag == path[0]:
                if len(path) == 1:
                    yield child
                else:
                    yield from child.all(*path[1:])

    def first(self, *path: str) -> Element | None:
        """Returns the first element at the end of a path of tags."""
        return next(self.all(*path), None)

    def text(self, name: str, default: str | None = None) -> str:
        """Returns an attribute.

        Raises:
            ValueError: if it is too long, or missing without a default.
        """
        value = self.attributes.get(name, default)
        if value is None or len(value) > _LONGEST_VALUE:
            fault = f"no {name}"
            if value is not None:
                fault = f"{name} of {len(value)} letters"
            raise ValueError(f"line {self.line}: {self.tag}: {fault}")
        return value

    def number(self, name: str, default: float | None = None) -> float:
        """Returns an attribute that is a number.

        Raises:
            ValueError: if it is not a number, is too large for a road, or is
                missing and has no default.
        """
        if default is not None and name not in self.attributes:
            return default
        text = self.text(name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= _LARGEST:
            fault = f"{text[:40]!r} is no number up to {_LARGEST:g}"
            raise ValueError(f"line {self.line}: {self.tag}: {name}: {fault}")
        return value


def read_elements(path: Path, root: str) -> Element:
    """Reads a file.

    Args:
        path: the file.
        root: tag of its outermost element.

    Raises:
        InputError: if it cannot be read, is no XML, has another root, holds
            a document type, is nested too deep or has too many elements.
    """
    parser = expat.ParserCreate()
    top = Element("", 0, {})
    open_ = [top]
    count = 0

    def refuse(fault: str) -> None:
        raise InputError(f"{path}: line {parser.CurrentLineNumber}: {fault}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        if len(open_) > _DEEPEST:
            refuse(f"nested more than {_DEEPEST} deep")
        if len(open_) == 1 and tag != root:
            refuse(f"{tag[:40]} is no {root}")
        count += 1
        if count > _MOST_ELEMENTS:
            refuse(f"more than {_MOST_ELEMENTS} elements")
        element = Element(tag, parser.CurrentLineNumber, attributes)
        open_[-1].children.append(element)
        open_.append(element)

    def end(_: str) -> None:
        open_.pop()

    def add(text: str) -> None:
        element = open_[-1]
        if len(element.content) < _LONGEST_VALUE:
            element.content += text[:_LONGEST_VALUE]

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = add
    parser.StartDoctypeDeclHandler = lambda *_: refuse("holds a document type")
    try:
        parser.Parse(read_bytes(path, _MOST_BYTES), True)
    except expat.ExpatError as error:
        raise InputError(
            f"{path}: cannot be parsed: line {error.lineno}:"
            f" {expat.ErrorString(error.code)}"
        ) from error
    except (LookupError, ValueError) as error:
        # A text encoding that Python does not know.
        raise InputError(f"{path}: cannot be parsed: {error}") from error
    return top.children[0]
