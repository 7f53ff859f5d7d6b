import itertools
import math

from helpers.mesh_checks import is_closed, out_of_plane, volume
import numpy as np
import pytest

from cns_drake.city.facades import outlines, roofs
from cns_drake.city.facades.reliefs import Patch

LINES = {
    "gable": roofs.gable_line(2.0, 10.0, 5.0, 8.0),
    "gambrel": roofs.gambrel_line(2.0, 10.0, 5.0, 8.0),
    "barrel": roofs.barrel_line(2.0, 10.0, 5.0, 8.0),
}
TURNED = outlines.rectangle(1, 2, 15, 11) @ np.array([[0.6, 0.8], [-0.8, 0.6]])


def area(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles()[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def area_below(line, z: float) -> float:
    return sum(
        (b - a) * ((za + zb) / 2 - z)
        for (a, za), (b, zb) in itertools.pairwise(line)
    )


@pytest.mark.parametrize("kind", LINES)
def test_lines_span_the_walls_and_reach_the_top(kind):
    line = LINES[kind]
    assert line[0] == pytest.approx((2.0, 5.0))
    assert line[-1] == pytest.approx((10.0, 5.0))
    assert max(z for _, z in line) == pytest.approx(8.0)


def test_a_barrel_is_a_circle():
    # Half span 4 and rise 3: radius (16 + 9) / 6 around z = 8 - radius.
    radius = 25.0 / 6.0
    for u, z in LINES["barrel"]:
        assert math.hypot(u - 6.0, z - (8.0 - radius)) == pytest.approx(radius)


@pytest.mark.parametrize("kind", LINES)
def test_eaves_continue_the_slopes(kind):
    line = LINES[kind]
    longer = roofs.with_eaves(line, 0.5, 0.25)
    assert longer[0][0] == pytest.approx(1.5)
    assert longer[-1][0] == pytest.approx(10.25)
    for k in (0, -2):
        (a, za), (b, zb) = line[k], line[k + 1]
        (c, zc), (d, zd) = longer[k], longer[k + 1]
        assert (zd - zc) / (d - c) == pytest.approx((zb - za) / (b - a))


@pytest.mark.parametrize("along_y", [False, True])
@pytest.mark.parametrize("kind", LINES)
def test_a_shell_is_a_closed_solid_of_even_thickness(kind, along_y):
    line = LINES[kind]
    shell = roofs.shell(line, -3.0, 4.0, 0.2, along_y=along_y)
    assert is_closed(shell)
    assert out_of_plane(shell) < 1e-9
    assert volume(shell) == pytest.approx(8.0 * 7.0 * 0.2)
    low, high = shell.vertices.min(axis=0), shell.vertices.max(axis=0)
    assert low[int(along_y)] == -3.0
    assert high[int(not along_y)] == 10.0


def test_a_gable_wall_fills_the_space_below_its_line():
    line = LINES["gable"]
    plain = roofs.gable_wall(line, 2.0, 10.0, 4.0)
    # The wall reaches a few centimetres into the roof.
    wanted = area_below(line, 4.0)
    assert wanted < area(plain) < wanted + 8.0 * 0.04
    np.testing.assert_allclose(plain.vertices[:, 1], 0.0)


def test_windows_of_a_gable_are_recesses_with_a_pane():
    line = LINES["gable"]
    holes = [Patch(4.0, 5.0, 4.5, 5.5, 0.3), Patch(5.5, 6.0, 4.2, 5.0, 0.1)]
    plain = roofs.gable_wall(line, 2.0, 10.0, 4.0)
    wall = roofs.gable_wall(line, 2.0, 10.0, 4.0, holes)
    panes = roofs.gable_glass(holes)
    openings = 1.0 * 1.0 + 0.5 * 0.8
    reveals = 4.0 * 0.3 + 2.6 * 0.1
    assert area(panes) == pytest.approx(openings)
    assert area(wall) == pytest.approx(area(plain) - openings + reveals)
    # From outside (+y) no face shows its back.
    both = [*wall.triangles()], [*panes.triangles()]
    for mesh, triangles in zip((wall, panes), both, strict=True):
        for a, b, c in (mesh.vertices[t] for t in triangles):
            assert np.cross(b - a, c - a)[1] > -1e-12


def test_a_hip_on_a_turned_rectangle():
    eaves = 0.5
    fascia = 0.3
    z = 6.0
    top = 9.3
    roof = roofs.hip(TURNED, z, top, eaves, fascia)
    assert out_of_plane(roof) < 1e-9
    # A box of 15 m by 10 m below, half a prism and a pyramid above.
    rise = top - z - fascia
    wanted = 150.0 * fascia + 5.0 * 10.0 * rise / 2 + 100.0 * rise / 3
    assert volume(roof) == pytest.approx(wanted)
