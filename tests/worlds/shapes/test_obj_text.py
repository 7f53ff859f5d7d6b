"""The text of meshes, against Python's own formatting."""

import numpy as np
import pytest

from worlds.shapes import Mesh


def decimal(thousandths):
    text = f"{thousandths / 1000:.3f}"
    return text.rstrip("0").rstrip(".")


def lines_of(mesh):
    """Returns the lines of a mesh, written one by one."""
    places = np.rint(mesh.vertices * 1000.0).astype(int).tolist()
    distinct = sorted(set(map(tuple, places)))
    lines = [f"v {' '.join(map(decimal, place))}" for place in distinct]
    for face in mesh.faces:
        corners = [distinct.index(tuple(places[k])) + 1 for k in face]
        kept = [c for k, c in enumerate(corners) if c != corners[k - 1]]
        if len(kept) >= 3:
            lines.append(f"f {' '.join(map(str, kept))}")
    return lines


@pytest.mark.parametrize("size", [1e-4, 0.01, 1.0, 300.0, 1e7])
def test_text_is_that_of_numbers_written_one_by_one(size):
    rng = np.random.default_rng(0)
    vertices = rng.normal(0.0, size, (60, 3))
    vertices[rng.random((60, 3)) < 0.2] = 0.0
    vertices[40:50] = np.rint(vertices[40:50])
    vertices[50:] = vertices[:10]
    faces = tuple(
        tuple(rng.integers(0, 60, rng.integers(3, 5)).tolist())
        for _ in range(80)
    )
    mesh = Mesh(vertices, faces)
    assert mesh.to_obj().splitlines() == lines_of(mesh)
    moved = mesh.moved((1.0, -2.0, 0.5))
    assert moved.to_obj().splitlines() == lines_of(moved)


def test_a_mesh_without_faces_has_vertices_alone():
    assert Mesh(np.array([[0.0, -0.5, 12.0]]), ()).to_obj() == "v 0 -0.5 12\n"
    assert not Mesh(np.zeros((0, 3)), ()).to_obj()
