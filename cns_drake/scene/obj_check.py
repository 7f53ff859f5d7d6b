"""Checks the faces of OBJ files before Drake reads them.

For a face with a missing vertex, Drake's reader reads foreign memory, and may
end the process.
"""

from __future__ import annotations

from pathlib import Path
import re

import numpy as np

from cns_drake.base.files import read_bytes

_LIMIT_BYTES = 1 << 28
_VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)
_FACE = re.compile(rb"^[ \t]*f[ \t]([^\n#]*)", re.MULTILINE)
# A ray caster needs neither texture nor normals; Drake checks them.
_OTHER_INDICES = re.compile(rb"/[^\s]*")
_NO_INDICES = re.compile(rb"[^-\d\s]|\d-|\d{10}")


def check_obj(path: Path) -> np.ndarray:
    """Refuses an OBJ file with a face that names missing vertices.

    Args:
        path: an existing file.

    Returns:
        The vertices of all faces, one face after the other, as they are
        numbered in the file.

    Raises:
        ValueError: if so; it names the line.
        InputError: if it cannot be read.
    """
    # Drake ends a line at either.
    content = read_bytes(path, _LIMIT_BYTES).replace(b"\r", b"\n")
    num_vertices = len(_VERTEX.findall(content))
    faces = b" \n".join(_FACE.findall(content))
    if b"/" in faces:
        faces = _OTHER_INDICES.sub(b"", faces)
    values = _indices(faces)
    if _are_indices(values, num_vertices):
        return values
    for number, line in enumerate(content.split(b"\n"), start=1):
        face = _FACE.match(line)
        indices = _OTHER_INDICES.sub(b"", face[1]) if face else b""
        if not _are_indices(_indices(indices), num_vertices):
            raise ValueError(
                f"line {number}: a face has a vertex that is not there (of"
                f" {num_vertices})"
            )
    return values


def _indices(text: bytes) -> np.ndarray:
    """Returns the numbers of a text; a single 0 if it has anything else."""
    if not text.strip():
        return np.zeros(0, dtype=np.int64)
    if _NO_INDICES.search(text):
        return np.zeros(1, dtype=np.int64)
    return np.fromstring(text, dtype=np.int64, sep=" ")


def _are_indices(values: np.ndarray, num_vertices: int) -> bool:
    """Returns whether numbers are those of vertices, from 1 or from -1."""
    return bool(((values != 0) & (np.abs(values) <= num_vertices)).all())
