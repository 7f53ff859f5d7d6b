import itertools
import math

from helpers.mesh_checks import volume
from helpers.winding import winding_numbers
import numpy as np
import pytest
from shapely.geometry import Polygon

from worlds.city.facades import solids
from worlds.city.facades.reliefs import Arch, Patch
from worlds.city.facades.walls import Facade, facade_mesh, glass_mesh
from worlds.shapes import outlines
from worlds.shapes.mesh import merge_meshes

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
