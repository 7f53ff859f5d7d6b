"""Reads the surfaces of meshes, from files or from memory.

Open3D reads glTF and COLLADA files. They are first checked for content that
Open3D would misread. Specification of glTF:
https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from collections import Counter
from collections.abc import Sequence
import functools
from itertools import pairwise
from pathlib import Path
import re
import struct
import tempfile
from typing import Any

import numpy as np
from pydrake.geometry import (
    Convex,
    Mesh,
    MeshSource,
    ReadObjToTriangleSurfaceMesh,
    RefineVolumeMeshIntoVtkFileContents,
)

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.base.json_text import parse_json
from cns_drake.scene.drake_errors import PARSER_ERRORS, collected_errors
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.surfaces import LARGEST_SIZE, TriangleSurface

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
    re.compile(rb"<(?:lines|linestrips)\b"): "lines of COLLADA",
}
_FLOAT = 5126
# Modes of primitives below this number (points and lines) have no triangles.
_FIRST_TRIANGLES = 4
_JSON = 0x4E4F534A


def unread_parts(path: Path) -> tuple[str, ...]:
    """Returns notes on what is not read from a mesh file, such as lines.

    There is one note for each kind of content that is not read. The tuple is
    empty if everything is read.

    Raises:
        ValueError: the shapes in the file would be misread.
        InputError: the file cannot be read.
    """
    ending = path.suffix.lower()
    if ending in GLTF:
        return check_gltf(path)
    if ending != ".dae":
        return ()
    content = read_bytes(path, _LIMIT_BYTES)
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


_LIMIT_BYTES = 1 << 28
# If a face refers to a missing vertex, Drake's reader reads outside its memory
# and may end the process.
_VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)
_FACE = re.compile(rb"^[ \t]*f[ \t]([^\n#]*)", re.MULTILINE)
# A ray caster needs neither texture coordinates nor normals, but Drake checks
# them.
_OTHER_INDICES = re.compile(rb"/[^\s]*")
_NO_INDICES = re.compile(rb"[^-\d\s]|\d-|\d{10}")


def check_obj(path: Path) -> None:
    """Checks that faces of an OBJ file only use vertices that exist.

    Raises:
        ValueError: a vertex does not exist; the message names the line.
        InputError: the file cannot be read.
    """
    # Drake accepts both as line ends.
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
    """Returns whether a text has valid vertex indices, from 1 or from -1."""
    if not text.strip():
        return True
    if _NO_INDICES.search(text):
        return False
    values = np.fromstring(text, dtype=np.int64, sep=" ")
    return bool(((values != 0) & (np.abs(values) <= num_vertices)).all())


# The faces of a tetrahedron, counter-clockwise seen from outside. This holds if
# its first three vertices are counter-clockwise, seen from the fourth.
_FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def read_vtk(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Returns the boundary surface of a volume mesh in a VTK file.

    Returns:
        Vertices (N, 3), float64 [m], including inner ones, and triangles (M,
        3), int32.

    Raises:
        RuntimeError: Drake cannot read the file.
    """
    # Drake's reader converts all dialects of VTK to the one that Drake writes.
    words = RefineVolumeMeshIntoVtkFileContents(MeshSource(path)).split()
    vertices = _block(words, "POINTS", 3, 3).astype(float)
    cells = _block(words, "CELLS", 3, 5).astype(np.int32)[:, 1:]
    faces = cells[:, _FACES].reshape(-1, 3)
    # A face between two tetrahedra occurs twice.
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return vertices, faces[np.sort(first[count == 1])]


def _block(
    words: Sequence[str], keyword: str, header: int, columns: int
) -> np.ndarray:
    """Returns the rows of numbers behind a keyword and its header."""
    at = words.index(keyword)
    rows, begin = int(words[at + 1]), at + header
    block = np.array(words[begin : begin + rows * columns])
    return block.reshape(rows, columns)


# Formats whose y axis points up. Drake rotates them so that z does.
_Y_UP = (*GLTF, ".dae")
# Larger files are parsed again each time, so that they do not stay in memory.
_SMALL_BYTES = 1 << 18


class MeshFiles:
    """Reads mesh files, each only once.

    All geometries with the same mesh at the same scale share one surface.
    """

    def __init__(self, foreign: ForeignMeshes):
        self._foreign = foreign
        self._unscaled: dict[object, TriangleSurface] = {}
        self._surfaces: dict[tuple, TriangleSurface] = {}

    def read(self, name: str, shape: Mesh | Convex) -> TriangleSurface:
        """Returns the surface of a mesh shape in the geometry's frame G.

        Raises:
            InputError: the mesh is missing, cannot be read, or is too large;
                the message names the geometry.
        """
        key = mesh_shape_key(shape)
        if key in self._surfaces:
            return self._surfaces[key]
        try:
            with collected_errors():  # The error alone is enough.
                surface = (
                    _read_hull(shape)
                    if isinstance(shape, Convex)
                    else self._read_mesh(shape)
                )
            # The comparison is False for NaN.
            if not np.abs(surface.p_GVset).max() <= LARGEST_SIZE:
                raise ValueError(f"larger than {LARGEST_SIZE:g} m")
        except PARSER_ERRORS as error:
            source, fault = shape.source(), " ".join(str(error).split())
            file = f"{source.path()}: " if source.is_path() else ""
            raise InputError(f"{file}geometry '{name}': {fault}") from error
        self._surfaces[key] = surface
        return surface

    def _read_mesh(self, shape: Mesh) -> TriangleSurface:
        source = shape.source()
        key = _source_key(source)
        surface = self._unscaled.get(key)
        if surface is None:
            surface = self._unscaled[key] = self._read_source(source)
        triangles = surface.triangles
        scale = shape.scale3()
        if np.prod(scale) < 0.0:  # Mirroring turns faces inside out.
            triangles = triangles[:, ::-1]
        with np.errstate(over="ignore", invalid="ignore"):
            return TriangleSurface(surface.p_GVset * scale, triangles)

    def _read_source(self, source: MeshSource) -> TriangleSurface:
        if source.is_path():
            return self._read_file(Path(source.path()))
        # Open3D can only read files.
        mesh = source.in_memory()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"mesh{source.extension()}")
            path.write_bytes(mesh.mesh_file.contents())
            for uri, file in mesh.supporting_files.items():
                target = Path(folder, uri)
                if not target.resolve().is_relative_to(Path(folder).resolve()):
                    raise ValueError(
                        f"the file '{uri}', which it names, is not beside the "
                        "mesh"
                    )
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(
                    file.read_bytes()
                    if isinstance(file, Path)
                    else file.contents()
                )
            return self._read_file(path)

    def _read_file(self, path: Path) -> TriangleSurface:
        if not path.is_file():
            raise ValueError("no such mesh file")
        ending = path.suffix.lower()
        if ending in GLTF:
            check_gltf(path)
        p_GVset, triangles = _READERS.get(ending, self._foreign.read)(path)
        if len(triangles) == 0:
            raise ValueError("holds no triangles")
        # Drake only warns; a ray caster would read outside its memory.
        if not 0 <= triangles.min() <= triangles.max() < len(p_GVset):
            raise ValueError("a face has a vertex that is not there")
        if ending in _Y_UP:
            x, y, z = p_GVset.T
            p_GVset = np.stack([x, -z, y], axis=1)
        return TriangleSurface(p_GVset, triangles)


def mesh_shape_key(shape: Mesh | Convex) -> tuple:
    """Returns a dictionary key for a mesh or convex hull.

    Two keys are equal only if the shapes are equal.
    """
    return type(shape), _source_key(shape.source()), tuple(shape.scale3())


def _source_key(source: MeshSource) -> object:
    """Returns a key that is equal only for sources of the same mesh."""
    if source.is_path():
        return str(source.path())
    mesh = source.in_memory()
    files = {"": mesh.mesh_file, **mesh.supporting_files}
    return tuple(
        (uri, f if isinstance(f, Path) else f.sha256().to_string())
        for uri, f in sorted(files.items())
    )


def _read_hull(shape: Convex) -> TriangleSurface:
    """Returns Drake's convex hull, with the scale applied."""
    source = shape.source()
    if source.is_path() and source.extension() in GLTF:
        check_gltf(Path(source.path()))
    hull = shape.GetConvexHull()
    vertices = [hull.vertex(k) for k in range(hull.num_vertices())]
    triangles = []
    for k in range(hull.num_faces()):
        face = hull.element(k)
        corners = [face.vertex(i) for i in range(face.num_vertices())]
        for second, third in pairwise(corners[1:]):
            triangles.append((corners[0], second, third))
    return TriangleSurface(
        np.array(vertices, dtype=float), np.array(triangles, dtype=np.int32)
    )


def _read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    status = path.stat()
    if status.st_size > _SMALL_BYTES:
        return _parse_obj(path)
    return _parse_small_obj(
        path, (status.st_size, status.st_mtime_ns, status.st_ino)
    )


@functools.lru_cache(maxsize=4096)
def _parse_small_obj(
    path: Path, identity: tuple[int, int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices and triangles of a file, from a cache.

    The stages of a city share most of their files.
    """
    p_GVset, triangles = _parse_obj(path)
    for array in (p_GVset, triangles):
        array.setflags(write=False)
    return p_GVset, triangles


def _parse_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    check_obj(path)
    mesh = ReadObjToTriangleSurfaceMesh(path)
    triangles = [[t.vertex(k) for k in range(3)] for t in mesh.triangles()]
    return (
        np.asarray(mesh.vertices(), dtype=float).reshape(-1, 3),
        np.asarray(triangles, dtype=np.int32).reshape(-1, 3),
    )


_READERS = {".obj": _read_obj, ".vtk": read_vtk}
