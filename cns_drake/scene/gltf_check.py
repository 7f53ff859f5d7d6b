"""Prepares glTF files for Open3D, which reads some wrongly or not at all.

Specification: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

import base64
from collections import Counter
import json
from pathlib import Path
import struct
from typing import Any

from cns_drake.base import parse_json, read_bytes
from cns_drake.scene.model_finder import resolve
from cns_drake.scene.obj_check import LARGEST_FILE

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


def count_triangles(content: bytes) -> int:
    """Returns how many triangles a glTF file shows, which was checked.

    Open3D leaves out triangles whose vertices do not exist.
    """
    top = parse_json(_json_chunk(content))
    try:
        meshes = [_count_of_mesh(top, one) for one in top.get("meshes", [])]
        nodes = top.get("nodes", [])
        waiting = list(top["scenes"][top.get("scene", 0)].get("nodes", []))
        total = 0
        # A node has one parent, so no node is visited twice.
        for _ in range(len(nodes)):
            if not waiting:
                break
            node = nodes[waiting.pop()]
            waiting += node.get("children", [])
            total += meshes[node["mesh"]] if "mesh" in node else 0
    except (AttributeError, LookupError, TypeError) as error:
        raise ValueError(f"no valid glTF ({type(error).__name__})") from error
    return total


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


def with_own_buffers(path: Path, content: bytes) -> bytes | None:
    """Returns a glTF file with its buffers, without looks; None if it has them.

    Open3D does not find buffers whose names have percent escapes, fails on
    missing textures, and takes every buffer of a binary file for its chunk,
    even a `data:` URI, which Open3D itself writes. The result is text.

    Args:
        path: the file, whose folder has the buffers.
        content: the file, which `check_gltf` has checked.

    Raises:
        ValueError: a buffer does not exist.
        InputError: a buffer cannot be read.
    """
    is_binary = content[:4] == b"glTF"
    top = parse_json(_json_chunk(content))
    buffers = top.get("buffers", [])
    uris = _buffer_uris(top)
    readable = () if is_binary else ("data:",)
    if all(uri is None or uri.startswith(readable) for uri in uris):
        return None
    for one, uri in zip(buffers, uris, strict=True):
        if uri is None:
            data = _binary_chunk(content) if is_binary else b""
        elif uri.startswith("data:"):
            continue
        else:
            found = resolve(uri, path.parent)
            if found is None or not found.is_file():
                raise ValueError(f"its buffer {uri} does not exist")
            data = read_bytes(found, LARGEST_FILE)
        text = base64.b64encode(data).decode()
        one["uri"] = f"data:application/octet-stream;base64,{text}"
    for key in ("images", "textures", "samplers", "materials"):
        top.pop(key, None)
    for mesh in top.get("meshes", []):
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
    return json.dumps(top).encode()


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
    uris = [one.get("uri") for one in top.get("buffers", [])]
    for uri in uris:
        if not (uri is None or isinstance(uri, str)):
            raise TypeError(f"{uri!r} is no address")
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
