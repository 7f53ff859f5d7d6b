"""Finds faults in OBJ files that Drake would misread or on which it crashes."""

import codecs
from collections import Counter
from collections.abc import Iterator
import contextlib
from pathlib import Path
import re
import tempfile
from typing import NamedTuple

import numpy as np

from evaluation.base import read_bytes, user_errors

# Statements of OBJ that are read, or that show nothing.
_READ = (
    "v", "vt", "vn", "f", "o", "g", "s", "mg", "usemtl", "mtllib", "maplib",
    "usemap", "bevel", "c_interp", "d_interp", "lod", "shadow_obj",
    "trace_obj", "end",
)  # fmt: skip
# Statements of OBJ with points and lines, which a note counts.
_NOTED = ("p", "l")
# Statements of OBJ with surfaces, or that change what others mean.
_REFUSED = (
    "fo", "surf", "curv", "curv2", "cstype", "deg", "bmat", "step", "parm",
    "trim", "hole", "scrv", "sp", "con", "vp", "call", "csh", "bsp", "bzp",
    "cdc", "cdp", "res", "ctech", "stech",
)  # fmt: skip
# A statement that is not among the usual ones, of which a file has thousands.
_STATEMENT = re.compile(
    rb"^[ \t]*(?!(?:vn?|vt|f|o|g|usemtl|mtllib)[ \t\n])"
    rb"([A-Za-z_]\w*)(?=[ \t\n]|\Z)",
    re.MULTILINE,
)
# If a face refers to a missing vertex, Drake's reader reads outside its memory
# and may end the process.
_VERTEX = re.compile(rb"^[ \t]*v[ \t]([^\n#]*)", re.MULTILINE)
# Drake's reader takes what it cannot read in a vertex for 0.
_NUMBER = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_NO_VERTEX = re.compile(
    rb"^[ \t]*v[ \t](?![ \t]*(?:(?:" + _NUMBER + rb"(?:[ \t]+|(?=[\n#]|\Z)))"
    # With a weight of 1, or with a colour.
    rb"{3}(?:1(?:\.0*)?[ \t]*|(?:" + _NUMBER + rb"[ \t]*){3})?)(?:[\n#]|\Z))",
    re.MULTILINE,
)
_FACE = re.compile(rb"^[ \t]*f[ \t]([^\n#]*)", re.MULTILINE)
# A ray caster needs neither texture coordinates nor normals, but Drake checks
# them.
_OTHER_INDICES = re.compile(rb"/[^\s]*")
_NO_INDICES = re.compile(rb"[^-\d\s]|\d-|\d{10}")


@contextlib.contextmanager
def unmarked(path: Path) -> Iterator[Path]:
    """Gives a file, or for a while a copy without its byte order mark.

    Neither Drake nor Open3D reads the line behind a mark.

    Raises:
        InputError: the file cannot be read.
    """
    with user_errors(path), open(path, "rb") as stream:
        is_marked = stream.read(len(codecs.BOM_UTF8)) == codecs.BOM_UTF8
    if not is_marked:
        yield path
        return
    content = read_bytes(path)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"mesh{path.suffix.lower()}"
        copy.write_bytes(content.removeprefix(codecs.BOM_UTF8))
        yield copy


class ObjFaces(NamedTuple):
    """The faces of a valid OBJ file.

    Attributes:
        notes: what is not read, such as lines; one note for each kind.
        num_triangles: number of triangles into which the faces can be divided.
        box: least and greatest coordinates of the vertices, in that order; None
            if there are no vertices, or if they have more than coordinates.
    """

    notes: tuple[str, ...]
    num_triangles: int
    box: np.ndarray | None


def check_obj(content: bytes) -> ObjFaces:
    """Checks the content of an OBJ file.

    Raises:
        ValueError: a face has a vertex that does not exist, a vertex is not
            made of numbers, or there are surfaces other than faces. The message
            names the line or the statement.
    """
    # Drake accepts carriage returns as line ends, too.
    content = content.replace(b"\r", b"\n")
    if content.startswith(codecs.BOM_UTF8):
        raise ValueError("begins with a byte order mark; save it without")
    counts = _count_ignored(content)
    if found := _NO_VERTEX.search(content):
        number = content.count(b"\n", 0, found.start()) + 1
        raise ValueError(
            f"line {number}: a vertex that is not three numbers, alone or with"
            " a weight of 1 or a colour"
        )
    vertices = _VERTEX.findall(content)
    num_vertices = len(vertices)
    rows = _FACE.findall(content)
    faces = b" \n".join(rows)
    if b"/" in faces:
        faces = _OTHER_INDICES.sub(b"", faces)
    if not _are_valid_indices(faces, num_vertices):
        raise ValueError(_fault_of_a_face(content, num_vertices))
    corners = [len(row.split()) for row in rows]
    if short := sum(number < 3 for number in corners):
        counts["faces of OBJ with fewer than three corners ignored"] = short
    return ObjFaces(
        tuple(f"{count} {what}" for what, count in sorted(counts.items())),
        sum(max(number - 2, 0) for number in corners),
        _box_of(vertices),
    )


def _box_of(vertices: list[bytes]) -> np.ndarray | None:
    """Returns the box of the vertices that lines describe; see `ObjFaces`."""
    numbers = np.fromstring(b" ".join(vertices), sep=" ")
    if len(numbers) != 3 * len(vertices) or not vertices:
        return None
    corners = numbers.reshape(-1, 3)
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    box.setflags(write=False)
    return box


def _count_ignored(content: bytes) -> Counter[str]:
    """Counts the statements of an OBJ file that are not read, by their kind.

    Raises:
        ValueError: there are surfaces other than faces; the message names the
            statement.
    """
    counts: Counter[str] = Counter()
    for word, count in Counter(_STATEMENT.findall(content)).items():
        name = word.decode("ascii", "replace")
        if name in _REFUSED:
            raise ValueError(
                f"has the statement '{name}' of OBJ, which is not read; export"
                " it with faces"
            )
        if name in _NOTED:
            counts["points or lines of OBJ ignored"] += count
        elif name not in _READ:
            counts[f"statements '{name}' of OBJ ignored"] += count
    return counts


def _fault_of_a_face(content: bytes, num_vertices: int) -> str:
    """Returns what is wrong with the first face that is not valid."""
    for number, line in enumerate(content.split(b"\n"), start=1):
        face = _FACE.match(line)
        indices = _OTHER_INDICES.sub(b"", face[1]) if face else b""
        if indices.rstrip().endswith(b"\\"):
            return (
                f"line {number}: a face that goes on in the next line, which is"
                " not read; write it in one line"
            )
        if not _are_valid_indices(indices, num_vertices):
            return (
                f"line {number}: a face has a vertex that is not there (of"
                f" {num_vertices})"
            )
    raise AssertionError  # One of the lines has the fault.


def _are_valid_indices(text: bytes, num_vertices: int) -> bool:
    """Returns whether all numbers in a text are indices of vertices.

    Indices count from 1, or from -1 backwards.
    """
    if not text.strip():
        return True
    if _NO_INDICES.search(text):
        return False
    values = np.fromstring(text, dtype=np.int64, sep=" ")
    return bool(((values != 0) & (np.abs(values) <= num_vertices)).all())
