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


def check_obj(path: Path) -> None:
    """Refuses an OBJ file with a face that names missing vertices.

    Args:
        path: an existing file.

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
    if _are_indices(faces, num_vertices):
        return
    for number, line in enumerate(content.split(b"\n"), start=1):
        face = _FACE.match(line)
        indices = _OTHER_INDICES.sub(b"", face[1]) if face else b""
        if not _are_indices(indices, num_vertices):
            raise ValueError(
                f"line {number}: a face has a vertex that is not there (of"
                f" {num_vertices})"
            )


def _are_indices(text: bytes, num_vertices: int) -> bool:
    """Returns whether a text has valid vertex numbers, from 1 or from -1."""
    if not text.strip():
        return True
    if _NO_INDICES.search(text):
        return False
    values = np.fromstring(text, dtype=np.int64, sep=" ")
    return bool(((values != 0) & (np.abs(values) <= num_vertices)).all())
