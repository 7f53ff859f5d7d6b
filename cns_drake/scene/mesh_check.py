"""Checks mesh files for contents that their readers misread or leave out.

Open3D reads glTF, COLLADA, STL and PLY. Some files are read only in part,
without a warning. This module refuses such a file if surfaces would be missing,
and files of all other formats.
"""

import codecs
from collections import Counter
from pathlib import Path
import re
import struct

import numpy as np

from cns_drake.scene.collada_check import check_collada
from cns_drake.scene.gltf_check import check_gltf
from cns_drake.scene.obj_check import unmarked
from cns_drake.scene.obj_files import ObjFiles
from cns_drake.scene.ply_check import check_ply
from evaluation.base import read_bytes

# File name extensions of glTF.
GLTF = (".gltf", ".glb")
_STL_HEADER_BYTES = 84
_STL_FACET_BYTES = 50
_STL_VERTEX = re.compile(rb"^[ \t]*vertex\b(.*)", re.M | re.I)
_STL_WORDS = re.compile(rb"^[ \t]*(vertex|endfacet|endsolid)\b", re.M | re.I)


def check_mesh_file(path: Path, objs: ObjFiles) -> tuple[str, ...]:
    """Checks a mesh file; returns notes on what is not read, such as lines.

    There is one note for each kind of content that is not read. The tuple is
    empty if everything is read.

    Raises:
        ValueError: the format is not read, or the shapes in the file would be
            misread.
        InputError: the file cannot be read.
    """
    ending = path.suffix.lower()
    if ending == ".obj":
        return objs.faces(path).notes
    if ending == ".dae":
        with unmarked(path) as file:
            return check_collada(file)
    if ending not in _CHECKS:
        formats = " ".join([*_CHECKS, ".dae", ".obj"])
        raise ValueError(
            f"is no mesh of a format that is read ({formats}); Blender or"
            " trimesh writes these"
        )
    content = read_bytes(path)
    return _CHECKS[ending](content.removeprefix(codecs.BOM_UTF8))


def _check_stl(content: bytes) -> tuple[()]:
    """Checks that a text file of STL is whole, and has only triangles.

    Open3D itself checks the length of a binary file, which the header states.

    Returns:
        No notes: all contents of STL are read.

    Raises:
        ValueError: the text ends within a solid, or a facet has more than three
            corners.
    """
    if not _is_stl_text(content):
        return ()
    words = [word.lower() for word in _STL_WORDS.findall(content)]
    counts = Counter(words)
    if words[-1:] != [b"endsolid"]:
        raise ValueError("ends within a solid of STL; the file is not complete")
    if counts[b"vertex"] != 3 * counts[b"endfacet"]:
        raise ValueError(
            f"has {counts[b'vertex']} vertices in {counts[b'endfacet']} facets"
            " of STL; all facets must be triangles"
        )
    return ()


def stl_corners(content: bytes) -> np.ndarray | None:
    """Returns the corners of a text file of STL in full precision.

    Open3D would read them in single precision.

    Returns:
        (N, 3) float64 [m], three for each facet; None if the file is binary.

    Raises:
        ValueError: a corner is not three numbers.
    """
    if not _is_stl_text(content):
        return None
    rows = _STL_VERTEX.findall(content)
    try:
        numbers = np.array(b" ".join(rows).split()).astype(float)
        return numbers.reshape(len(rows), 3)
    except ValueError:
        raise ValueError(
            "has a vertex of STL that is not three numbers"
        ) from None


def _is_stl_text(content: bytes) -> bool:
    if len(content) >= _STL_HEADER_BYTES:
        (number,) = struct.unpack_from("<I", content, _STL_HEADER_BYTES - 4)
        if len(content) == _STL_HEADER_BYTES + _STL_FACET_BYTES * number:
            return False
    return content[:5].lower() == b"solid"


# File name extension -> function that checks the contents of a file.
_CHECKS = {
    **dict.fromkeys(GLTF, check_gltf),
    ".ply": check_ply,
    ".stl": _check_stl,
}
