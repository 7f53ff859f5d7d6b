"""The shipped cities: no structures intersect, ground is everywhere."""

from collections import Counter

from helpers.city_checks import (
    check_no_structure_stands_in_a_lane,
    check_no_structure_stands_in_another,
    check_nothing_low_reaches_far_out_of_its_footprint,
    check_things_stand_on_the_ground,
    is_ground,
)
from helpers.internal.shipped_cities import (
    PLANS,
    by_day_or_night,
    city,
    drawn,
    network_of,
)
import numpy as np
import pytest
import shapely
from shapely.affinity import affine_transform

from cns_drake.scene import CLASS_IDS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=by_day_or_night())
def name(request):
    return request.param


@pytest.fixture(scope="module")
def standing(name):
    """Returns all structures that stand on the ground."""
    return [s for s in city(name).structures if not is_ground(s)]


@pytest.fixture(scope="module")
def network(name):
    return network_of(name)


def within(count, least_and_greatest) -> bool:
    least, greatest = least_and_greatest
    return least <= count <= greatest


def test_the_city_is_as_rich_as_planned(name, standing):
    plan = PLANS[name]
    counts = Counter(s.name.rsplit("_", 1)[0] for s in standing)
    classes = Counter(s.semantic_class for s in standing)
    assert within(classes["building"], plan.buildings)
    assert within(counts["tree"], plan.trees)
    small = len(standing) - classes["building"] - counts["tree"]
    assert within(small, plan.small)
    buildings = [s for s in standing if s.semantic_class == "building"]
    assert len({s.tags[1] for s in buildings}) >= 8


def test_names_and_classes(name):
    names = [s.name for s in city(name).structures]
    assert len(set(names)) == len(names)
    assert all("/" not in name and ":" not in name for name in names)
    assert all(s.semantic_class in CLASS_IDS for s in city(name).structures)
    for structure in city(name).structures:
        parts = [part.name for part in structure.model.parts]
        assert parts
        assert len(set(parts)) == len(parts)


def test_no_structure_stands_in_another(standing):
    check_no_structure_stands_in_another(standing)


def test_no_structure_stands_in_a_lane(standing, network):
    check_no_structure_stands_in_a_lane(standing, network)


@pytest.mark.night
def test_nothing_low_reaches_far_out_of_its_footprint(standing, network):
    check_nothing_low_reaches_far_out_of_its_footprint(standing, network)


@pytest.mark.night
def test_things_of_all_stages_stand_on_the_ground(name):
    # What is the same at several stages is checked once.
    found = {id(s): s for part in drawn(name).standing.values() for s in part}
    check_things_stand_on_the_ground(list(found.values()))


def test_signs_stand_off_the_carriageway(standing, network):
    carriageway = network.areas.carriageway
    shapely.prepare(carriageway)
    for structure in standing:
        if structure.semantic_class not in ("car", "truck"):
            foot = shapely.Point(structure.xyz)
            assert not carriageway.contains(foot), structure.name


def test_ground_lies_under_everything(name, standing):
    """There is ground also below the structures that a stage lacks."""
    ground = shapely.union_all(
        [s.model.footprint for s in city(name).structures if is_ground(s)]
    ).buffer(0.002)
    shapely.prepare(ground)
    for structure in standing:
        assert ground.contains(structure.footprint_W), structure.name


def test_ground_meshes_fill_the_bounds_without_gaps(name):
    """From above the ground has neither holes nor overlaps."""
    triangles = []
    for structure in city(name).structures:
        if not is_ground(structure):
            continue
        if structure.name.startswith(("markings", "bridge_")):
            continue  # Paint lies on the ground, and piers of bridges below it.
        for mesh in structure.model.meshes.values():
            triangles.append(mesh.vertices[mesh.triangles()][:, :, :2])
    corners = np.concatenate(triangles)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    low, high = corners.reshape(-1, 2).min(0), corners.reshape(-1, 2).max(0)
    whole = np.prod(high - low)
    assert all(within(side, PLANS[name].sides) for side in high - low)
    assert areas.sum() == pytest.approx(whole, rel=2e-4)
    union = shapely.union_all(shapely.polygons(corners[areas > 1e-6]))
    assert union.area == pytest.approx(whole, rel=2e-4)


def test_no_two_buildings_are_the_same(name):
    """Each building has a geometry of its own."""
    seen = {}
    for structure in city(name).structures:
        if structure.semantic_class != "building":
            continue
        model = structure.model
        key = tuple(
            (
                part.xyz,
                part.rpy,
                part.shape.scale,
                _rounded(model.meshes[part.shape.mesh]),
            )
            for part in model.parts
            if hasattr(part.shape, "mesh")
        )
        assert seen.setdefault(key, structure.name) == structure.name


def _rounded(mesh) -> bytes:
    return np.round(mesh.vertices, 2).tobytes()


def test_footprints_turn_with_their_structures(standing):
    for structure in standing[::50]:
        c, s = np.cos(structure.yaw), np.sin(structure.yaw)
        x, y, _ = structure.xyz
        expected = affine_transform(
            structure.model.footprint, [c, -s, s, c, x, y]
        )
        assert structure.footprint_W.equals_exact(expected, 1e-9)
        corner = structure.model.footprint.exterior.coords[0]
        p_W = structure.p_WP((*corner[:2], 0.0))
        assert expected.exterior.distance(shapely.Point(p_W[:2])) < 1e-9
