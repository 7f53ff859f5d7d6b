"""Checks models before Drake parses them.

For text that is not a number or a valid size, libsdformat uses a part of it or
1, or Drake ends the program. Long names end the process.
"""

from dataclasses import dataclass, field
import math
from pathlib import Path
import re
from typing import NoReturn
from xml.parsers import expat

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.scene.mesh_files import check_obj
from cns_drake.scene.surfaces import LARGEST_SIZE

_MODELS = (".sdf", ".urdf")
_LONGEST_NAME = 1000
# The limit of libsdformat's parser.
_DEEPEST = 100
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
# Shape -> elements of its size, and the numbers in each.
_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "ellipsoid": {"radii": 3},
    "drake:capsule": {"radius": 1, "length": 1},
    "drake:ellipsoid": {"a": 1, "b": 1, "c": 1},
}
_OTHER_SHAPES = ("mesh", "plane", "heightmap", "polyline", "cone", "empty")
_OTHER_NUMBERS = {
    ("mesh", "scale"),
    *(
        ("material", colour)
        for colour in ("ambient", "diffuse", "specular", "emissive")
    ),
}


@dataclass(slots=True)
class _Element:
    """An element that is being read.

    Attributes:
        name: its tag.
        line: its first line.
        values: attributes and children without children of their own.
        text: its text.
        children: tag -> number of children.
    """

    name: str
    line: int
    values: dict[str, str]
    text: str = ""
    children: dict[str, int] = field(default_factory=dict)


def check_model(path: Path) -> None:
    """Checks an SDF or URDF file, and the SDF files that it includes.

    Raises:
        InputError: it cannot be read, is not XML, or has an invalid number, an
            impossible size, two values for one element, a name that is too
            long, or an invalid face in a collision's mesh.
    """
    seen: set[Path] = set()
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file.resolve() in seen or file.suffix.lower() not in _MODELS:
            continue
        seen.add(file.resolve())
        waiting += _ModelCheck(file).included


class _ModelCheck:
    """One pass over the elements of a file."""

    def __init__(self, path: Path):
        self.included: list[Path] = []
        self._path = path
        self._open: list[_Element] = []
        self._names: list[str] = []
        parser = expat.ParserCreate("utf-8")
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.CharacterDataHandler = self._add_text
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        self._parser = parser
        try:
            parser.Parse(read_bytes(path), True)
        except expat.ExpatError as error:
            raise InputError(
                f"{path}: cannot be parsed: line {error.lineno}:"
                f" {expat.ErrorString(error.code)}"
            ) from error

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        if len(self._open) >= _DEEPEST:
            self._refuse(f"nested more than {_DEEPEST} deep")
        if self._open:
            children = self._open[-1].children
            children[name] = children.get(name, 0) + 1
        self._open.append(_Element(name, line, attributes))
        self._names.append(name)
        for key, value in attributes.items():
            if len(value) > _LONGEST_NAME:
                self._refuse(f"{key} of {len(value)} letters")

    def _add_text(self, text: str) -> None:
        self._open[-1].text += text

    def _end(self, name: str) -> None:
        element = self._open[-1]
        parents = self._names
        parents.pop()
        if "plugin" not in parents:
            self._check(element, parents[-1] if parents else "", parents)
        self._open.pop()
        if self._open and not element.children:
            self._open[-1].values[name] = element.text

    def _check(
        self, element: _Element, parent: str, parents: list[str]
    ) -> None:
        if parent == "geometry" and element.name in _SIZES:
            self._check_sizes(element)
        elif element.name == "geometry":
            shapes = [*_SIZES, *_OTHER_SHAPES]
            found = [
                one
                for one, number in element.children.items()
                for _ in range(number)
                if one in shapes
            ]
            if len(found) > 1:
                self._refuse(f"two shapes, {found[0]} and {found[1]}")
        elif element.name == "pose":
            for number in self._numbers(element.text)[:3]:
                if abs(number) > LARGEST_SIZE:
                    self._refuse(f"{number:g} is beyond {LARGEST_SIZE:g} m")
        elif element.name == "origin":
            for key in ("xyz", "rpy"):
                self._numbers(element.values.get(key, ""))
        elif (parent, element.name) in _OTHER_NUMBERS:
            self._numbers(element.text)
        elif element.name == "uri":
            self._check_uri(element.text.strip(), parents)

    def _check_sizes(self, shape: _Element) -> None:
        for name, count in _SIZES[shape.name].items():
            if name not in shape.values:
                self._refuse(f"no {name}")
            if (times := shape.children.get(name, 0)) > 1:
                self._refuse(f"{name} is there {times} times")
            text = shape.values[name]
            numbers = self._numbers(text, name)
            if len(numbers) != count:
                self._refuse(f"{name}: {len(numbers)} numbers, not {count}")
            if not all(number > 0.0 for number in numbers):
                self._refuse(
                    f"{name}: {' '.join(text.split())} is not a valid size"
                )

    def _numbers(self, text: str, name: str = "") -> list[float]:
        """Returns the numbers in a text, all of which are finite."""
        numbers = []
        for word in text.split():
            number = float(word) if _NUMBER.fullmatch(word) else math.nan
            if not math.isfinite(number):
                where = f"{name}: " if name else ""
                self._refuse(f"{where}{word} is no number")
            numbers.append(number)
        return numbers

    def _check_uri(self, uri: str, parents: list[str]) -> None:
        if parents[-1:] == ["include"]:
            place = self._path.parent / uri
            self.included += place.glob("*.sdf") if place.is_dir() else [place]
        # Visible meshes are checked when they are read.
        elif "collision" in parents and uri.lower().endswith(".obj"):
            place = self._path.parent / uri
            try:
                if place.is_file():
                    check_obj(place)
            except ValueError as error:
                raise InputError(f"{place}: {error}") from error

    def _refuse_doctype(self, *_: object) -> None:
        raise InputError(f"{self._path}: holds a document type")

    def _refuse(self, fault: str) -> NoReturn:
        element = self._open[-1]
        raise InputError(
            f"{self._path}: line {element.line}: {element.name}: {fault}"
        )
