from helpers.mesh_checks import is_closed, solids, surface_points
import numpy as np
import pytest

from cns_drake.city import OBJECTS, MeshShape
from cns_drake.city.furniture.object_data import ONE_MESH
from cns_drake.city.furniture.street_furniture import STREET_FURNITURE

SOLID = [
    *STREET_FURNITURE,
    *ONE_MESH,
    "bus_shelter",
    "market_stall",
    "cafe_table",
    "statue",
    "obelisk",
    "fountain",
    "traffic_light",
    "sign_stop",
    "sign_triangular",
    "lantern",
    "lamp_post_curved",
    "site_cabin",
    "excavator",
    "soil_heap",
    "tower_crane",
    "flag_poles",
]


def build(name, seed=0, **parameters):
    return OBJECTS[name].build(np.random.default_rng(seed), **parameters)


def points(model, names=None):
    rng = np.random.default_rng(1)
    return np.concatenate(
        [
            surface_points(p, model.meshes, rng, 3000)
            for p in model.parts
            if names is None or p.name.startswith(names)
        ]
    )


@pytest.mark.parametrize("name", SOLID)
def test_meshes_are_closed_solids_wound_outwards(name):
    for seed in range(8):
        for mesh in build(name, seed).meshes.values():
            assert is_closed(mesh)
            assert all(volume > 0 for _, volume in solids(mesh))


# Least and greatest size along x, y, z above the ground, as of real ones.
SIZES = {
    "bench": ((0.45, 0.8), (1.5, 2.2), (0.75, 1.0)),
    "litter_bin": ((0.4, 0.7), (0.4, 0.7), (0.8, 1.3)),
    "bollard": ((0.1, 0.3), (0.1, 0.3), (0.8, 1.1)),
    "hydrant": ((0.3, 0.6), (0.3, 0.6), (0.6, 1.0)),
    "post_box": ((0.4, 0.7), (0.4, 0.7), (1.3, 1.8)),
    "parking_meter": ((0.05, 0.3), (0.1, 0.4), (1.2, 1.8)),
    "cabinet": ((0.3, 0.6), (0.7, 1.8), (0.9, 1.5)),
    "bicycle": ((1.6, 1.9), (0.4, 0.7), (0.9, 1.1)),
    "phone_box": ((0.8, 1.1), (0.8, 1.1), (2.2, 2.6)),
    "kiosk": ((2.0, 4.0), (2.7, 5.0), (3.0, 4.2)),
    "bus_shelter": ((1.2, 2.0), (3.8, 5.2), (2.4, 3.2)),
    "advertising_pillar": ((1.2, 1.8), (1.2, 1.8), (3.2, 4.6)),
    "container": ((6.0, 6.2), (2.4, 2.5), (2.5, 2.7)),
    "picnic_table": ((1.4, 2.0), (1.5, 2.2), (0.7, 0.85)),
}


@pytest.mark.parametrize("name", SIZES)
def test_sizes_are_those_of_the_real_things(name):
    for seed in range(6):
        p = points(build(name, seed))
        extent = [np.ptp(p[:, 0]), np.ptp(p[:, 1]), p[:, 2].max()]
        for value, (low, high) in zip(extent, SIZES[name], strict=True):
            assert low <= value <= high


@pytest.mark.parametrize("height", [7.5, 10.0])
@pytest.mark.parametrize("name", ["lamp_post", "lamp_post_curved"])
def test_lamp_hangs_over_the_road_at_its_height(name, height):
    p = points(build(name, height=height))
    assert p[:, 2].max() == pytest.approx(height, abs=0.4)
    high = p[p[:, 2] > height - 0.4]
    assert high[:, 0].max() > 1.2
    assert p[p[:, 2] < height - 1.5, 0].max() < 0.2


def test_double_lamps_reach_both_ways():
    for name in ("lamp_post_double", "lamp_post_curved_double"):
        p = points(build(name))
        assert p[:, 0].max() == pytest.approx(-p[:, 0].min(), abs=0.01)
        assert p[:, 0].max() > 1.2


@pytest.mark.parametrize("arm", [4.0, 7.0])
def test_lorries_pass_below_the_mast_arm(arm):
    p = points(build("traffic_light", arm=arm))
    assert p[:, 0].max() == pytest.approx(arm, abs=0.2)
    assert p[p[:, 0] > 0.5, 2].min() > 4.5


def test_signal_lamps_face_the_traffic():
    for name in ("traffic_light", "traffic_light_post", "pedestrian_light"):
        p = points(build(name), "signal")
        # The hoods stick out further to the front (+y) than the board back.
        assert p[:, 1].max() > 0.2
        assert p[:, 1].min() > -0.1


@pytest.mark.parametrize(
    "name", ["sign_round", "sign_triangular", "sign_stop", "sign_rectangular"]
)
def test_sign_plates_are_upright_and_in_front_of_the_post(name):
    for seed in range(5):
        p = points(build(name, seed), "plate")
        assert np.ptp(p[:, 0]) < 0.05
        assert 0.4 < np.ptp(p[:, 1]) < 1.0
        assert 0.4 < np.ptp(p[:, 2]) < 1.0
        assert p[:, 2].min() > 1.7
        assert p[:, 0].min() > 0.0


def test_crane_consists_of_whole_sections():
    model = build("tower_crane", height=40.0, reach=32.0)
    masts = [p for p in model.parts if p.name.startswith("mast")]
    assert len(masts) == 10
    p = points(model, "jib")
    assert np.linalg.norm(p[:, :2], axis=1).max() == pytest.approx(32.0, abs=1)
    assert p[:, 2].min() > 40.0
    assert model.footprint.area < 30.0


@pytest.mark.parametrize("radius", [2.0, 4.0])
def test_fountain_radius(radius):
    p = points(build("fountain", radius=radius))
    reach = np.linalg.norm(p[:, :2], axis=1).max()
    assert reach == pytest.approx(radius, rel=0.05)


def test_fountain_water_lies_in_its_basin():
    water = points(build("fountain", radius=3.0), "water")
    assert water[:, 2].min() > 0.0
    low = water[water[:, 2] < 1.0]
    assert np.linalg.norm(low[:, :2], axis=1).max() < 3.0


@pytest.mark.parametrize("height", [8.0, 16.0])
def test_obelisk_height(height):
    p = points(build("obelisk", height=height))
    assert p[:, 2].max() == pytest.approx(height, abs=0.02)


def test_rows_have_the_asked_number_of_members():
    for count in (1, 4):
        assert len(build("flag_poles", count=count).parts) == 2 * count
        assert len(build("traffic_cones", count=count).parts) == count
        assert len(build("site_cabin", storeys=count).parts) == count


def test_mirrored_shelters_have_meshes_of_their_own():
    names = set()
    for seed in range(12):
        model = build("bus_shelter", seed)
        names |= {
            p.shape.mesh for p in model.parts if isinstance(p.shape, MeshShape)
        }
    assert names == {
        "shelter_left_frame",
        "shelter_left_panes",
        "shelter_right_frame",
        "shelter_right_panes",
    }
