import itertools
import math

from helpers.mesh_checks import out_of_plane, volume
from helpers.winding import winding_numbers
import numpy as np
import pytest
from shapely.geometry import Polygon

from cns_drake.city.facades import outlines, solids
from cns_drake.city.facades.reliefs import Arch, Band, Patch
from cns_drake.city.facades.walls import Facade, facade_mesh, glass_mesh
from cns_drake.city.geometry.mesh import merge_meshes

# A rectangle turned by 30 degrees and moved off the origin.
_C = math.cos(math.pi / 6)
_S = math.sin(math.pi / 6)
TURNED = outlines.rectangle(0, 0, 12, 8) @ np.array([[_C, _S], [-_S, _C]]) + (
    5.0,
    -3.0,
)
# One reflex corner, right angles elsewhere.
L_SHAPE = np.array([(0, 0), (14, 0), (14, 6), (6, 6), (6, 12), (0, 12.0)])
OBLIQUE = np.array([(0, 0), (11, 1), (13, 8), (5, 11), (-2, 6.0)])
OUTLINES = {"turned": TURNED, "l_shape": L_SHAPE, "oblique": OBLIQUE}


def closed(points, facade, z0=0.0):
    """The facade with its glass and lids at depth 0."""
    return merge_meshes(
        facade_mesh(points, facade, z0),
        glass_mesh(points, facade, z0),
        solids.flat(points, z0, up=False),
        solids.flat(points, z0 + facade.height),
    )


def corners(mesh):
    return mesh.vertices[mesh.triangles()]


def random_patches(seed):
    """Disjoint patches, equal for equal edges."""

    def layout(edge, length):
        rng = np.random.default_rng([seed, edge])
        cells = np.linspace(0.8, length - 0.8, 5)
        return [
            Patch(
                a + 0.05,
                b - rng.uniform(0.05, 0.5),
                rng.uniform(0.2, 1.0),
                rng.uniform(1.5, 2.8),
                round(rng.uniform(-0.3, 0.5), 2),
            )
            for a, b in itertools.pairwise(cells)
        ]

    return layout


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
@pytest.mark.parametrize("seed", range(3))
def test_volume_is_that_of_the_wall_less_its_recesses(outline, seed):
    layout = random_patches(seed)
    facade = Facade(3.0, layout=layout, glass=(0.2,))
    expected = 3.0 * Polygon(outline).area
    for edge, start in enumerate(outline):
        length = math.dist(start, outline[(edge + 1) % len(outline)])
        for p in layout(edge, length):
            # Breaks are rounded to millimetres.
            width = round(p.x1, 3) - round(p.x0, 3)
            height = round(p.z1, 3) - round(p.z0, 3)
            expected -= width * height * p.depth
    assert volume(closed(outline, facade, 1.7)) == pytest.approx(expected)


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_bands_are_mitred_around_corners(outline):
    facade = Facade(3.0, (Band(0.5, 1.0, 0.3), Band(2.0, 3.0, -0.4)))
    expected = (
        1.5 * Polygon(outline).area
        + 0.5 * Polygon(outline).buffer(-0.3, join_style="mitre").area
        + 1.0 * Polygon(outline).buffer(0.4, join_style="mitre").area
    )
    assert volume(closed(outline, facade)) == pytest.approx(expected)


@pytest.mark.parametrize("plain", [{0}, {1, 3}, {2}])
@pytest.mark.parametrize(
    "outline", [TURNED, OBLIQUE], ids=["turned", "oblique"]
)
def test_walls_stay_closed_beside_plain_ones(outline, plain):
    facade = Facade(
        3.0,
        (Band(0.0, 0.4, -0.1), Band(1.0, 2.0, 0.35), Band(2.5, 3.0, -0.5)),
        random_patches(5),
        glass=(0.35,),
        plain=frozenset(plain),
    )
    mesh = closed(outline, facade)
    rng = np.random.default_rng(3)
    low, high = mesh.vertices.min(axis=0) - 0.5, mesh.vertices.max(axis=0) + 0.5
    found = winding_numbers(corners(mesh), rng.uniform(low, high, (400, 3)))
    # A gap, or a face with its vertices in the wrong order, gives fractions.
    np.testing.assert_allclose(found, np.round(found), atol=1e-4)
    assert set(np.round(found)) == {0.0, 1.0}
    for edge in plain:
        start, end = outline[edge], outline[(edge + 1) % len(outline)]
        along = (end - start) / np.hypot(*(end - start))
        outward = np.array([along[1], -along[0]])
        assert ((mesh.vertices[:, :2] - start) @ outward).max() < 1e-4


def test_points_in_recesses_are_outside_and_under_ledges_too():
    window = Patch(4.0, 6.0, 1.0, 2.0, 0.3)
    facade = Facade(
        3.0,
        (Band(2.5, 3.0, -0.4),),
        lambda edge, length: [window] if edge == 0 else [],
        glass=(0.3,),
    )
    mesh = closed(TURNED, facade)
    along, inward = np.array([_C, _S, 0.0]), np.array([-_S, _C, 0.0])
    origin = np.array([*TURNED[0], 0.0])

    def wall(x, depth, z):
        return origin + x * along + depth * inward + (0, 0, z)

    inside = [
        wall(5.0, 0.301, 1.5),
        wall(3.999, 0.1, 1.5),
        wall(5.0, 0.1, 2.001),
        wall(5.0, -0.399, 2.7),
        wall(-0.399, -0.399, 2.7),
    ]
    outside = [
        wall(5.0, 0.299, 1.5),
        wall(4.001, 0.1, 1.5),
        wall(5.0, 0.1, 1.999),
        wall(5.0, -0.401, 2.7),
        wall(5.0, -0.2, 2.499),
    ]
    found = winding_numbers(corners(mesh), np.array(inside + outside))
    np.testing.assert_allclose(found, [1.0] * 5 + [0.0] * 5, atol=1e-4)


@pytest.mark.parametrize("width", [1.2, 2.8])
def test_arch_takes_a_rectangle_and_a_half_ellipse_out(width):
    arch = Arch(4.0, 4.0 + width, 0.5, 1.5, 2.3, 0.4)
    facade = Facade(
        3.0, layout=lambda edge, length: [arch] if edge == 2 else []
    )
    mesh = closed(TURNED, facade)
    count = 4 if width < 2.0 else 6  # Chords of the head.
    # A polygon inscribed in a half ellipse of area pi a b / 2.
    head = 0.5 * count * math.sin(math.pi / count) * (width / 2) * 0.8
    expected = 3.0 * 96.0 - 0.4 * (width * 1.0 + head)
    assert volume(mesh) == pytest.approx(expected)
    points = np.random.default_rng(1).uniform(
        mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), (200, 3)
    )
    found = winding_numbers(corners(mesh), points)
    np.testing.assert_allclose(found, np.round(found), atol=1e-4)


def test_glass_lies_at_its_depth_and_only_there():
    window = Patch(1.0, 2.5, 0.5, 2.0, 0.25)
    door = Patch(4.0, 5.0, 0.0, 2.0, 0.6)
    facade = Facade(
        3.0, layout=lambda edge, length: [window, door], glass=(0.25,)
    )
    glass = glass_mesh(TURNED, facade)
    assert len(glass.faces) == 4
    for k, face in enumerate(glass.faces):
        # All four corners of a face lie behind the same wall.
        behind = []
        for edge in range(4):
            start, end = TURNED[edge], TURNED[(edge + 1) % 4]
            along = (end - start) / np.hypot(*(end - start))
            inward = np.array([-along[1], along[0]])
            behind.append((glass.vertices[list(face), :2] - start) @ inward)
        assert any(np.allclose(d, 0.25, atol=1e-3) for d in behind), k


def test_stacked_storeys_equal_storeys_placed_one_above_another():
    facade = Facade(
        3.0,
        (Band(0.0, 0.2, -0.15),),
        lambda edge, length: [
            Patch(1.0, 2.0, 1.0, 2.0, 0.2),
            Arch(3.0, 4.0, 0.5, 1.5, 2.0, 0.3),
        ],
    )
    stacked = closed(L_SHAPE, facade.stacked(3))
    single = volume(closed(L_SHAPE, facade))
    assert stacked.vertices[:, 2].max() == pytest.approx(9.0)
    assert volume(stacked) == pytest.approx(3 * single)


def test_quads_are_plane():
    facade = Facade(3.0, (Band(0, 0.5, -0.3),), random_patches(9))
    for outline in OUTLINES.values():
        assert out_of_plane(facade_mesh(outline, facade)) < 1e-3


def test_order_of_painting_decides():
    both = [Patch(1, 3, 0.5, 2, 0.3), Patch(1, 3, 0.5, 2, 0.1)]
    over = Facade(3.0, layout=lambda edge, length: both)
    only = Facade(3.0, layout=lambda edge, length: both[1:])
    np.testing.assert_array_equal(
        facade_mesh(TURNED, over).vertices, facade_mesh(TURNED, only).vertices
    )


@pytest.mark.parametrize(
    "patch",
    [
        Patch(0.0, 1.0, 0.5, 1.0, 0.2),
        Patch(7.0, 8.0, 0.5, 1.0, 0.2),
        Patch(1.0, 2.0, -0.1, 1.0, 0.2),
        Patch(1.0, 2.0, 0.5, 3.1, 0.2),
    ],
)
def test_patches_that_leave_the_wall_are_refused(patch):
    facade = Facade(
        3.0, layout=lambda edge, length: [patch] if edge == 1 else []
    )
    with pytest.raises(ValueError, match=r"leaves a wall of 8\.00 m"):
        facade_mesh(TURNED, facade)


def test_arch_on_a_band_is_refused():
    facade = Facade(
        3.0,
        (Band(0.0, 1.0, -0.1),),
        lambda edge, length: [Arch(1.0, 2.0, 0.5, 1.5, 2.0, 0.3)],
    )
    with pytest.raises(ValueError, match="depth 0"):
        facade_mesh(TURNED, facade)
