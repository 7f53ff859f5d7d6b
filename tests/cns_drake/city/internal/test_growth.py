"""Buildings of less height, building sites and lots."""

from typing import get_args

from helpers.building_checks import (
    cast,
    placed_triangles,
    rays_from_the_street,
    typical_model,
)
import numpy as np
import pytest
from shapely.geometry import MultiPolygon, box

from cns_drake.city import (
    ARCHETYPES,
    PARKED_CARS,
    Growth,
    Stage,
    Stages,
    Structure,
    building_site,
    lot_objects,
    lowered,
    part_mesh,
    top_of,
    use_by_size,
)
from cns_drake.city.geometry.mesh import box_mesh
from cns_drake.city.growth.lowering import cut_at, enclosed
from cns_drake.city.growth.stage_structures import GrowingCity
from cns_drake.city.stages import LotUse

# Height of the walls that the edge of the roof covers [m].
BAND = 0.51

USES = get_args(LotUse)


def building(name, model, xyz, yaw):
    return Structure(name, "building", model, xyz, yaw)


def ring(polygon, reverse=False):
    """The edges of a polygon, with its inside to their left."""
    corners = np.array(polygon.exterior.coords[:-1])
    corners = corners if polygon.exterior.is_ccw else corners[::-1]
    if reverse:
        corners = corners[::-1]
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def test_a_cut_leaves_what_lies_below():
    mesh = box_mesh((4.0, 6.0, 10.0), (1.0, -2.0, 5.0)).moved(yaw=0.3)
    below, cut = cut_at(mesh, 3.0)
    assert below.vertices[:, 2].max() == 3.0
    corners = below.vertices[below.triangles()]
    spans = np.cross(
        corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    )
    # Four walls of 3 m and the floor.
    area = np.linalg.norm(spans, axis=1).sum() / 2
    assert area == pytest.approx(2 * (4 + 6) * 3 + 24)
    assert enclosed(cut).area == pytest.approx(24, rel=0.01)


def test_a_courtyard_is_not_enclosed():
    block, yard = box(0, 0, 30, 20), box(8, 6, 22, 14)
    edges = np.concatenate([ring(block), ring(yard, reverse=True)])
    assert enclosed(edges).area == pytest.approx(600 - 112, rel=0.01)
    # A tower in the yard is enclosed.
    edges = np.concatenate([edges, ring(box(12, 8, 18, 12))])
    assert enclosed(edges).area == pytest.approx(600 - 112 + 24, rel=0.01)


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


@pytest.mark.parametrize("use", USES)
def test_objects_on_a_lot_stay_apart_and_inside(use):
    lot = building("office_001", typical_model("office"), (30, -8, 2.5), 0.7)
    cars = dict.fromkeys(PARKED_CARS, 1.0)
    things = list(lot_objects(lot, use, cars, np.random.default_rng(1)))
    assert bool(things) == (use != "empty")
    for k, thing in enumerate(things):
        assert thing.xyz[2] == 2.5
        assert lot.footprint_W.contains(thing.footprint_W)
        for other in things[:k]:
            assert not thing.footprint_W.intersects(other.footprint_W)
    assert len({thing.name for thing in things}) == len(things)


def test_a_city_grows_from_stage_to_stage():
    tower = building("tower_001", typical_model("grid_tower"), (0, 0, 0), 0)
    block = building("block_001", typical_model("office"), (90, 9, 1), 1.0)
    stages = Stages(
        stages={
            "01": Stage(
                story="",
                absent={"x": ["block_001"]},
                lower={"y": Growth(height=9, structures=["tower_001"])},
            ),
            "02": Stage(
                story="",
                lower={"z": Growth(height=20, structures=["tower_001"])},
                sites={"s": Growth(height=12, structures=["block_001"])},
            ),
            "03": Stage(story=""),
        }
    )
    city = GrowingCity([tower, block], stages, {"saloon": 1.0})
    first, second, last = (city.at(stage) for stage in ("01", "02", "03"))
    assert last == [tower, block]
    assert [s.name for s in second] == ["tower_001", "block_001"]
    assert top_of(first[0].model) < 10.1 < 20 < top_of(second[0].model) < 21.1
    # The lot is in use while no building stands on it, and ids stay.
    assert {s.name.split("_lot_")[0] for s in first[1:]} == {"block_001"}
    assert city.structures[:2] == [tower, block]
    assert first[1:] == city.structures[2:]
    assert use_by_size(block) in USES
    assert isinstance(enclosed(np.zeros((0, 2, 2))), MultiPolygon)


@pytest.mark.parametrize(
    ("field", "fault"),
    [
        ("lower", "lower: car_001 is neither a building nor a plant"),
        ("sites", "sites: car_001 is no building"),
    ],
)
def test_a_car_does_not_grow(field, fault):
    car = Structure("car_001", "car", typical_model("office"), (0, 0, 0))
    groups = {"x": Growth(height=5, structures=["car_001"])}
    first = Stage(story="", **{field: groups})
    stages = Stages(stages={"01": first, "02": Stage(story="")})
    with pytest.raises(ValueError, match=fault):
        GrowingCity([car], stages, {}).at("01")
