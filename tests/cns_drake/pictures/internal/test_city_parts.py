import numpy as np
import pytest

from cns_drake.pictures.city_parts import (
    ColouredPart,
    compare_parts,
    read_parts,
)
from cns_drake.scene import CLASS_RGB, TriangleSurface, load_world

# Levels of a house: a square prism has these, and eight triangles between two.
LOW = (0.0, 4.0)
HIGH = (0.0, 4.0, 9.0)


def house(*levels, x=0.0):
    """A part with walls between levels, each a ring of four corners."""
    ring = [(x, 0.0), (x + 2.0, 0.0), (x + 2.0, 2.0), (x, 2.0)]
    vertices = [(*corner, z) for z in levels for corner in ring]
    triangles = []
    for k in range(len(levels) - 1):
        for i in range(4):
            a, b = 4 * k + i, 4 * k + (i + 1) % 4
            triangles += [(a, b, b + 4), (a, b + 4, a + 4)]
    return ColouredPart(
        "building",
        (0.7, 0.3, 0.2),
        TriangleSurface(np.array(vertices), np.array(triangles, np.int32)),
    )


def extent(parts):
    """Returns lowest and highest z, and how many triangles there are."""
    z = np.concatenate([part.surface.p_GVset[:, 2] for part in parts])
    return z.min(), z.max(), sum(len(p.surface.triangles) for p in parts)


def test_same_structures_are_common():
    own, other = {"a": [house(*LOW)]}, {"a": [house(*LOW, x=1.0)]}
    difference = compare_parts(own, other)
    assert difference.common == own["a"]
    assert not difference.additional
    assert not difference.missing


def test_structures_of_one_stage_only():
    own, other = {"a": [house(*LOW)]}, {"b": [house(*HIGH)]}
    difference = compare_parts(own, other)
    assert difference.additional == own["a"]
    assert difference.missing == other["b"]
    assert not difference.common


def test_lowered_structure_shows_what_rises_above_it():
    own, other = {"a": [house(*LOW)]}, {"a": [house(*HIGH)]}
    difference = compare_parts(own, other)
    assert difference.common == own["a"]
    assert extent(difference.missing) == (4.0, 9.0, 8)
    assert difference.missing[0].rgb == (0.7, 0.3, 0.2)
    assert not difference.additional


def test_higher_structure_is_additional_above_the_other():
    own, other = {"a": [house(*HIGH)]}, {"a": [house(*LOW)]}
    difference = compare_parts(own, other)
    assert extent(difference.common) == (0.0, 4.0, 8)
    assert extent(difference.additional) == (4.0, 9.0, 8)
    assert not difference.missing


@pytest.mark.parametrize(("height", "count"), [(4.4, 0), (4.6, 8)])
def test_half_a_metre_is_no_change(height, count):
    own, other = {"a": [house(*LOW)]}, {"a": [house(0.0, height)]}
    lower = compare_parts(own, other).missing
    assert sum(len(part.surface.triangles) for part in lower) == count


def test_parts_are_read_in_the_world_and_in_their_colours(tmp_path):
    (tmp_path / "structures.csv").write_text(
        "instance,name,class\n1,hall,building\n2,pond,other-ground\n"
    )
    box = "<geometry><box><size>2 4 6</size></box></geometry>"
    blue = "<material><diffuse>0.25 0.38 0.45 1</diffuse></material>"
    (tmp_path / "stage.sdf").write_text(
        '<sdf version="1.9"><world name="w"><model name="town">'
        '<static>true</static><pose>10 20 0 0 0 1.5707963</pose><link name="l">'
        f'<visual name="hall/wall"><pose>0 0 3 0 0 0</pose>{box}</visual>'
        f'<visual name="pond/water">{box}{blue}</visual>'
        "</link></model></world></sdf>"
    )
    parts = read_parts(load_world(tmp_path / "stage.sdf"))
    (hall,), (pond,) = parts["hall"], parts["pond"]
    assert hall.rgb == CLASS_RGB["building"]
    assert pond.rgb == pytest.approx((0.25, 0.38, 0.45))
    low, high = np.min(hall.surface.p_GVset, 0), np.max(hall.surface.p_GVset, 0)
    np.testing.assert_allclose(low, [8.0, 19.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(high, [12.0, 21.0, 6.0], atol=1e-6)
    assert hall.top() == pytest.approx(6.0)
