"""Weather: counts of drops, and independence of sensors and frames."""

from helpers.plates import ahead, facing, plate, scan, unit
import numpy as np
from pydrake.math import RigidTransform
import pytest
from scipy import integrate

from cns_drake.sensors import Weather
from worlds.shapes import CLASS_IDS, StructureEntry, StructureTable

OUTLIER = CLASS_IDS["outlier"]
DIAMETERS_MM = np.linspace(0.01, 25.0, 4_000)


def test_extinction_of_rain_is_that_of_geometric_optics():
    rate = 10.0
    slope = 4.1 * rate**-0.21
    # 2 pi / 4 D^2 N(D), in closed form: 2 / slope^3.
    expected = 2e-6 * np.pi / 4.0 * 8000.0 * 2.0 / slope**3
    assert Weather(rain=rate).extinction == pytest.approx(expected, rel=0.01)
    # 0.0016 / m at 10 mm/h.
    assert expected == pytest.approx(0.0016, abs=1e-4)
    assert Weather(100.0).extinction == pytest.approx(np.log(20.0) / 100.0)
    assert Weather().extinction == 0.0


@pytest.mark.parametrize(
    ("weather", "slowest", "fastest"),
    [
        (Weather(snowfall=0.3), 0.7, 1.2),
        (Weather(snowfall=3.0), 0.7, 1.2),
        (Weather(rain=1.0), 2.5, 5.0),
        (Weather(rain=30.0), 4.0, 8.0),
    ],
)
def test_the_water_in_the_air_falls_as_fast_as_measured(
    weather, slowest, fastest
):
    """The rate over the water content of the air is the speed of falling.

    Flakes fall by 0.7 to 1.2 m/s, rain of the mean size by 3 to 8 m/s (Gunn
    and Kinzer, 1949).
    """
    rate = weather.rain + weather.snowfall
    ((number, _),) = weather.drops(DIAMETERS_MM)
    grams = integrate.trapezoid(
        number * np.pi / 6.0 * 1e-3 * DIAMETERS_MM**3, DIAMETERS_MM
    )
    assert slowest < rate * 1e3 / 3600.0 / grams < fastest


def test_flakes_send_back_by_their_lidar_ratio():
    weather = Weather(snowfall=1.0)
    ((number, rho),) = weather.drops(DIAMETERS_MM)
    area = np.pi / 4.0 * (DIAMETERS_MM * 1e-3) ** 2
    backscatter = integrate.trapezoid(number * area * rho / np.pi, DIAMETERS_MM)
    assert weather.extinction / backscatter == pytest.approx(25.0, rel=0.01)


@pytest.mark.slow
def test_a_sky_of_moderate_snow_is_mostly_empty():
    """1 mm/h, a moderate snowfall, shows in fewer than one beam in five."""
    far = plate("far", 0.5, RigidTransform([0.0, 0.0, -300.0]), (1, 1, 1))
    returns = unit(weather=Weather(snowfall=1.0))
    share = len(scan([far], ahead(4_000), returns)) / 4_000
    assert 0.02 < share < 0.2


def test_drops_hide_nothing_that_is_brighter():
    weather = Weather(rain=20.0)
    wall = plate("wall", 0.8, facing(8.0))
    points = scan([wall], ahead(5_000), unit(weather=weather))
    assert np.mean(points["label"] != OUTLIER) > 0.98


def test_fog_shows_where_nothing_else_does():
    far = plate("far", 0.5, RigidTransform([0.0, 0.0, -300.0]), (1, 1, 1))
    counts = [
        len(scan([far], ahead(2_000), unit(weather=Weather(visibility))))
        for visibility in (30.0, 100.0, 300.0, 3_000.0)
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 1_600
    assert counts[-1] == 0


def test_fog_behind_a_black_wall_is_hidden():
    wall = plate("wall", 0.0, facing(3.0))
    points = scan([wall], ahead(2_000), unit(weather=Weather(30.0)))
    assert len(points) > 500
    assert 2.9 < points["x"].max() < 3.2
    assert (points["label"] == OUTLIER).all()


def test_zero_rates_are_clear_air():
    wall = plate("wall", 0.3, facing(30.0))
    clear = scan([wall], ahead(3_000), unit())
    zero = scan([wall], ahead(3_000), unit(weather=Weather(None, 0.0, 0.0)))
    assert clear.tobytes() == zero.tobytes()


def test_wet_asphalt_is_darker():
    table = StructureTable([StructureEntry(1, "road", "road")])
    road = plate("road", None, facing(10.0))
    dry, wet = (
        np.median(
            scan([road], ahead(100), unit(weather=weather), structures=table)[
                "intensity"
            ]
        )
        for weather in (Weather(), Weather(rain=1.0))
    )
    # The grain that the beams meet is brighter or darker than the mean.
    assert 7.5 <= dry <= 22.5
    # rho (1 - p) / (1 - p rho), p = 1 - (1 - 0.066) / 1.33^2, and the drops
    # in between.
    assert wet / dry == pytest.approx(8.5 / 15.0, abs=0.1)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("visibility", 4.999),
        ("visibility", 1e6 + 1.0),
        ("rain", -0.001),
        ("snowfall", 300.001),
        ("rain", np.nan),
    ],
)
def test_senseless_weather(field, value):
    for visibility in (5.0, 1e6):
        assert not Weather(visibility, 300.0, 300.0).is_clear
    with pytest.raises(ValueError, match=field):
        Weather(**{field: value})


def test_each_beam_has_a_draw_of_its_own():
    weather = Weather(200.0, 5.0, 0.1)
    wall = plate("wall", 0.2, facing(35.0))
    returns = unit(weather=weather)
    pattern = ahead(2_000, spread=0.1)
    first = scan([wall], pattern, returns, frame=7)
    assert first.tobytes() == scan([wall], pattern, returns, 7).tobytes()
    assert first.tobytes() != scan([wall], pattern, returns, 8).tobytes()
    # Other surfaces for half of the beams change none of the other beams.
    near = plate("z_near", 0.5, facing(5.0, 20.0 + 0.5), (0.1, 40.0, 40.0))
    other = scan([wall, near], pattern, returns, 7)
    kept = other[other["y"] < -0.2]
    same = first[first["y"] < -0.2]
    assert len(same) > 500
    np.testing.assert_array_equal(kept, same)
    # Another sensor's name or seed gives other drops, too.
    for change in ({"seed": 6}, {"sensor_name": "rear"}):
        others = scan([wall], pattern, unit(weather=weather, **change), 7)
        assert others.tobytes() != first.tobytes()
