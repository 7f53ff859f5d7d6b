"""Placed triangles of building models, and rays on them."""

from functools import cache
from zlib import crc32

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from shapely.affinity import rotate
from shapely.geometry import Polygon, box

from helpers.mesh_checks import rotation_matrix
from worlds.city import ARCHETYPES, sample


def typical_request(name: str, seed: int):
    """Returns a footprint off the origin and a height for an archetype."""
    kind = ARCHETYPES[name]
    rng = np.random.default_rng([seed, crc32(name.encode())])
    low, high = kind.widths
    high = min(high, max(1.3 * low, 46.0))
    width, depth = np.round(np.sort(rng.uniform(low, high, 2))[::-1], 1)
    if name == "church":  # Its nave runs away from the street.
        width, depth = depth, width
    x, y = np.round(rng.uniform(-20, 20, 2), 1)
    lowest, highest = kind.heights
    height = round(rng.uniform(lowest, 0.5 * (lowest + highest)), 1)
    return box(x, y, x + width, y + depth), height


def rounded_block() -> Polygon:
    """A block with one round corner and no right angles."""
    block = box(0, 0, 34, 26).buffer(-7).buffer(7, quad_segs=4)
    block = block.union(box(0, 0, 34, 12)).simplify(0.01)
    return rotate(block, 25, origin=(0, 0))


@cache
def typical_model(name: str):
    footprint, height = typical_request(name, 1)
    rng = np.random.default_rng([1, 77])
    return sample(name, footprint, height, rng, name=f"{name}_007")


def placed_triangles(model, skip_roof_equipment: bool = False) -> np.ndarray:
    """Returns the (M, 3, 3) corners of all triangles in the frame S."""
    pieces = []
    for part in model.parts:
        mesh = model.meshes[part.shape.mesh]
        if skip_roof_equipment and part.shape.mesh.startswith("roof_"):
            continue
        vertices = mesh.vertices * part.shape.scale
        vertices = vertices @ rotation_matrix(part.rpy).T + part.xyz
        pieces.append(vertices[mesh.triangles()])
    return np.concatenate(pieces)


def normals(triangles: np.ndarray) -> np.ndarray:
    a, b, c = (triangles[:, k] for k in range(3))
    n = np.cross(b - a, c - a)
    return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)


def cast(triangles: np.ndarray, origins, directions):
    """Returns the first triangle hit (-1: none) and the distance to it."""
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, triangles.astype(np.float32))
    hits = scene.run(
        np.asarray(origins, np.float32),
        np.asarray(directions, np.float32),
        output=1,
    )
    return np.asarray(hits["primID"], dtype=int), np.asarray(hits["tfar"])


def rays_from_the_street(footprint: Polygon, top: float, count: int, seed: int):
    """Rays of sensors around a building towards all of it, as (o, d)."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = footprint.bounds
    center = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    reach = 0.5 * np.hypot(x1 - x0, y1 - y0)
    angles = rng.uniform(0, 2 * np.pi, count)
    distance = reach + rng.uniform(3.0, 40.0, count)
    origins = np.column_stack(
        [
            center[0] + distance * np.cos(angles),
            center[1] + distance * np.sin(angles),
            rng.uniform(0.3, 6.0, count),
        ]
    )
    targets = np.column_stack(
        [
            rng.uniform(x0 - 1.0, x1 + 1.0, count),
            rng.uniform(y0 - 1.0, y1 + 1.0, count),
            rng.uniform(0.0, top, count) * rng.uniform(0.1, 1.0, count),
        ]
    )
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, directions
