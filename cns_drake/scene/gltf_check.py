"""Prepares glTF files for Open3D, which reads some wrongly or not at all.

Specification: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

import base64
from collections import Counter
import json
from pathlib import Path
import struct
from typing import Any, NamedTuple
from urllib.parse import unquote_to_bytes

import numpy as np

from cns_drake.scene.model_finder import resolve
from evaluation.base import check_expansion, parse_json, read_bytes

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
# Compressions. A file that does not require them has its shapes without, too.
_COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
# Type of an accessor with floats.
_FLOAT = 5126
# Modes of primitives below this number (points and lines) have no triangles.
_FIRST_TRIANGLES = 4
# Greatest mode of a primitive.
_LAST_TRIANGLES = 6
# Members of a file that show no shape, or whose shapes are not read.
_UNSEEN = (
    "images", "textures", "samplers", "materials", "cameras", "animations",
    "skins",
)  # fmt: skip
# Type of a chunk of JSON.
_JSON = 0x4E4F534A


def check_gltf(content: bytes) -> tuple[str, ...]:
    """Returns notes on ignored content of a glTF file, one for each kind.

    Args:
        content: the file, as text (`.gltf`) or binary (`.glb`).

    Raises:
        ValueError: the file is not glTF, or its shapes would be misread; the
            message names the required features.
    """
    try:
        top = parse_json(_json_chunk(content))
        unread = _unread_extensions(top)
        primitives = [p for m in top.get("meshes", []) for p in m["primitives"]]
        has_floats = _has_float_positions(top, primitives)
        modes = [p.get("mode", _FIRST_TRIANGLES) for p in primitives]
        has_other_mode = any(not 0 <= m <= _LAST_TRIANGLES for m in modes)
        counts = _ignored_contents(top, primitives)
        _buffer_uris(top)
        for name in _optional_extensions(top):
            counts[f"uses of the extension {name} of glTF ignored"] += 1
    except (
        AttributeError, LookupError, RecursionError, TypeError, struct.error
    ) as error:  # fmt: skip
        raise ValueError(f"no valid glTF ({type(error).__name__})") from error
    if unread:
        raise ValueError(
            f"needs the extension {unread[0]} of glTF, which is not read;"
            " export it without"
        )
    if has_other_mode:
        raise ValueError("has a primitive whose mode is none of glTF")
    if not has_floats:
        raise ValueError(
            "has vertices that are no floats (KHR_mesh_quantization), which"
            " are not read; export it without"
        )
    return tuple(f"{number} {what}" for what, number in counts.items())


def _count_of_mesh(top: Any, mesh: Any) -> int:
    count = 0
    for one in mesh["primitives"]:
        corners = one.get("indices", one["attributes"].get("POSITION"))
        number = 0 if corners is None else top["accessors"][corners]["count"]
        mode = one.get("mode", _FIRST_TRIANGLES)
        if mode == _FIRST_TRIANGLES:
            count += number // 3
        elif mode > _FIRST_TRIANGLES:
            count += max(number - 2, 0)
    return count


class PlainGltf(NamedTuple):
    """A glTF file for Open3D: shapes alone, with all buffers inside.

    Attributes:
        text: the file.
        p_offset: (3,) what was taken from the place of all meshes, along the
            axes of glTF [m].
        num_triangles: how many triangles the file shows. Open3D leaves out
            triangles whose vertices do not exist.
    """

    text: bytes
    p_offset: np.ndarray
    num_triangles: int


def plain_gltf(content: bytes, folder: Path) -> PlainGltf:
    """Returns a glTF file as Open3D can read it, in full precision.

    Open3D multiplies the places of nodes in single precision, does not find
    buffers whose names have percent escapes, takes a `data:` URI for base64 in
    any case, fails on missing textures, and takes every buffer of a binary file
    for its chunk.

    Args:
        content: the file, which `check_gltf` has checked.
        folder: folder that has the buffers.

    Raises:
        ValueError: the file is not glTF, or a buffer does not exist.
        InputError: a buffer cannot be read.
    """
    top = parse_json(_json_chunk(content))
    buffers = top.get("buffers", [])
    for one, uri in zip(buffers, _buffer_uris(top), strict=True):
        # The chunk of a file may be longer.
        data = _buffer(content, uri, folder)[: one["byteLength"]]
        text = base64.b64encode(data).decode()
        one["uri"] = f"data:application/octet-stream;base64,{text}"
    for key in _UNSEEN:
        top.pop(key, None)
    try:
        placed = _placed_meshes(top)
        count = sum(
            _count_of_mesh(top, top["meshes"][mesh]) for mesh, _ in placed
        )
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        fault = f"{type(error).__name__}: {error}"
        raise ValueError(f"no valid glTF ({fault})") from error
    for mesh in top.get("meshes", []):
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
    p_offset = placed[0][1][:3, 3].copy() if placed else np.zeros(3)
    top["nodes"] = []
    for mesh, X in placed:
        X[:3, 3] -= p_offset
        top["nodes"].append({"mesh": mesh, "matrix": X.T.ravel().tolist()})
    top["scenes"] = [{"nodes": [*range(len(placed))]}]
    top["scene"] = 0
    return PlainGltf(json.dumps(top).encode(), p_offset, count)


def _placed_meshes(top: Any) -> list[tuple[int, np.ndarray]]:
    """Returns each mesh that a scene shows, and its place (4, 4).

    Raises:
        LookupError, TypeError, ValueError: the file is no valid glTF.
    """
    nodes = top.get("nodes", [])
    roots = top["scenes"][top.get("scene", 0)].get("nodes", [])
    # A node has one parent, but files can say otherwise.
    check_expansion(
        -1, lambda one: roots if one < 0 else nodes[one].get("children", [])
    )
    waiting = [(one, np.eye(4)) for one in roots]
    found = []
    while waiting:
        index, X = waiting.pop()
        node = nodes[index]
        X = X @ _own_place(node)
        waiting += [(one, X) for one in node.get("children", [])]
        if "mesh" in node:
            found.append((node["mesh"], X.copy()))
    return found


def _own_place(node: Any) -> np.ndarray:
    """Returns the place (4, 4) of a node in its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    # Slow to import, and most worlds have no such meshes.
    from scipy.spatial.transform import Rotation

    X = np.eye(4)
    X[:3, 3] = node.get("translation", (0, 0, 0))
    X[:3, :3] = Rotation.from_quat(
        node.get("rotation", (0, 0, 0, 1))
    ).as_matrix() * np.asarray(node.get("scale", (1, 1, 1)), dtype=float)
    return X


def _buffer(content: bytes, uri: str | None, folder: Path) -> bytes:
    """Returns the bytes of a buffer of a file.

    Args:
        content: the file.
        uri: address of the buffer; None for the chunk of a binary file.
        folder: folder of the file.

    Raises:
        ValueError: the buffer does not exist.
        InputError: the buffer cannot be read.
    """
    if uri is None:
        return _binary_chunk(content) if content[:4] == b"glTF" else b""
    if uri.startswith("data:"):
        kind, _, data = uri.partition(",")
        plain = unquote_to_bytes(data)
        if not kind.lower().endswith(";base64"):
            return plain
        try:
            return base64.b64decode(plain + b"=" * (-len(plain) % 4))
        except ValueError as error:
            raise ValueError("its buffer data: is no base64") from error
    found = resolve(uri, folder)
    if found is None or not found.is_file():
        raise ValueError(f"its buffer {uri} does not exist")
    return read_bytes(found)


def _json_chunk(content: bytes) -> bytes:
    """Returns the JSON of a text or of a binary file."""
    if content[:4] != b"glTF":
        return content
    length, kind = struct.unpack_from("<II", content, 12)
    if kind != _JSON:
        raise ValueError("no JSON at its beginning")
    return content[20 : 20 + length]


def _buffer_uris(top: Any) -> list[str | None]:
    """Returns the address of each buffer; None for the chunk of a file.

    Raises:
        AttributeError, TypeError: the buffers are no valid glTF.
    """
    buffers = top.get("buffers", [])
    uris = [one.get("uri") for one in buffers]
    for uri, one in zip(uris, buffers, strict=True):
        if not (uri is None or isinstance(uri, str)):
            raise TypeError(f"{uri!r} is no address")
        if not isinstance(one["byteLength"], int):
            raise TypeError("the length of a buffer is no number")
    return uris


def _binary_chunk(content: bytes) -> bytes:
    """Returns the bytes behind the JSON of a binary file."""
    (length,) = struct.unpack_from("<I", content, 12)
    return content[20 + length + 8 :]


def _unread_extensions(top: Any) -> list[str]:
    """Returns the names of extensions that change shapes."""
    required = [str(name) for name in top.get("extensionsRequired", [])]
    used = [str(name) for name in top.get("extensionsUsed", [])]
    used += _extensions_of_shapes(top)
    return [
        *(name for name in required if not name.startswith(_HARMLESS)),
        *(name for name in used if name in _CHANGING),
    ]


def _optional_extensions(top: Any) -> list[str]:
    """Returns the extension of each use by a shape that need not be read."""
    return [
        name
        for name in _extensions_of_shapes(top)
        if not name.startswith((*_HARMLESS, *_COMPRESSIONS))
    ]


def _extensions_of_shapes(top: Any) -> list[str]:
    """Returns the extension of each use by a node, a mesh or a primitive."""
    meshes = top.get("meshes", [])
    shapes = [*top.get("nodes", []), *meshes]
    shapes += [one for mesh in meshes for one in mesh["primitives"]]
    return [name for one in shapes for name in one.get("extensions", {})]


def _has_float_positions(top: Any, primitives: list[Any]) -> bool:
    """Returns whether all vertices of the primitives are floats."""
    accessors = top.get("accessors", [])
    positions = [
        accessors[p["attributes"]["POSITION"]]
        for p in primitives
        if "POSITION" in p["attributes"]
    ]
    return all(one["componentType"] == _FLOAT for one in positions)


def _ignored_contents(top: Any, primitives: list[Any]) -> Counter[str]:
    """Counts what would move or add shapes, but is not read."""
    nodes, meshes = top.get("nodes", []), top.get("meshes", [])
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
