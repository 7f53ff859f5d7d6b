"""Oracles for polygon meshes, written without the code under test."""

from collections import Counter

import numpy as np


def is_closed(mesh) -> bool:
    """Whether every edge is used once in each direction."""
    edges = Counter(
        (face[k], face[(k + 1) % len(face)])
        for face in mesh.faces
        for k in range(len(face))
    )
    return all(
        count == 1 and edges[(b, a)] == 1 for (a, b), count in edges.items()
    )


def volume(mesh) -> float:
    """Signed volume by the divergence theorem; positive if wound outwards."""
    a, b, c = (mesh.vertices[mesh.triangles()[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def solids(mesh):
    """Splits a mesh into its connected components, as (faces, volume)."""
    parent = list(range(len(mesh.vertices)))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for face in mesh.faces:
        for i in face[1:]:
            parent[root(i)] = root(face[0])
    groups = {}
    for face in mesh.faces:
        groups.setdefault(root(face[0]), []).append(face)
    pieces = [type(mesh)(mesh.vertices, tuple(f)) for f in groups.values()]
    return [(piece, volume(piece)) for piece in pieces]


def out_of_plane(mesh) -> float:
    """Greatest distance of a quadrilateral's corners from their plane [m]."""
    quads = np.array([f for f in mesh.faces if len(f) == 4]).reshape(-1, 4)
    if not len(quads):
        return 0.0
    p = mesh.vertices[quads]
    p = p - p.mean(axis=1, keepdims=True)
    # The smallest singular value is the root sum of squared distances.
    return float(np.linalg.svd(p, compute_uv=False)[:, 2].max())


def parse_obj(text):
    """Returns (N, 3) vertices and 0-based faces of OBJ text."""
    rows = [line.split() for line in text.splitlines()]
    vertices = np.array([r[1:] for r in rows if r[0] == "v"], dtype=float)
    faces = tuple(tuple(int(i) - 1 for i in r[1:]) for r in rows if r[0] == "f")
    return vertices, faces


def surface_points(part, meshes, rng, count=200) -> np.ndarray:
    """Random points on a part's surface in the structure frame, (N, 3)."""
    shape = part.shape
    kind = type(shape).__name__
    if kind == "MeshShape":
        mesh = meshes[shape.mesh]
        triangle = mesh.triangles()[
            rng.integers(mesh.num_triangles, size=count)
        ]
        weights = rng.dirichlet((1.0, 1.0, 1.0), size=count)
        p = np.einsum("ij,ijk->ik", weights, mesh.vertices[triangle])
        p = np.concatenate([p, mesh.vertices]) * shape.scale
    elif kind == "BoxShape":
        p = rng.uniform(-0.5, 0.5, (count, 3))
        axis = rng.integers(3, size=count)
        p[np.arange(count), axis] = rng.choice((-0.5, 0.5), count)
        p = p * shape.size
    elif kind == "CylinderShape":
        angle = rng.uniform(0, 2 * np.pi, count)
        z = rng.uniform(-0.5, 0.5, count)
        p = np.column_stack(
            [
                shape.radius * np.cos(angle),
                shape.radius * np.sin(angle),
                shape.length * z,
            ]
        )
    else:
        p = rng.standard_normal((count, 3))
        p *= shape.radius / np.linalg.norm(p, axis=1, keepdims=True)
    return p @ rotation_matrix(part.rpy).T + part.xyz


def rotation_matrix(rpy) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll), factor by factor."""
    roll, pitch, yaw = rpy

    def about(axis, angle):
        R = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        R[[i, j], [i, j]] = np.cos(angle)
        R[i, j], R[j, i] = -np.sin(angle), np.sin(angle)
        return R

    return about(2, yaw) @ about(1, pitch) @ about(0, roll)
