from helpers.mesh_checks import first_hit, is_closed, solids
import numpy as np
import pytest

from cns_drake.city import OBJECTS, MeshShape
from cns_drake.city.furniture.parked_cars import FORMS

# Length, width without mirrors, height of real vehicles of the kind [m].
SIZES = {
    "city_car": ((3.4, 3.8), (1.55, 1.75), (1.4, 1.6)),
    "hatchback": ((3.9, 4.4), (1.7, 1.85), (1.4, 1.55)),
    "saloon": ((4.5, 5.0), (1.75, 1.9), (1.4, 1.5)),
    "estate": ((4.5, 4.9), (1.75, 1.9), (1.4, 1.55)),
    "suv": ((4.3, 4.9), (1.8, 2.0), (1.6, 1.8)),
    "pickup": ((5.1, 5.5), (1.8, 2.0), (1.7, 1.9)),
    "van": ((5.2, 6.0), (1.9, 2.1), (2.3, 2.7)),
    "box_truck": ((6.0, 7.5), (2.0, 2.4), (2.8, 3.3)),
    "bus": ((10.5, 12.5), (2.4, 2.6), (2.9, 3.3)),
}


# x of the axles, radius of the wheels, height of the sill [m].
WHEELS = {
    "city_car": ((-1.18, 1.17), 0.29, 0.2),
    "hatchback": ((-1.32, 1.3), 0.31, 0.2),
    "saloon": ((-1.4, 1.42), 0.33, 0.19),
    "estate": ((-1.38, 1.4), 0.32, 0.2),
    "suv": ((-1.36, 1.36), 0.37, 0.27),
    "pickup": ((-1.6, 1.6), 0.38, 0.33),
    "van": ((-1.6, 1.75), 0.35, 0.25),
    "box_truck": ((-1.75, 2.15), 0.38, 0.36),
    "bus": ((-2.9, 2.9), 0.48, 0.3),
}
# x of the rear and front end of the roof of the cabin, its height [m].
ROOFS = {
    "city_car": (-1.5, 0.3, 1.52),
    "hatchback": (-1.45, 0.2, 1.47),
    "saloon": (-0.95, 0.15, 1.45),
    "estate": (-1.9, 0.2, 1.48),
    "suv": (-1.75, 0.35, 1.7),
    "pickup": (-0.8, 0.5, 1.8),
    "van": (-2.68, 1.45, 2.45),
    "box_truck": (1.35, 2.3, 2.25),
    "bus": (-5.5, 5.42, 3.05),
}


def vehicle_meshes(form):
    """Returns the meshes of a vehicle by their names."""
    return OBJECTS[form].build(np.random.default_rng(0)).meshes


def all_vertices(form):
    return np.concatenate([m.vertices for m in vehicle_meshes(form).values()])


def test_every_form_is_checked():
    assert set(SIZES) == set(FORMS)
    assert len(FORMS) >= 6


@pytest.mark.parametrize("form", FORMS)
def test_meshes_are_closed_solids_wound_outwards(form):
    for mesh in vehicle_meshes(form).values():
        assert is_closed(mesh)
        assert all(volume > 0 for _, volume in solids(mesh))


@pytest.mark.parametrize("form", FORMS)
def test_size_of_a_real_vehicle(form):
    v = all_vertices(form)
    body = vehicle_meshes(form)[f"{form}_body"]
    # Mirrors stick out; the large solids alone have the width.
    widths = [
        np.ptp(body.vertices[sorted(set(sum(piece.faces, ()))), 1])
        for piece, volume in solids(body)
        if volume > 0.3
    ]
    if form == "box_truck":
        widths.append(
            np.ptp(vehicle_meshes(form)["box_truck_box"].vertices[:, 1])
        )
    extent = (np.ptp(v[:, 0]), max(widths), v[:, 2].max())
    for value, (low, high) in zip(extent, SIZES[form], strict=True):
        assert low <= value <= high


@pytest.mark.parametrize("form", FORMS)
def test_triangle_budget(form):
    count = sum(m.num_triangles for m in vehicle_meshes(form).values())
    assert 300 <= count <= 900


@pytest.mark.parametrize("form", FORMS)
def test_wheels_stand_on_the_ground_and_show_in_their_arches(form):
    axles, radius, _ = WHEELS[form]
    meshes = vehicle_meshes(form)
    assert all_vertices(form)[:, 2].min() == pytest.approx(0.0, abs=0.02)
    trim, body = meshes[f"{form}_trim"], meshes[f"{form}_body"]
    # Level rays from the left at the height of the axles.
    n = 200
    reach = body.vertices[:, 0].max() - 0.1
    x = np.linspace(-reach, reach, n)
    z = 0.85 * radius + 0 * x
    origins = np.column_stack([x, np.full(n, 5.0), z])
    d = np.tile((0.0, -1.0, 0.0), (n, 1))
    to_trim = first_hit(trim.vertices, trim.triangles(), origins, d)
    to_body = first_hit(body.vertices, body.triangles(), origins, d)
    near = to_trim < to_body
    for axle in axles:
        in_wheel = np.abs(x - axle) < 0.8 * radius
        assert near[in_wheel].all()
    away = np.min([np.abs(x - a) for a in axles], axis=0)
    middle = away > 1.3 * radius
    middle &= (x > axles[0]) & (x < axles[1])
    assert middle.any()
    assert not near[middle].any()


@pytest.mark.parametrize("form", FORMS)
def test_rays_pass_below_the_sill_but_not_through_the_cabin(form):
    sill = WHEELS[form][2]
    rear, front, roof = ROOFS[form]
    meshes = vehicle_meshes(form).values()
    low = np.array([[0.0, 5.0, 0.6 * sill]])
    high = np.array([[(rear + front) / 2, 5.0, roof - 0.3]])
    d = np.array([[0.0, -1.0, 0.0]])
    for origin, passes in ((low, True), (high, False)):
        hit = min(
            first_hit(m.vertices, m.triangles(), origin, d)[0] for m in meshes
        )
        assert np.isinf(hit) == passes


@pytest.mark.parametrize("form", FORMS)
def test_left_and_right_are_alike(form):
    v = np.unique(np.round(all_vertices(form), 6), axis=0)
    mirrored = np.unique(np.round(v * (1, -1, 1), 6) + 0.0, axis=0)
    distance = np.linalg.norm(v[:, None] - mirrored[None], axis=2).min(axis=1)
    # The facets of the wheels and the panes may differ a little.
    assert np.quantile(distance, 0.9) < 0.02


@pytest.mark.parametrize("form", FORMS)
def test_cars_differ_in_size_and_colour(form):
    models = [
        OBJECTS[form].build(np.random.default_rng([s, 5])) for s in range(20)
    ]
    scales = {m.parts[0].shape.scale for m in models}
    assert len(scales) == 20
    assert all(0.96 < s < 1.04 for scale in scales for s in scale)
    assert len({m.parts[0].rgb for m in models}) >= 5
    for model in models:
        # All parts of a car move together.
        assert len({p.shape.scale for p in model.parts}) == 1
        assert all(isinstance(p.shape, MeshShape) for p in model.parts)
