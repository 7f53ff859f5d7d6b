from helpers.city_checks import HEADROOM
from helpers.mesh_checks import rotation_matrix
import numpy as np
import pytest

from worlds.shapes import OBJECTS, assemble, bar, block, post


def test_post_spans_from_the_root_to_its_height():
    part = post("mast", 0.1, 6.0, (1.0, -2.0))
    half = part.shape.length / 2
    assert part.xyz[:2] == (1.0, -2.0)
    assert part.xyz[2] + half == pytest.approx(6.0)
    assert part.xyz[2] - half == pytest.approx(-0.3)


def test_bar_ends_at_its_two_points():
    rng = np.random.default_rng(5)
    for start, end in rng.uniform(-3, 3, (20, 2, 3)):
        part = bar("arm", start, end, 0.05)
        half = [0.0, 0.0, part.shape.length / 2]
        R = rotation_matrix(part.rpy)
        np.testing.assert_allclose(part.xyz + R @ half, end, atol=1e-12)
        np.testing.assert_allclose(part.xyz - R @ half, start, atol=1e-12)


def test_footprint_ignores_what_hangs_above_the_headroom():
    mast = post("mast", 0.1, 5.0)
    high = block("sign", (3.0, 3.0, 0.5), (2.0, 0.0, HEADROOM + 0.26))
    low = block("sign", (3.0, 3.0, 0.5), (2.0, 0.0, HEADROOM + 0.24))
    assert assemble(mast, high).footprint.bounds[2] < 0.2
    assert assemble(mast, low).footprint.bounds[2] > 3.5


def test_footprint_cuts_a_slanted_part_at_the_headroom():
    # The post reaches from the ground to twice the headroom; half of it counts.
    lean = bar("lean", (0, 0, 0), (4.0, 0, 2 * HEADROOM), 0.001)
    assert assemble(lean).footprint.bounds[2] == pytest.approx(2.0, abs=0.03)


@pytest.mark.parametrize("name", ["obelisk", "bench", "hedge", "palm", "van"])
def test_an_unknown_parameter_of_an_object_is_refused(name):
    with pytest.raises(TypeError, match="no parameter colour"):
        OBJECTS[name].build(np.random.default_rng(0), colour=1)


def test_a_given_parameter_leaves_the_other_draws_alone():
    drawn, given = (
        OBJECTS["shrub"].build(np.random.default_rng(3), **parameters).parts[0]
        for parameters in ({}, {"height": 0.5})
    )
    assert given.shape.scale[2] == 0.5 != drawn.shape.scale[2]
    assert (given.shape.mesh, given.rpy) == (drawn.shape.mesh, drawn.rpy)
    assert given.rgb == drawn.rgb
