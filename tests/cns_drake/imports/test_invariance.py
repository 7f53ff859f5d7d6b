"""A city that is moved, turned or written in another order is the same."""

import re

from helpers.small_cityjson import CityWriter
import numpy as np
import pytest

from cns_drake.imports import ImportOptions, import_city, import_cityjson

# Boxes: place, size, height of the foot.
BOXES = [
    (0, 0, 0, (12, 9, 8)),
    (40, 5, 0.4, (10, 10, 15)),
    (5, 60, -0.2, (20, 8, 6)),
    (70, 70, 0, (9, 9, 22)),
]


def write(path, move=(0, 0, 0), turn_deg=0.0, order=1, scale=1.0):
    angle = np.radians(turn_deg)
    R = np.array(
        [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    )
    city = CityWriter(origin=(85000.0, 446000.0, 3.0))
    plain = city.vertex

    def vertex(x, y, z):
        x, y = R @ (x, y)
        return plain(*(scale * (np.array([x, y, z]) + move)))

    city.vertex = vertex
    for k in list(range(len(BOXES)))[::order]:
        x, y, z, size = BOXES[k]
        city.box(f"house_{k}", x, y, size, z)
    return city.write(path)


def corners(path, move=(0, 0, 0), turn_deg=0.0):
    """Returns name -> sorted corners, moved and turned back."""
    angle = np.radians(-turn_deg)
    R = np.array(
        [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    )
    city = import_cityjson(path, None, None)
    found = {}
    for one in city.objects:
        p = one.triangles.reshape(-1, 3) + city.origin - [85000, 446000, 3]
        p = p - move
        p[:, :2] = p[:, :2] @ R.T
        found[one.structure.name] = np.unique(np.round(p, 2) + 0.0, axis=0)
    return found


@pytest.mark.parametrize(
    "change",
    [
        *({"move": (0, 0, z)} for z in (-300, -20, 500)),
        {"move": (10_000, 0, 0)},
        {"move": (0, -10_000, 0)},
        {"turn_deg": 37.0},
        {"order": -1},
    ],
    ids=str,
)
def test_a_city_that_is_moved_is_the_same(tmp_path, change):
    wanted = corners(write(tmp_path / "a.city.json"))
    moved = write(tmp_path / "b.city.json", **change)
    back = {k: v for k, v in change.items() if k != "order"}
    found = corners(moved, **back)
    assert found.keys() == wanted.keys()
    for name, points in wanted.items():
        np.testing.assert_allclose(found[name], points, atol=0.021)


@pytest.mark.parametrize(
    ("scale", "said"),
    [(1e-3, "too small.* by 1000"), (1, None)],
)
def test_the_likely_factor_is_named(tmp_path, scale, said):
    path = write(tmp_path / "a.city.json", scale=scale)
    options = ImportOptions(dressed=False)
    report = import_city(path, tmp_path / "map", options)
    text = "\n".join(one.kind for one in report.faults)
    if said is None:
        assert "too " not in text
    else:
        assert re.search(said, text)
