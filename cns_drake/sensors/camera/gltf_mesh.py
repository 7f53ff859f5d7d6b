"""Meshes in glTF of flat-shaded triangles that have the look of a surface."""

from collections.abc import Mapping
import json
from typing import Any

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from cns_drake.scene import reads_vertex_colours_as_srgb
from cns_drake.sensors.camera.looks import GAMMA, LOOKS, texture

# Component types of glTF 2.0.
_FLOAT = 5126
_UINT = 5125
# Targets of buffer views in glTF 2.0.
_VERTICES = 34962
_CORNERS = 34963
# Filters of textures in glTF 2.0: linear, with linear mipmaps where small.
_LINEAR = 9729
_LINEAR_MIPMAP_LINEAR = 9987


def make_mesh(
    corners: np.ndarray,
    middle: np.ndarray,
    rgb: np.ndarray,
    look: str | int,
    owners: np.ndarray,
    fronts: np.ndarray,
) -> Mesh:
    """Returns a glTF mesh of N flat-shaded triangles.

    Args:
        corners: (N, 3, 3) corners of the triangles.
        middle: (3,) origin of the mesh.
        rgb: (N, 3) sRGB colours; not used for a class.
        look: name of a look, or the number of a class.
        owners: (N,) index of the geometry that a triangle belongs to.
        fronts: (M, 3) direction in which each geometry faces.
    """
    normals = _unit_normals(corners)
    arrays = {
        "POSITION": _along_gltf_axes((corners - middle).reshape(-1, 3)),
        "NORMAL": _along_gltf_axes(np.repeat(normals, 3, axis=0)),
    }
    material: dict[str, Any] = {"doubleSided": True}
    files: dict[str, bytes] = {}
    textures: dict[str, Any] = {}
    if isinstance(look, str):
        png, white = texture(look)
        files["look.png"] = png
        tiles = _texture_coordinates(look, corners, normals, owners, fronts)
        arrays["TEXCOORD_0"] = tiles.reshape(-1, 2)
        if LOOKS[look].is_face:
            rgb = np.ones_like(rgb)
        arrays["COLOR_0"] = np.repeat(_vertex_colours(rgb, white), 3, axis=0)
        material |= _textured_material(look)
        textures = {
            "images": [{"uri": "look.png"}],
            "samplers": [
                {"minFilter": _LINEAR_MIPMAP_LINEAR, "magFilter": _LINEAR}
            ],
            "textures": [{"source": 0, "sampler": 0}],
        }
    document, files["mesh.bin"] = _encode_gltf(arrays, material, textures)
    return Mesh(
        InMemoryMesh(
            mesh_file=MemoryFile(document, ".gltf", "mesh.gltf"),
            supporting_files={
                name: MemoryFile(data, name[-4:], name)
                for name, data in files.items()
            },
        )
    )


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    """Returns unit normals (N, 3); (0, 0, 1) for triangles without an area."""
    first, second, third = np.moveaxis(corners, 1, 0)
    normals = np.cross(second - first, third - first)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    normals[length[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    return normals


def _along_gltf_axes(vectors: np.ndarray) -> np.ndarray:
    """Returns vectors (K, 3) along glTF's axes: right, up and backwards."""
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def _texture_coordinates(
    look: str,
    corners: np.ndarray,
    normals: np.ndarray,
    owners: np.ndarray,
    fronts: np.ndarray,
) -> np.ndarray:
    """Returns the texture coordinates (N, 3, 2) of triangles with a look.

    Traffic signals show red in one street, and green in the crossing street.
    Their sides and backs show the dark corner of the texture.
    """
    if not LOOKS[look].is_face:
        tiles = repeated_coordinates(corners, normals) / LOOKS[look].size
        tiles -= np.floor(tiles.min(axis=1, keepdims=True))
        return tiles
    tiles = face_coordinates(corners, normals, owners)
    if look == "signals":
        front = fronts[owners]
        tiles = tiles * (0.5, 1.0)
        tiles[abs(front[:, 0]) > abs(front[:, 1]), :, 0] += 0.5
        tiles[(front * normals).sum(axis=1) < 0.9] = 0.01
    return tiles


def _vertex_colours(rgb: np.ndarray, white: float) -> np.ndarray:
    """Returns colours as Drake's renderer takes them, given sRGB (N, 3).

    `white` is the factor for the brightness of the texture, from `texture`.
    """
    light = np.minimum(rgb**GAMMA * white, 1.0)
    return light ** (1.0 / GAMMA) if reads_vertex_colours_as_srgb() else light


def _textured_material(look: str) -> dict[str, Any]:
    """Returns the properties of a glTF material with the texture of a look."""
    material: dict[str, Any] = {}
    if look == "signals":
        material["emissiveFactor"] = [1.0] * 3
        material["emissiveTexture"] = {"index": 0}
    return material | {
        "alphaMode": "MASK" if look == "leaves" else "OPAQUE",
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0.0,
            "roughnessFactor": LOOKS[look].roughness,
        },
    }


def _encode_gltf(
    arrays: Mapping[str, np.ndarray],
    material: Mapping[str, Any],
    textures: Mapping[str, Any],
) -> tuple[bytes, bytes]:
    """Returns the glTF document of one mesh, and the content of `mesh.bin`.

    Args:
        arrays: name of an attribute -> its values, one row for each vertex;
            three consecutive vertices are a triangle.
        material: properties of the material.
        textures: the entries `images`, `samplers` and `textures`, if any.
    """
    num_vertices = len(arrays["POSITION"])
    kinds = [*(f"VEC{array.shape[1]}" for array in arrays.values()), "SCALAR"]
    parts = [array.astype("<f4") for array in arrays.values()]
    parts.append(np.arange(num_vertices, dtype="<u4"))
    ends = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {k: n for n, k in enumerate(arrays)},
                        "indices": len(arrays),
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [material],
        **textures,
        "buffers": [{"uri": "mesh.bin", "byteLength": ends[-1]}],
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": start,
                "byteLength": part.nbytes,
                "target": _CORNERS if kind == "SCALAR" else _VERTICES,
            }
            for start, part, kind in zip(ends, parts, kinds, strict=False)
        ],
        "accessors": [
            {
                "bufferView": k,
                "componentType": _UINT if kind == "SCALAR" else _FLOAT,
                "count": num_vertices,
                "type": kind,
            }
            for k, kind in enumerate(kinds)
        ],
    }
    document["accessors"][0] |= {
        "min": parts[0].min(axis=0).tolist(),
        "max": parts[0].max(axis=0).tolist(),
    }
    content = b"".join(part.tobytes() for part in parts)
    return json.dumps(document).encode(), content


def repeated_coordinates(
    corners: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Returns coordinates in metres, for textures that are repeated.

    On walls, the rows of a texture are horizontal. Divided by the size of a
    texture, the results are texture coordinates.

    Args:
        corners: (N, 3, 3) corners of the triangles [m].
        normals: (N, 3) unit normals of the triangles.

    Returns:
        (N, 3, 2) coordinates of the corners: to the right and downwards [m].
    """
    across = np.round(np.stack([-normals[:, 1], normals[:, 0]], axis=1), 3)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    is_flat = length[:, 0] < 0.5
    across = np.where(is_flat[:, None], (1.0, 0.0), across / (length + 1e-9))
    along = np.einsum("nca,na->nc", corners[:, :, :2], across)
    height = np.where(is_flat[:, None], corners[:, :, 1], corners[:, :, 2])
    return np.stack([along, -height], axis=2)


def face_coordinates(
    corners: np.ndarray, normals: np.ndarray, owners: np.ndarray
) -> np.ndarray:
    """Returns texture coordinates with which one texture covers each geometry.

    Args:
        corners: (N, 3, 3) corners of the triangles of all geometries [m].
        normals: (N, 3) unit normals of the triangles.
        owners: (N,) index of each triangle's geometry.

    Returns:
        (N, 3, 2) texture coordinates of the corners, which run from 0 to 1 over
        each geometry.
    """
    low = np.full((owners.max() + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, owners, corners.min(axis=1))
    np.maximum.at(high, owners, corners.max(axis=1))
    middle = (low + high) / 2.0
    tiles = repeated_coordinates(corners - middle[owners][:, None], normals)
    half = np.full((len(middle), 2), 1e-3)
    np.maximum.at(half, owners, np.abs(tiles).max(axis=1))
    return 0.5 + 0.5 * tiles / half[owners][:, None]
