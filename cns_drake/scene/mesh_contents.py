"""Finds contents of mesh files that Open3D and Drake ignore.

Open3D reads glTF, COLLADA, STL and PLY, and Drake reads OBJ. Both programs read
some files only in part, without a warning. This module refuses such a file if
surfaces would be missing. Specification of glTF:
https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from collections import Counter
from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
from pathlib import Path
import re
import struct
from typing import Any

import numpy as np

from cns_drake.base.files import read_bytes
from cns_drake.base.json_text import parse_json
from cns_drake.base.repetitions import repeated

_LIMIT_BYTES = 1 << 28
# File name extensions of glTF.
GLTF = (".gltf", ".glb")
# Prefixes of glTF extensions that do not change shapes.
_HARMLESS = (
    "KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
    "ADOBE_materials_", "KHR_lights_", "EXT_lights_", "KHR_techniques_",
    "KHR_xmp", "KHR_audio", "KHR_animation_pointer", "MSFT_packing_",
    "EXT_mesh_features", "EXT_structural_metadata", "EXT_feature_metadata",
    "EXT_mesh_manifold", "KHR_physics", "KHR_implicit_shapes",
)  # fmt: skip
# glTF extensions that change shapes even where they are not required.
_CHANGING = (
    "EXT_mesh_gpu_instancing", "EXT_instance_features", "KHR_node_visibility",
    "KHR_mesh_quantization",
)  # fmt: skip
# Elements of COLLADA that would move or add shapes, and are not read.
_COLLADA = {
    re.compile(rb"<instance_controller\b"): "skins or morphs of COLLADA",
    re.compile(rb"<animation\b"): "animations of COLLADA",
    re.compile(rb"<(?:lines|linestrips|spline)\b"): "lines of COLLADA",
}
# Elements of COLLADA with surfaces that are not read.
_COLLADA_SURFACES = re.compile(rb"<(brep|convex_mesh)\b")
_FLOAT = 5126
# Modes of primitives below this number (points and lines) have no triangles.
_FIRST_TRIANGLES = 4
# Greatest mode of a primitive.
_LAST_TRIANGLES = 6
# Type of a chunk of JSON.
_JSON = 0x4E4F534A


def check_mesh_file(path: Path) -> tuple[str, ...]:
    """Checks a mesh file; returns notes on what is not read, such as lines.

    There is one note for each kind of content that is not read. The tuple is
    empty if everything is read.

    Raises:
        ValueError: the shapes in the file would be misread.
        InputError: the file cannot be read.
    """
    ending = path.suffix.lower()
    if ending in GLTF:
        return check_gltf(path)
    if ending == ".ply":
        return _check_ply(path)
    if ending == ".stl":
        _check_stl(read_bytes(path, _LIMIT_BYTES))
    if ending != ".dae":
        return ()
    content = read_bytes(path, _LIMIT_BYTES)
    if found := _COLLADA_SURFACES.search(content):
        raise ValueError(
            f"has <{found[1].decode()}> of COLLADA, which is not read; export"
            " it with triangles"
        )
    counts = {what: len(one.findall(content)) for one, what in _COLLADA.items()}
    return tuple(f"{n} {what} ignored" for what, n in counts.items() if n)


def check_gltf(path: Path) -> tuple[str, ...]:
    """Returns notes on ignored content of a glTF file, one for each kind.

    The file can be text (`.gltf`) or binary (`.glb`).

    Raises:
        ValueError: the file is not glTF, or its shapes would be misread; the
            message names the required features.
        InputError: the file cannot be read.
    """
    content = read_bytes(path, _LIMIT_BYTES)
    try:
        if content[:4] == b"glTF":
            length, kind = struct.unpack_from("<II", content, 12)
            if kind != _JSON:
                raise ValueError("no JSON at its beginning")
            content = content[20 : 20 + length]
        top = parse_json(content)
        required = _names(top, "extensionsRequired")
        used = _names(top, "extensionsUsed")
        primitives = [p for m in top.get("meshes", []) for p in m["primitives"]]
        accessors = top.get("accessors", [])
        positions = [
            accessors[p["attributes"]["POSITION"]]
            for p in primitives
            if "POSITION" in p["attributes"]
        ]
        modes = [p.get("mode", _FIRST_TRIANGLES) for p in primitives]
        has_other_mode = any(not 0 <= m <= _LAST_TRIANGLES for m in modes)
        nodes = top.get("nodes", [])
        counts = _unread(top, nodes, primitives)
        are_floats = all(one["componentType"] == _FLOAT for one in positions)
    except (
        AttributeError, LookupError, RecursionError, TypeError, struct.error
    ) as error:  # fmt: skip
        raise ValueError(f"no valid glTF ({type(error).__name__})") from error
    unread = [name for name in required if not name.startswith(_HARMLESS)]
    unread += [name for name in used if name in _CHANGING]
    if unread:
        raise ValueError(
            f"needs the extension {unread[0]} of glTF, which is not read;"
            " export it without"
        )
    if has_other_mode:
        raise ValueError("has a primitive whose mode is none of glTF")
    if not are_floats:
        raise ValueError(
            "has vertices that are no floats (KHR_mesh_quantization), which"
            " are not read; export it without"
        )
    return tuple(f"{number} {what}" for what, number in counts.items())


def _names(top: Any, key: str) -> list[str]:
    return [str(name) for name in top.get(key, [])]


def _unread(top: Any, nodes: list[Any], primitives: list[Any]) -> Counter[str]:
    """Counts what would move or add shapes, but is not read."""
    meshes = top.get("meshes", [])
    counts = Counter(
        {
            "skins of glTF ignored": sum("skin" in one for one in nodes),
            "weights of morph targets in glTF ignored": sum(
                any(one.get("weights", [])) for one in [*nodes, *meshes]
            ),
            "animations of glTF ignored": len(top.get("animations", [])),
            "points or lines of glTF ignored": sum(
                p.get("mode", _FIRST_TRIANGLES) < _FIRST_TRIANGLES
                for p in primitives
            ),
            "see-through materials of glTF taken as solid": sum(
                one.get("alphaMode", "OPAQUE") != "OPAQUE"
                for one in top.get("materials", [])
            ),
            "further scenes of glTF ignored": len(top.get("scenes", [0])) - 1,
        }
    )
    return +counts


# Elements of PLY that are no shapes.
_PLY_OTHER = ("vertex", "face", "camera", "material")
_HEADER_LIMIT_BYTES = 1 << 16
_CORNERS = 3


# Type of a number in PLY -> its type in NumPy.
_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2",
    "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_PLY_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class _PlyElement:
    """An element of a PLY header.

    Attributes:
        name: name of the element.
        count: number of its rows.
        properties: name and type of each value of a row. A list has two types,
            those of its length and of its values.
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


def _check_ply(path: Path) -> tuple[str, ...]:
    """Returns notes on ignored elements of a PLY file, one for each kind.

    Raises:
        ValueError: surfaces in the file would not be read, such as triangle
            strips, or be wrong.
    """
    content = read_bytes(path, _LIMIT_BYTES)
    head, found, body = content.partition(b"end_header")
    if not found or len(head) > _HEADER_LIMIT_BYTES:
        return ()  # Open3D says what is wrong.
    elements: list[_PlyElement] = []
    encoding = ""
    for line in head.decode("ascii", "replace").splitlines():
        match line.split():
            case ["format", encoding, *_]:
                pass
            case ["element", name, count] if count.isdecimal():
                elements.append(_PlyElement(name, int(count), []))
            case ["property", "list", *types, name] if elements:
                elements[-1].properties.append((name, tuple(types)))
            case ["property", kind, name] if elements:
                elements[-1].properties.append((name, (kind,)))
    for name in repeated(one.name for one in elements):
        raise ValueError(f"has the element {name} of PLY twice; export it once")
    notes = []
    for one in elements:
        faces = one.faces
        if one.name == "face" and len(faces) > 1:
            raise ValueError(
                f"has two lists of vertices in each face, {' and '.join(faces)}"
            )
        if one.name in _PLY_OTHER or one.count == 0:
            continue
        if faces:
            raise ValueError(
                f"has surfaces in the element {one.name} of PLY, which is not"
                " read; export it with faces"
            )
        notes.append(f"{one.count} elements {one.name} of PLY ignored")
    # A row ends the header, by either line end.
    _, _, body = body.partition(b"\n")
    least = _CORNERS
    # Open3D refuses damaged files itself.
    with contextlib.suppress(
        LookupError, OverflowError, ValueError, struct.error
    ):
        least = _least_corners(elements, encoding, body)
    if least < _CORNERS:
        # Open3D would read its corners from beyond the list.
        raise ValueError(f"has a face of PLY with {least} corners")
    return tuple(notes)


def _least_corners(
    elements: Sequence[_PlyElement], encoding: str, body: bytes
) -> int:
    """Returns the least number of corners of a face in a PLY file.

    Raises:
        LookupError, OverflowError, ValueError, struct.error: the faces are
            behind other lists, or the file is damaged.
    """
    names = [one.name for one in elements]
    k = names.index("face")
    face, before = elements[k], elements[:k]
    kinds = [types for _, types in face.properties]
    (at,) = [i for i, types in enumerate(kinds) if len(types) > 1]
    if encoding == "ascii":
        first = sum(one.count for one in before)
        rows = body.split(b"\n", first + face.count)[first:]
        rows = rows[: face.count]
        return min(int(row.split(None, at + 1)[at]) for row in rows)
    order = _PLY_ORDERS[encoding]
    sizes = [np.dtype(_PLY_TYPES[kind[0]]).itemsize for kind in kinds]
    place = sum(
        one.count * np.dtype(_PLY_TYPES[kind]).itemsize
        for one in before
        for _, (kind,) in one.properties
    )
    number = struct.Struct(order + np.dtype(_PLY_TYPES[kinds[at][0]]).char)
    each = np.dtype(_PLY_TYPES[kinds[at][1]]).itemsize
    ahead, other = sum(sizes[:at]), sum(sizes)
    least = _CORNERS
    for _ in range(face.count):
        (corners,) = number.unpack_from(body, place + ahead)
        least = min(least, corners)
        place += other + each * corners
    return least


_STL_HEADER_BYTES = 84
_STL_FACET_BYTES = 50
_STL_WORDS = re.compile(rb"^[ \t]*(vertex|endfacet|endsolid)\b", re.M | re.I)


def _check_stl(content: bytes) -> None:
    """Checks that a text in STL is whole, and that all facets are triangles.

    A binary file has its length in its header, which its reader checks.

    Raises:
        ValueError: it ends within a solid, or a facet has more corners.
    """
    if len(content) >= _STL_HEADER_BYTES:
        (number,) = struct.unpack_from("<I", content, _STL_HEADER_BYTES - 4)
        if len(content) == _STL_HEADER_BYTES + _STL_FACET_BYTES * number:
            return
    if content[:5].lower() != b"solid":
        return
    words = [word.lower() for word in _STL_WORDS.findall(content)]
    counts = Counter(words)
    if words[-1:] != [b"endsolid"]:
        raise ValueError("ends within a solid of STL; the file is not complete")
    if counts[b"vertex"] != 3 * counts[b"endfacet"]:
        raise ValueError(
            f"has {counts[b'vertex']} vertices in {counts[b'endfacet']} facets"
            " of STL; all facets must be triangles"
        )


# Statements of OBJ with surfaces that are not read.
_OBJ_SURFACES = re.compile(
    rb"^[ \t]*(fo|surf|call|bsp|bzp|cdc|cdp|res)[ \t]", re.MULTILINE
)
# If a face refers to a missing vertex, Drake's reader reads outside its memory
# and may end the process.
_VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)
# Drake's reader takes what it cannot read in a vertex for 0.
_NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NO_VERTEX = re.compile(
    rb"^[ \t]*v[ \t](?![ \t]*(?:" + _NUMBER + rb"(?:[ \t]+|(?=[\n#]|\Z))){3,8}"
    rb"(?:[\n#]|\Z))",
    re.MULTILINE,
)
_FACE = re.compile(rb"^[ \t]*f[ \t]([^\n#]*)", re.MULTILINE)
# A ray caster needs neither texture coordinates nor normals, but Drake checks
# them.
_OTHER_INDICES = re.compile(rb"/[^\s]*")
_NO_INDICES = re.compile(rb"[^-\d\s]|\d-|\d{10}")


def check_obj(path: Path) -> None:
    """Checks that the faces of an OBJ file only use vertices that exist.

    Raises:
        ValueError: a vertex does not exist, or is not made of numbers; or there
            are surfaces other than faces. The message names the line or the
            statement.
        InputError: the file cannot be read.
    """
    # Drake accepts both as line ends.
    content = read_bytes(path, _LIMIT_BYTES).replace(b"\r", b"\n")
    if found := _OBJ_SURFACES.search(content):
        raise ValueError(
            f"has the statement '{found[1].decode()}' of OBJ, which is not"
            " read; export it with faces"
        )
    if found := _NO_VERTEX.search(content):
        number = content.count(b"\n", 0, found.start()) + 1
        raise ValueError(f"line {number}: a vertex that is not three numbers")
    num_vertices = len(_VERTEX.findall(content))
    faces = b" \n".join(_FACE.findall(content))
    if b"/" in faces:
        faces = _OTHER_INDICES.sub(b"", faces)
    if _are_indices(faces, num_vertices):
        return
    for number, line in enumerate(content.split(b"\n"), start=1):
        face = _FACE.match(line)
        indices = _OTHER_INDICES.sub(b"", face[1]) if face else b""
        if indices.rstrip().endswith(b"\\"):
            raise ValueError(
                f"line {number}: a face that goes on in the next line, which is"
                " not read; write it in one line"
            )
        if not _are_indices(indices, num_vertices):
            raise ValueError(
                f"line {number}: a face has a vertex that is not there (of"
                f" {num_vertices})"
            )


def _are_indices(text: bytes, num_vertices: int) -> bool:
    """Returns whether a text has valid vertex indices, from 1 or from -1."""
    if not text.strip():
        return True
    if _NO_INDICES.search(text):
        return False
    values = np.fromstring(text, dtype=np.int64, sep=" ")
    return bool(((values != 0) & (np.abs(values) <= num_vertices)).all())
