"""Checks glTF and COLLADA for what Open3D, which reads them, would misread.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

from collections import Counter
from pathlib import Path
import re
import struct
from typing import Any

from cns_drake.base.files import read_bytes
from cns_drake.base.json_text import parse_json

# Endings of such files.
GLTF = (".gltf", ".glb")
# Beginnings of the names of extensions without which shapes are the same.
_HARMLESS = (
    "KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
    "ADOBE_materials_", "KHR_lights_", "EXT_lights_", "KHR_techniques_",
    "KHR_xmp", "KHR_audio", "KHR_animation_pointer", "MSFT_packing_",
    "EXT_mesh_features", "EXT_structural_metadata", "EXT_feature_metadata",
    "EXT_mesh_manifold", "KHR_physics", "KHR_implicit_shapes",
)  # fmt: skip
# Extensions that change shapes also where they are not required.
_CHANGING = (
    "EXT_mesh_gpu_instancing", "EXT_instance_features", "KHR_node_visibility",
    "KHR_mesh_quantization",
)  # fmt: skip
# Elements of COLLADA that would move or add shapes and are not read.
_COLLADA = {
    re.compile(rb"<instance_controller\b"): "skins or morphs of COLLADA",
    re.compile(rb"<animation\b"): "animations of COLLADA",
    re.compile(rb"<(?:lines|linestrips)\b"): "lines of COLLADA",
}
_FLOAT = 5126
# Kinds of primitives from 0 on that have no triangles: points and lines.
_FIRST_TRIANGLES = 4
_JSON = 0x4E4F534A
_LIMIT_BYTES = 1 << 28


def unread_parts(path: Path) -> tuple[str, ...]:
    """Returns one line for each kind of thing in a mesh that is not read.

    Raises:
        ValueError: its shapes would be misread.
        InputError: it cannot be read.
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
    """Checks a glTF file, text or binary.

    Returns:
        One line for each kind of thing that is not read.

    Raises:
        ValueError: it is no glTF, or its shapes would be misread; it names
            what the file needs.
        InputError: it cannot be read.
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
    """Counts what would move or add shapes and is not read."""
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
