import math

from helpers.mesh_checks import volume
from helpers.winding import winding_numbers
import numpy as np
import pytest

from cns_drake.city import WallFrame
from cns_drake.city.facades import (
    balconies,
    canopies,
    outlines,
    porches,
    solids,
)

_C = math.cos(0.7)
_S = math.sin(0.7)
# A rectangle of 14 m by 9 m, turned by 0.7 rad.
TURNED = outlines.rectangle(1, 2, 15, 11) @ np.array([[_C, _S], [-_S, _C]])


def corners(mesh):
    return mesh.vertices[mesh.triangles()]


@pytest.mark.parametrize(
    "solid",
    [
        canopies.canopy(0.5, 4.0, 1.4, 3.0),
        canopies.awning(1.0, 4.0, 1.2, 2.6, 3.5),
        porches.steps(0.0, 3.0, 1.5, 0.8, 4),
    ],
    ids=["canopy", "awning", "steps"],
)
def test_details_are_wound_outwards_on_any_wall(solid):
    for edge in range(4):
        placed = WallFrame(TURNED, edge).place(solid)
        # Placing mirrors and turns faces, but leaves no solid inside out.
        rng = np.random.default_rng(edge)
        low, high = placed.vertices.min(axis=0), placed.vertices.max(axis=0)
        points = rng.uniform(low, high, (200, 3))
        found = winding_numbers(corners(placed), points)
        assert found.max() > 0.5
        assert found.min() > -0.5


def test_wall_frame_looks_outwards():
    wall = WallFrame(outlines.rectangle(2, 3, 12, 9), 1)
    assert wall.length == pytest.approx(6.0)
    assert wall.heading == pytest.approx(math.pi / 2)
    np.testing.assert_allclose(wall.point(1.0, 0.5), (12.5, 4.0))
    box_ = solids.box(x=(1.0, 2.0), y=(0.0, 0.5), z=(0.0, 3.0))
    placed = wall.place(box_, z=2.0)
    np.testing.assert_allclose(placed.vertices.min(axis=0), (12.0, 4.0, 2.0))
    np.testing.assert_allclose(placed.vertices.max(axis=0), (12.5, 5.0, 5.0))
    assert volume(placed) == pytest.approx(1.5)


def test_balcony_is_a_tray_open_to_the_wall():
    tray = balconies.balcony(1.0, 4.0, 1.2, 5.0, 1.0)
    wall = WallFrame(outlines.rectangle(0, 0, 10, 6), 0)
    placed = wall.place(tray)
    back = solids.flat(outlines.rectangle(1.0, -0.01, 4.0, 0.0), 0.0)
    assert placed.vertices[:, 1].min() == pytest.approx(-1.2)
    assert back.vertices[:, 1].max() == pytest.approx(0.0)
    # Views from the front, the side, below and into the tray.
    normals = np.cross(
        corners(placed)[:, 1] - corners(placed)[:, 0],
        corners(placed)[:, 2] - corners(placed)[:, 0],
    )
    total = normals.sum(axis=0) / 2
    # The open part is the section at the wall. Its area is the deficit: slab
    # and rails less the room between the rails.
    section = 3.0 * 1.2 - (3.0 - 0.24) * 1.0
    np.testing.assert_allclose(total, (0.0, -section, 0.0), atol=1e-9)
