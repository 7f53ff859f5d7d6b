"""Checks models before Drake parses them.

Without these checks, a text that is not a number or a valid size can have three
effects: libsdformat uses only a part of the text, libsdformat replaces the text
by 1, or Drake crashes the process. Long names crash the process, too.
"""

import math
from pathlib import Path
import re
from typing import NoReturn, cast
from xml.etree import ElementTree

from cns_drake.scene.model_finder import ModelFinder, model_file
from cns_drake.scene.obj_check import check_obj
from cns_drake.scene.surfaces import LARGEST_SIZE
from evaluation.base import (
    Element,
    InputError,
    read_bytes,
    read_elements,
    value_errors,
)

# File name extensions of models.
_MODELS = (".sdf", ".world", ".urdf")
# Versions of SDF that are read. In older ones, elements have other names.
_SDF_VERSIONS = tuple(f"1.{minor}" for minor in range(2, 13))
# Longest name [characters].
_LONGEST_NAME = 1000
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")
# Shape -> element of its size -> how many numbers the element has.
SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "ellipsoid": {"radii": 3},
    "drake:capsule": {"radius": 1, "length": 1},
    "drake:ellipsoid": {"a": 1, "b": 1, "c": 1},
    # A plane without a size is infinite.
    "plane": {"size": 2},
}
# Shapes of a geometry without a size to check.
_OTHER_SHAPES = ("mesh", "heightmap", "polyline", "cone", "empty")
# Parent and tag of other elements that consist of numbers.
_OTHER_NUMBERS = {
    ("mesh", "scale"),
    ("axis", "initial_position"),
    ("axis2", "initial_position"),
    ("model", "scale"),
    *(
        ("material", colour)
        for colour in ("ambient", "diffuse", "specular", "emissive")
    ),
}


def lacks_size(shape: ElementTree.Element) -> bool:
    """Returns whether an SDF shape lacks the element with its size."""
    if shape.tag == "plane" or shape.tag.startswith("drake:"):
        return False
    return any(shape.find(name) is None for name in SIZES.get(shape.tag, ()))


def check_model(path: Path, finder: ModelFinder) -> Element | None:
    """Checks an SDF or URDF file, and the SDF files that it includes.

    Args:
        path: the file.
        finder: finds included models and meshes.

    Returns:
        The root element of the file; None for a file of another kind, which is
        not checked.

    Raises:
        InputError: a file cannot be read, is not XML, or has a version of SDF
            that is not read, an invalid number, an impossible size, two values
            for one element, a name that is too long, or an invalid face in the
            mesh of a collision.
    """
    roots: dict[Path, Element] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file.resolve() in roots or file.suffix.lower() not in _MODELS:
            continue
        check = _ModelCheck(file, finder)
        roots[file.resolve()] = check.root
        waiting += check.included
    return roots.get(path.resolve())


def read_model(path: Path, finder: ModelFinder) -> ElementTree.Element:
    """Returns the root element of a model's file, after `check_model`.

    Raises:
        InputError: see `check_model`.
    """
    root = check_model(path, finder)
    return read_elements(path, encoding="utf-8") if root is None else root


class _ModelCheck:
    """One pass over the elements of a file.

    Attributes:
        root: root element of the file.
        included: files that the file includes.
    """

    def __init__(self, path: Path, finder: ModelFinder):
        self.included: list[Path] = []
        self._path = path
        self._finder = finder
        self.root = read_elements(path, encoding="utf-8")
        self._check_version()
        self._walk(self.root, [])

    def _check_version(self) -> None:
        """Refuses versions of SDF whose elements would not be understood."""
        version = self.root.get("version", _SDF_VERSIONS[-1]).strip()
        is_sdf = self.root.tag in ("sdf", "gazebo")
        if is_sdf and version not in _SDF_VERSIONS:
            first, last = _SDF_VERSIONS[0], _SDF_VERSIONS[-1]
            fault = f"version {version} of SDF is not read, but {first} to"
            self._refuse(self.root, f"{fault} {last}")

    def _walk(self, element: Element, parents: list[str]) -> None:
        for key, value in element.items():
            if len(value) > _LONGEST_NAME:
                self._refuse(element, f"{key} of {len(value)} letters")
        for child in element:
            self._walk(cast(Element, child), [*parents, element.tag])
        if "plugin" not in parents:
            self._check_element(element, parents)

    def _check_element(self, element: Element, parents: list[str]) -> None:
        parent = parents[-1] if parents else ""
        text = element.text or ""
        if parent == "geometry" and element.tag in SIZES:
            self._check_sizes(element)
        elif element.tag == "geometry":
            shapes = [*SIZES, *_OTHER_SHAPES]
            found = [one.tag for one in element if one.tag in shapes]
            # Several polylines are the edges and holes of one shape.
            if len(found) > 1 and set(found) != {"polyline"}:
                fault = f"two shapes, {found[0]} and {found[1]}"
                self._refuse(element, fault)
        elif element.tag == "pose":
            numbers = self._finite_numbers(element, text)
            is_quaternion = element.get("rotation_format") == "quat_xyzw"
            if numbers and len(numbers) != (7 if is_quaternion else 6):
                fault = f"must have {7 if is_quaternion else 6} values"
                self._refuse(element, fault)
            for number in numbers[:3]:
                if abs(number) > LARGEST_SIZE:
                    fault = f"{number:g} is beyond {LARGEST_SIZE:g} m"
                    self._refuse(element, fault)
        elif element.tag == "origin":
            for key in ("xyz", "rpy"):
                self._finite_numbers(element, element.get(key, ""))
        elif (parent, element.tag) == ("plane", "normal"):
            numbers = self._finite_numbers(element, text)
            if len(numbers) != 3 or not any(numbers):
                self._refuse(element, f"{text.strip()} is no direction")
        elif (parent, element.tag) in _OTHER_NUMBERS:
            numbers = self._finite_numbers(element, text)
            if element.tag == "scale" and len(numbers) not in (0, 3):
                self._refuse(element, f"{len(numbers)} numbers, not 3")
        elif element.tag == "uri":
            self._check_uri(text.strip(), parents)

    def _check_sizes(self, shape: Element) -> None:
        for name, count in SIZES[shape.tag].items():
            # The sizes are child elements in SDF, and attributes in URDF.
            texts = [one.text or "" for one in shape.findall(name)]
            if not texts and name in shape.attrib:
                texts = [shape.attrib[name]]
            if not texts:
                urdf = self._path.suffix.lower() == ".urdf"
                if urdf or shape.tag.startswith("drake:"):
                    self._refuse(shape, f"no {name}")
                continue
            if len(texts) > 1:
                self._refuse(shape, f"{name} is there {len(texts)} times")
            numbers = self._finite_numbers(shape, texts[0], f"{name}: ")
            if len(numbers) != count:
                fault = f"{name}: {len(numbers)} numbers, not {count}"
                self._refuse(shape, fault)
            if not all(number > 0.0 for number in numbers):
                size = " ".join(texts[0].split())
                self._refuse(shape, f"{name}: {size} is not a valid size")

    def _finite_numbers(
        self, element: Element, text: str, where: str = ""
    ) -> list[float]:
        """Returns the numbers in a text; InputError if one is not finite."""
        numbers = []
        for word in text.split():
            number = float(word) if _NUMBER.fullmatch(word) else math.nan
            if not math.isfinite(number):
                self._refuse(element, f"{where}{word} is no number")
            numbers.append(number)
        return numbers

    def _check_uri(self, uri: str, parents: list[str]) -> None:
        is_included = parents[-1:] == ["include"]
        # Visible meshes are checked when they are read.
        is_collision = "collision" in parents and uri.lower().endswith(".obj")
        if not (is_included or is_collision):
            return
        place = self._finder.find(uri, self._path.absolute().parent)
        file = None if place is None else model_file(place)
        if file is not None and is_included:
            self.included.append(file)
        elif file is not None and file.is_file():
            with value_errors(file):
                check_obj(read_bytes(file))

    def _refuse(self, element: Element, fault: str) -> NoReturn:
        raise InputError(
            f"{self._path}: line {element.line}: {element.tag}: {fault}"
        )
