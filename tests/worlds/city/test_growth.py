"""Buildings of less height, building sites and lots."""

from helpers.building_checks import (
    cast,
    placed_triangles,
    rays_from_the_street,
    typical_model,
)
import numpy as np
import pytest
from shapely.geometry import box

from worlds.city import ARCHETYPES, building_site
from worlds.shapes import Structure, lowered, part_mesh, top_of

# Height of the walls that the edge of the roof covers [m].
BAND = 0.51


def building(name, model, xyz, yaw):
    return Structure(name, "building", model, xyz, yaw)


@pytest.mark.parametrize("name", sorted(ARCHETYPES))
def test_the_front_below_the_new_roof_stays_as_it_is(name):
    whole = typical_model(name)
    for height in (4.0, 7.3, 0.6 * top_of(whole)):
        low = lowered(whole, height, name, seed=5)
        assert low.footprint == whole.footprint
        rays = rays_from_the_street(whole.footprint, top_of(whole), 800, 3)
        before, after = (placed_triangles(m, True) for m in (whole, low))
        (hit, t), (hit_low, t_low) = (cast(m, *rays) for m in (before, after))
        z, z_low = (rays[0][:, 2] + d * rays[1][:, 2] for d in (t, t_low))
        # Surfaces visible below the height stay visible unless the roof hides
        # them. No surface is added.
        below = (hit >= 0) & (z < height)
        assert (hit_low[below] >= 0).all()
        assert (t_low[below] < t[below] + 2e-3).all()
        front = (hit_low >= 0) & (z_low < height - BAND)
        assert (hit[front] >= 0).all()
        assert (t_low[front] > t[front] - 2e-3).all()
        assert front.any() or low is whole
        if low is not whole:
            assert placed_triangles(low, True)[..., 2].max() < height + 1.0


def test_a_building_is_not_lowered_by_less_than_a_storey():
    whole = typical_model("office")
    top = top_of(whole)
    assert lowered(whole, top - 2.4, "office", 1) is whole
    assert lowered(whole, top - 2.6, "office", 1) is not whole


def test_heights_have_meshes_of_their_own():
    whole = typical_model("office")
    one, other = (lowered(whole, h, "office", 1) for h in (5.0, 8.5))
    for mesh in one.meshes.keys() & other.meshes.keys():
        assert one.meshes[mesh].to_obj() == other.meshes[mesh].to_obj()


def test_a_site_stands_on_its_lot():
    whole = typical_model("museum")
    site = building_site(whole, 20.0, "museum", seed=2)
    assert site.footprint == whole.footprint
    names = {part.name for part in site.parts}
    assert any(name.startswith("crane_") for name in names)
    low = [
        part_mesh(p, site.meshes).vertices
        for p in site.parts
        if not p.name.startswith("crane_")
    ]
    corners = np.concatenate(low)
    lot = whole.footprint.buffer(0.4)
    assert lot.covers(box(*corners[:, :2].min(0), *corners[:, :2].max(0)))
    assert 15.0 < corners[:, 2].max() < 24.0


def test_a_lot_too_small_for_a_frame_has_none():
    with pytest.raises(ValueError, match="sites: k: its lot is too small"):
        building_site(typical_model("kiosk_row"), 9.0, "k", 1)
