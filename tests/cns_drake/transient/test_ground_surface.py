"""The ground near a drive: carriageways, heights and kerbs."""

from helpers.transient_town import DRIVE, X_WT
import numpy as np
import pytest

from worlds.shapes import GroundSurface, turned_up, unit_normals


def test_kerbs_and_heights_of_a_plane_road(changed):
    """The oracle is where the road lies: between y = -3 and 3 of the town."""
    _, before = changed()
    ground = GroundSurface(before, DRIVE.area(50))
    assert ground.carriageway.area == pytest.approx(6 * 200, rel=0.01)
    kerbs = list(ground.kerbs(1.0))
    assert len(kerbs) == 1  # Once round.
    R = X_WT.rotation().matrix()[:2, :2]
    for kerb in kerbs:
        x, y = R.T @ (kerb.points - X_WT.translation()[:2]).T
        straight = abs(x) < 98
        side = np.sign(y[straight])
        assert np.allclose(y[straight], 3.0 * side, atol=1e-3)
        out = (kerb.outwards @ R)[straight]
        assert np.allclose(out, np.column_stack([0 * side, side]), atol=1e-3)
    at = ((5, 1), (5, 8), (5, -9))
    places = np.array([(X_WT @ [x, y, 0])[:2] for x, y in at])
    road = ground.heights(places, of_road=True)
    assert road[0] == pytest.approx(0.4)
    assert np.isnan(road[1:]).all()
    lawn = ground.heights(places, of_road=False)
    assert lawn[1] == pytest.approx(0.45)
    assert np.isnan(lawn[[0, 2]]).all()


def test_ground_is_ground_whichever_way_round_it_is():
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1, 1, (50, 3, 3))
    faced = turned_up(corners)
    assert (unit_normals(corners)[:, 2] < 0).sum() > 10
    assert np.allclose(
        unit_normals(faced)[:, 2], abs(unit_normals(corners)[:, 2])
    )
    assert np.array_equal(np.sort(faced, axis=1), np.sort(corners, axis=1))
