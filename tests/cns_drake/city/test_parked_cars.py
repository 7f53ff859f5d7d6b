from helpers.mesh_checks import first_hit, is_closed, solids
import numpy as np
import pytest

from cns_drake.city.furniture.parked_cars import FORMS, vehicle_meshes
from cns_drake.city.geometry.structures import MeshShape
from cns_drake.city.placement.objects import OBJECTS

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
    # The mirrors stand out; the large solids alone have the width.
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
    outline = FORMS[form]
    meshes = vehicle_meshes(form)
    assert all_vertices(form)[:, 2].min() == pytest.approx(0.0, abs=0.02)
    trim, body = meshes[f"{form}_trim"], meshes[f"{form}_body"]
    # Level rays from the left at the height of the axles.
    n = 200
    x = np.linspace(-outline.length / 2 + 0.1, outline.length / 2 - 0.1, n)
    z = 0.85 * outline.wheel_radius + 0 * x
    origins = np.column_stack([x, np.full(n, 5.0), z])
    d = np.tile((0.0, -1.0, 0.0), (n, 1))
    to_trim = first_hit(trim.vertices, trim.triangles(), origins, d)
    to_body = first_hit(body.vertices, body.triangles(), origins, d)
    near = to_trim < to_body
    for axle in outline.axles:
        in_wheel = np.abs(x - axle) < 0.8 * outline.wheel_radius
        assert near[in_wheel].all()
    away = np.min([np.abs(x - a) for a in outline.axles], axis=0)
    middle = away > 1.3 * outline.wheel_radius
    middle &= (x > outline.axles[0]) & (x < outline.axles[1])
    assert middle.any()
    assert not near[middle].any()


@pytest.mark.parametrize("form", FORMS)
def test_rays_pass_below_the_sill_but_not_through_the_cabin(form):
    outline = FORMS[form]
    meshes = vehicle_meshes(form).values()
    low = np.array([[0.0, 5.0, 0.6 * outline.sill]])
    high = np.array([[np.mean(outline.cabin_roof), 5.0, outline.height - 0.3]])
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
        # All parts of a car keep together.
        assert len({p.shape.scale for p in model.parts}) == 1
        assert all(isinstance(p.shape, MeshShape) for p in model.parts)
