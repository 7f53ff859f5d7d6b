"""What buildings draw, against closed forms."""

import numpy as np
import pytest
from shapely.geometry import box

from cns_drake.city import ARCHETYPES, Dice, Site
from cns_drake.city.buildings import BUILDERS

SEEDS = range(40)


def drawn(name, width, depth, height, blind=()):
    """Returns buildings of an archetype that are drawn but not built."""
    site = Site(box(0, 0, width, depth), "b", frozenset(blind))
    return [
        BUILDERS[name](
            ARCHETYPES[name], site, height, np.random.default_rng(seed)
        )
        for seed in SEEDS
    ]


def test_numbers_lie_in_their_ranges_and_keep_their_digits():
    dice = Dice(np.random.default_rng(1))
    numbers = [dice.uniform(2.0, 3.0, 2) for _ in range(400)]
    assert all(2.0 <= x <= 3.0 and round(x, 2) == x for x in numbers)
    assert np.mean(numbers) == pytest.approx(2.5, abs=0.05)
    assert {dice.whole(2, 5) for _ in range(100)} == {2, 3, 4}
    assert {dice.pick("abc") for _ in range(100)} == set("abc")
    assert np.mean([dice.chance(0.3) for _ in range(2000)]) == pytest.approx(
        0.3, abs=0.04
    )


def test_each_channel_of_a_tinted_colour_has_its_own_factor():
    dice = Dice(np.random.default_rng(2))
    rgb = (0.2, 0.4, 0.8)
    factors = np.array([dice.tinted(rgb, 0.5, 1.0) for _ in range(200)]) / rgb
    assert factors.min() >= 0.5 - 0.0025
    assert factors.max() <= 1.0 + 0.0025
    assert np.abs(np.corrcoef(factors.T) - np.eye(3)).max() < 0.25


@pytest.mark.parametrize(
    ("name", "one", "other", "size", "height"),
    [
        ("glass_skyscraper", "walls", "glass", (30.0, 30.0), 90.0),
        ("podium_tower", "podium", "tower", (40.0, 40.0), 60.0),
    ],
)
def test_two_colours_that_belong_together_are_drawn_together(
    name, one, other, size, height
):
    choices = ARCHETYPES[name].choices
    pairs = set(zip(choices[one], choices[other], strict=True))
    found = {
        (p.walls, p.glass if other == "glass" else p.tower_walls)
        for p in drawn(name, *size, height)
    }
    assert found == pairs


@pytest.mark.parametrize(("height", "has"), [(18.0, False), (18.001, True)])
def test_an_office_above_18_m_has_a_penthouse(height, has):
    for p in drawn("office", 20.0, 20.0, height):
        assert (p.penthouse_height > 0) is has
        assert p.penthouse_height == 0 or 3.4 <= p.penthouse_height <= 4.4


@pytest.mark.parametrize("height", [6.0, 7.0])
def test_a_low_shop_house_is_all_shop_under_a_flat_roof(height):
    """Shops are at least 3.5 m high, and flats need 3.2 m above them."""
    for p in drawn("shop_house", 8.0, 12.0, height):
        assert p.roof == "flat" or height - p.floor >= 3.2
        if height < 3.5 + 3.2:
            assert p.floor == pytest.approx(min(3.4, height - 1.6))


def test_a_hipped_walk_up_rises_by_three_tenths_of_its_span():
    depth, width = 12.0, 20.0
    rises = {p.rise for p in drawn("walk_up", width, depth, 15.0)}
    assert rises == {0.0, 0.3 * (depth - 2.0)}
    # A roof with hips reaches over both sides.
    party = drawn("walk_up", width, depth, 15.0, blind=(1,))
    assert {p.rise for p in party} == {0.0}
    deep = drawn("walk_up", width, 18.0, 15.0)
    assert {p.rise for p in deep} == {0.0}


@pytest.mark.parametrize(
    ("size", "forms"),
    [
        ((12.0, 12.0), {"bandstand", "shelter", "tea_house"}),
        ((18.0, 12.1), {"bandstand", "shelter", "tea_house"}),
        ((18.0, 12.0), {"shelter"}),
        ((8.0, 12.0), {"shelter"}),
    ],
)
def test_a_long_pavilion_is_a_shelter(size, forms):
    """That is, one of which a side is 1.5 times as long as the other."""
    assert {p.form for p in drawn("park_pavilion", *size, 6.0)} == forms


def test_houses_of_a_terrace_have_no_flat_roof_and_a_low_rise():
    terraces = drawn("terrace", 30.0, 12.0, 9.0)
    assert {p.roof for p in terraces} == {"gable", "gambrel"}
    assert all(0.6 <= p.rise <= 0.92 for p in terraces)
    assert all(p.floor <= 0.5 for p in terraces)
    assert {p.house_bay for p in terraces} == {"canted", "box", "oriel"}
