"""Reading XML from untrusted sources."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re
from typing import cast
from xml.etree import ElementTree
from xml.parsers import expat

from evaluation.base.budget import reading
from evaluation.base.errors import InputError
from evaluation.base.files import read_bytes
from evaluation.base.number_format import to_number

# Readers of elements call themselves for each level.
_DEEPEST = 100
# Larger than any number in a road network [m, rad, 1/m].
_LARGEST = 1e8


class Element(ElementTree.Element):
    """An element of an XML file.

    Attributes:
        line: number of the line on which the element begins.
    """

    line = 0

    def all(self, *path: str) -> Iterator[Element]:
        """Yields all elements at the end of a path of tags from this element.

        For example, `all("road", "link")` yields each `link` in each `road` in
        this element.
        """
        return cast(Iterator[Element], self.iterfind("/".join(path)))

    def first(self, *path: str) -> Element | None:
        """Returns the first element that a path of tags reaches, or None."""
        return next(self.all(*path), None)

    def value(self, name: str, default: str | None = None) -> str:
        """Returns an attribute of the element as text, or the default.

        Raises:
            ValueError: the attribute is missing and has no default.
        """
        value = self.attrib.get(name, default)
        if value is None:
            raise ValueError(f"line {self.line}: {self.tag}: no {name}")
        return value

    def number(self, name: str, default: float | None = None) -> float:
        """Returns an attribute of the element as a number, or the default.

        Raises:
            ValueError: if the text is not a number or the number is implausibly
                large, or the attribute is missing and has no default.
        """
        if default is not None and name not in self.attrib:
            return default
        text = self.value(name)
        value = to_number(text)
        if not abs(value) <= _LARGEST:
            fault = f"{text[:40]!r} is no number up to {_LARGEST:g}"
            raise ValueError(f"line {self.line}: {self.tag}: {name}: {fault}")
        return value


# Blanks before the declaration of XML.
_BLANKS = re.compile(rb"\A([ \t\r\n]+)(<\?xml[^>]*>)")
# Comments and CDATA contain no elements. Their end may be missing.
_COMMENT = re.compile(
    rb"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)", re.DOTALL
)


def readable_xml(content: bytes) -> bytes:
    """Returns XML content with common errors of other programs repaired.

    The errors are double dashes inside comments, and blanks before the XML
    declaration. Line numbers do not change.
    """

    def cleared(found: re.Match[bytes]) -> bytes:
        text = found[0]
        if text.startswith(b"<!--") and text.endswith(b"-->"):
            return b"<!--" + b"\n" * text.count(b"\n") + b"-->"
        return text

    content = _BLANKS.sub(rb"\2\1", content, count=1)
    return _COMMENT.sub(cleared, content)


def read_elements(
    path: Path, root: str | None = None, encoding: str | None = None
) -> Element:
    """Returns the top element of an XML file.

    Namespace prefixes need not be declared.

    Args:
        path: the file.
        root: required tag of the top element; None for any tag.
        encoding: encoding of the file; by default the encoding that the file
            declares.

    Raises:
        InputError: if the file cannot be read, is not XML, has another root,
            holds a document type or is nested too deep.
    """
    parser = expat.ParserCreate(encoding)
    depth = 0

    def refuse(fault: str) -> None:
        raise InputError(f"{path}: line {parser.CurrentLineNumber}: {fault}")

    def make(tag: str, attributes: dict[str, str]) -> Element:
        element = Element(tag, attributes)
        element.line = parser.CurrentLineNumber
        return element

    builder = ElementTree.TreeBuilder(make)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        if depth == 0 and root not in (None, tag):
            refuse(f"{tag[:40]} is no {root}")
        depth += 1
        if depth > _DEEPEST:
            refuse(f"nested more than {_DEEPEST} deep")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = lambda *_: refuse("holds a document type")
    try:
        with reading(path):
            parser.Parse(readable_xml(read_bytes(path)), True)
    except expat.ExpatError as error:
        raise InputError(
            f"{path}: cannot be parsed: line {error.lineno}:"
            f" {expat.ErrorString(error.code)}"
        ) from error
    except (LookupError, ValueError) as error:
        # A text encoding that Python does not know.
        raise InputError(f"{path}: cannot be parsed: {error}") from error
    return cast(Element, builder.close())
