"""Checks PLY files for contents that Open3D reads wrongly or not at all."""

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
from pathlib import Path
import struct

import numpy as np

from evaluation.base import repeated, user_errors

# Elements of PLY that are no shapes.
_NO_SHAPES = ("vertex", "face", "camera", "material")
# Properties of vertices and faces that are read.
_AXES = ["x", "y", "z"]
_CORNER_LISTS = ("vertex_indices", "vertex_index")
# Least number of corners of a face.
_CORNERS = 3
# Type of a number in PLY -> its type in NumPy.
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2",
    "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class _Element:
    """An element of a PLY header.

    Attributes:
        name: name of the element.
        count: number of its rows.
        properties: name and type of each value of a row. A list has two types:
            the type of its length and the type of its values.
    """

    name: str
    count: int
    properties: list[tuple[str, tuple[str, ...]]]

    @property
    def faces(self) -> list[str]:
        """Names of the lists of vertices."""
        return [
            name
            for name, types in self.properties
            if len(types) > 1 and name.startswith("vert")
        ]


def check_ply(content: bytes) -> tuple[str, ...]:
    """Returns notes on ignored elements of a PLY file, one for each kind.

    Raises:
        ValueError: surfaces in the file, such as triangle strips, would not be
            read, or would be wrong.
    """
    head, found, body = content.partition(b"end_header")
    if not found:
        return ()  # Open3D says what is wrong.
    encoding, elements = _parse_header(head.decode("ascii", "replace"))
    for name in repeated(one.name for one in elements):
        raise ValueError(f"has the element {name} of PLY twice; export it once")
    notes = _ignored_elements(elements)
    _check_names(elements)
    # The line of the word end_header ends by \n or by \r\n.
    _, _, body = body.partition(b"\n")
    if encoding == "ascii":
        _check_values(elements, body)
    least = _CORNERS
    # Open3D refuses damaged files itself.
    with contextlib.suppress(
        LookupError, OverflowError, ValueError, struct.error
    ):
        least = _least_corners(elements, encoding, body)
    if least < _CORNERS:
        # Open3D would read its corners from beyond the list.
        raise ValueError(f"has a face of PLY with {least} corners")
    return notes


def has_single_vertices(path: Path) -> bool:
    """Returns whether the vertices of a PLY file are of single precision."""
    with user_errors(path), open(path, "rb") as stream:
        head = stream.read().partition(b"end_header")[0]
    _, elements = _parse_header(head.decode("ascii", "replace"))
    return any(
        name in _AXES and _TYPES.get(types[0]) == "f4"
        for one in elements
        if one.name == "vertex"
        for name, types in one.properties
    )


def _parse_header(head: str) -> tuple[str, list[_Element]]:
    """Returns the encoding and the elements of a PLY file, from its header."""
    elements: list[_Element] = []
    encoding = ""
    for line in head.splitlines():
        match line.split():
            case ["format", encoding, *_]:
                pass
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count), []))
            case ["property", "list", *types, name] if elements:
                elements[-1].properties.append((name, tuple(types)))
            case ["property", kind, name] if elements:
                elements[-1].properties.append((name, (kind,)))
    return encoding, elements


def _check_names(elements: Sequence[_Element]) -> None:
    """Checks that coordinates and corners have the names that Open3D reads.

    Raises:
        ValueError: they have other names, or another order.
    """
    for one in elements:
        names = [name for name, _ in one.properties]
        axes = [name for name in names if name in _AXES]
        if one.name == "vertex" and axes != _AXES:
            raise ValueError(
                f"has vertices of PLY with {' '.join(axes) or 'no x, y and z'},"
                " not x y z in this order; export it again"
            )
        lists = [name for name, types in one.properties if len(types) > 1]
        if one.name == "face" and one.count and not {*lists} & {*_CORNER_LISTS}:
            raise ValueError(
                f"has faces of PLY with the lists {' '.join(lists) or '(none)'}"
                f", none of {' or '.join(_CORNER_LISTS)}; export it again"
            )


def _check_values(elements: Sequence[_Element], body: bytes) -> None:
    """Checks that a text has as many values as its header says.

    Open3D reads one value after the other, whatever their lines are: with other
    numbers, faces get wrong corners.

    Raises:
        ValueError: it has more or fewer.
    """
    values = body.split()
    at = 0
    for one in elements:
        kinds = [types for _, types in one.properties]
        if all(len(types) == 1 for types in kinds):
            at += one.count * len(kinds)
            continue
        for _ in range(one.count):
            for types in kinds:
                is_list = len(types) > 1 and values[at : at + 1]
                with contextlib.suppress(ValueError):
                    at += max(int(values[at]), 0) if is_list else 0
                at += 1
            if at > len(values):
                break
    if at != len(values):
        raise ValueError(_misfit_of_rows(elements, body))


def _misfit_of_rows(elements: Sequence[_Element], body: bytes) -> str:
    """Returns how the rows of a text differ from those in its header."""
    rows = [row.split() for row in body.splitlines() if row.strip()]
    wanted = sum(one.count for one in elements)
    if len(rows) != wanted:
        return f"has {len(rows)} rows of PLY, not {wanted} as its header says"
    at = 0
    for one in elements:
        number = len(one.properties)
        if all(len(types) == 1 for _, types in one.properties):
            for row in rows[at : at + one.count]:
                if len(row) != number:
                    return (
                        f"has {len(row)} values in a row of the element"
                        f" {one.name} of PLY, not {number} as its header says"
                    )
        at += one.count
    return "has lists of PLY that are longer or shorter than they say"


def _ignored_elements(elements: Sequence[_Element]) -> tuple[str, ...]:
    """Returns a note for each element that is not read.

    Raises:
        ValueError: an element has surfaces that would not be read.
    """
    notes = []
    for one in elements:
        faces = one.faces
        if one.name == "face" and len(faces) > 1:
            raise ValueError(
                f"has two lists of vertices in each face, {' and '.join(faces)}"
            )
        if one.name in _NO_SHAPES or one.count == 0:
            continue
        if faces:
            raise ValueError(
                f"has surfaces in the element {one.name} of PLY, which is not"
                " read; export it with faces"
            )
        notes.append(f"{one.count} elements {one.name} of PLY ignored")
    return tuple(notes)


def _least_corners(
    elements: Sequence[_Element], encoding: str, body: bytes
) -> int:
    """Returns the least number of corners of a face in a PLY file.

    Raises:
        LookupError, OverflowError, ValueError, struct.error: another list
            precedes the faces in the file, or the file is damaged.
    """
    index = [one.name for one in elements].index("face")
    face, before = elements[index], elements[:index]
    kinds = [types for _, types in face.properties]
    (column,) = [k for k, types in enumerate(kinds) if len(types) > 1]
    if encoding == "ascii":
        first = sum(one.count for one in before)
        rows = body.split(b"\n", first + face.count)[first:]
        rows = rows[: face.count]
        return min(int(row.split(None, column + 1)[column]) for row in rows)
    sizes = [np.dtype(_TYPES[types[0]]).itemsize for types in kinds]
    corner_size = np.dtype(_TYPES[kinds[column][1]]).itemsize
    length = struct.Struct(
        _BYTE_ORDERS[encoding] + np.dtype(_TYPES[kinds[column][0]]).char
    )
    offset = sum(
        one.count * np.dtype(_TYPES[kind]).itemsize
        for one in before
        for _, (kind,) in one.properties
    )
    least = _CORNERS
    for _ in range(face.count):
        (corners,) = length.unpack_from(body, offset + sum(sizes[:column]))
        least = min(least, corners)
        offset += sum(sizes) + corner_size * corners
    return least
