"""Wide beams, leaves and panes, against closed forms."""

from helpers.plates import ahead, beside, facing, plate, scan, unit
import numpy as np
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
from scipy import stats
from scipy.special import erf

from cns_drake.scene import TriangleSurface, is_closed
from cns_drake.sensors import Echoes, make_beam_pattern
from evaluation.lidar_sheets import LIDAR_PRESETS
from worlds.shapes import StructureEntry, StructureTable

TREE = StructureTable([StructureEntry(1, "tree", "vegetation")])
HOUSE = StructureTable(
    [
        StructureEntry(1, "house", "building", materials={"glass": "glass"}),
        StructureEntry(2, "behind", "building", 0.5),
        StructureEntry(3, "side", "building", 0.5),
    ]
)


@pytest.mark.parametrize("part", [-0.8, -0.3, 0.01, 0.2, 0.7])
def test_the_share_of_an_edge_is_that_of_the_beams_profile(part):
    """A dark plate covers the right of every beam up to an edge."""
    sheet = LIDAR_PRESETS["os0-128"].returns
    distance = 10.0
    edge = part * distance * sheet.divergence
    near = plate("near", 0.4, facing(distance, edge - 5.0), (0.1, 10.0, 40.0))
    # The far plate is so near that both are one echo, whose energy gives the
    # share.
    far = plate("far", 0.0, facing(distance + 0.3))
    # A neighbour beyond the edge makes the beam count as next to one.
    off = 3.0 * sheet.divergence
    pattern = beside(5_000, off if part >= 0.0 else -off)
    points = scan([near, far], pattern, unit("os0-128"))
    points = points[points["ring"] == 0]
    share = points["intensity"].sum() / 40.0 / 5_000
    expected = 0.5 * (1.0 + erf(np.sqrt(2.0) * part))
    assert share == pytest.approx(expected, abs=0.02)


def test_no_sub_rays_where_there_is_no_edge():
    """Beams that meet one plane, though at a slant, have its exact range."""
    X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, 1.2), [9.0, 0.0, 0.0])
    fan = ahead(2_000, spread=0.2)
    target = plate("wall", 0.8, X_WG)
    points = scan([target], fan, unit())
    # Twice the noise of a range at this SNR, where sub-rays would be at all
    # distances that the beam's width spans.
    normal = X_WG.rotation().matrix()[:, 0]
    p = np.stack([points[axis] for axis in "xyz"], axis=1) - [9.0, 0.0, 0.0]
    assert np.abs(np.abs(p @ normal) - 0.05).max() < 0.05


@pytest.mark.parametrize("shape", [Sphere(6.0), Box(12.0, 12.0, 12.0)])
def test_depths_in_a_crown_are_exponential(shape):
    p_WC = np.array([16.0, 0.0, 0.0])
    crown = plate("tree/leaves", None, RigidTransform(p_WC), shape=shape)
    pattern = make_beam_pattern("os1-128").within((-15, 15), (-15, 15))
    points = scan([crown], pattern, unit(), structures=TREE)
    p = np.stack([points[axis] for axis in "xyz"], axis=1).astype(float)
    ranges = np.linalg.norm(p, axis=1)
    along = p @ p_WC / ranges
    start = 10.0 * ranges / p[:, 0]
    if isinstance(shape, Sphere):
        start = along - np.sqrt(along**2 - 16.0**2 + 6.0**2)
    # Rays that enter next to each other meet the same clump.
    cell = np.floor(p * (start / ranges)[:, None]).astype(int)
    depth = (ranges - start)[np.unique(cell, axis=0, return_index=True)[1]]
    assert len(depth) > 60
    # G LAD; nearly no ray leaves a crown again.
    result = stats.kstest(depth, stats.expon(scale=1 / 1.5).cdf)
    assert result.pvalue > 1e-3
    assert len(points) > 0.9875 * len(pattern.beams(0).ring)
    assert (points["instance"] == 1).all()


def test_some_light_gets_through_a_thin_crown():
    # From afar there are thousands of clumps.
    X_WG = RigidTransform([60.5, 0.0, 0.0])
    crown = plate("tree/leaves", None, X_WG, (1.0, 200.0, 200.0))
    wall = plate("behind", 0.9, facing(63.0))
    pattern = make_beam_pattern("os1-128").within((-30, 30), (-15, 15))
    points = scan([crown, wall], pattern, unit(), structures=TREE)
    through = np.mean(points["x"] > 62.0)
    p = np.stack([points[axis] for axis in "xyz"], axis=1)
    path = np.linalg.norm(p, axis=1) / p[:, 0]
    assert through == pytest.approx(np.exp(-1.5 * path).mean(), abs=0.02)


def test_leaves_stay_where_they_are():
    X_WG = RigidTransform([14.0, 0.0, 0.0])
    crown = plate("tree/leaves", None, X_WG, (10.0, 40.0, 40.0))
    pattern = make_beam_pattern("os1-128").within((-5, 5), (-15, 15))
    scans = [
        scan([crown], pattern, unit(seed=seed), frame, TREE)["x"]
        for seed, frame in ((0, 0), (5, 7))
    ]
    assert np.ptp(scans[0]) > 1.0
    assert np.abs(scans[0] - scans[1]).max() < 0.3
    # Neighbours often meet the same clump or twig; else ln 2 / (G LAD) is 0.46.
    assert np.median(np.abs(np.diff(scans[0]))) < 0.25


def test_single_leaves_are_no_volume():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    assert is_closed(TriangleSurface(corners, faces))
    assert not is_closed(TriangleSurface(corners, faces[:3]))


def test_a_pane_mirrors_with_the_whole_way_as_range():
    angle = np.deg2rad(75.0)
    X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, angle), [6.0, 0.0, 0.0])
    pane = plate("house/glass", None, X_WG, (1e-5, 30.0, 30.0))
    # The pane mirrors light to a wall aside.
    wall = plate(
        "side", None, RigidTransform([0.0, 5.05, 0.0]), (400.0, 0.1, 400.0)
    )
    points = scan(
        [pane, wall],
        ahead(500),
        unit("avia", echoes=Echoes.LAST),
        structures=HOUSE,
    )
    turned = np.pi - 2.0 * angle
    assert len(points) > 450
    normal = np.array([-np.cos(angle), -np.sin(angle)])
    d = np.array([1.0, 0.0]) - 2.0 * normal[0] * normal
    assert abs(np.arctan2(d[1], d[0])) == pytest.approx(turned)
    if d[1] > 0.0:
        assert np.median(points["x"]) == pytest.approx(
            6.0 + 5.0 / np.sin(turned), abs=0.05
        )


def test_a_pane_at_right_angles_blinds():
    pane = plate("house/glass", None, facing(10.0), (1e-4, 40.0, 40.0))
    points = scan([pane], ahead(200), unit(), structures=HOUSE)
    assert (points["intensity"] > 100.0).all()


def test_retro_reflectors_shine_at_any_angle():
    sheeting = {"plate": "stop_sign"}
    sign = StructureEntry(1, "sign_001", "traffic-sign", materials=sheeting)
    signs = StructureTable([sign])
    bright = []
    for tilt in (0.0, 0.6):
        X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, tilt), [30.0, 0.0, 0.0])
        plate_ = plate("sign_001/plate", None, X_WG)
        points = scan([plate_], ahead(100), unit(), structures=signs)
        bright.append(np.median(points["intensity"]))
    assert bright[0] == bright[1] > 100.0


@pytest.mark.parametrize("above_deg", [60.0, 20.0, 3.0])
def test_markings_shine_however_flat_they_are_seen(above_deg):
    """pi times 150 mcd/m2/lx, which EN 1436 asks for 1.24 deg above them."""
    road = StructureTable(
        [
            StructureEntry(1, "markings", "road", materials={"": "markings"}),
            StructureEntry(2, "asphalt", "road"),
        ]
    )
    bright = {}
    tilt = np.deg2rad(90.0 - above_deg)
    for name in ("markings", "asphalt"):
        found = []
        for x in np.linspace(10.0, 14.0, 9):
            X_WG = RigidTransform(RollPitchYaw(0.0, 0.0, tilt), [x, 0.0, 0.0])
            plate_ = plate(name, None, X_WG)
            points = scan([plate_], ahead(100), unit(), structures=road)
            found.append(points["intensity"])
        bright[name] = np.median(np.concatenate(found))
    assert bright["markings"] == 47.0
    # Oren and Nayar for slopes of 30 deg, over their value for a target that
    # faces the unit; nine patches are brighter or darker than the mean.
    cosine = np.sin(np.deg2rad(above_deg))
    a, b = (1.0 - 0.5 * 0.274 / 0.604), 0.45 * 0.274 / 0.364
    expected = 15.0 * (cosine + b / a * (1.0 - cosine**2))
    assert bright["asphalt"] == pytest.approx(expected, rel=0.5)


@pytest.mark.parametrize("echoes", list(Echoes))
def test_which_echoes_are_reported(echoes):
    """Half of each beam meets a dark plate, the rest a bright plate behind."""
    sheet = LIDAR_PRESETS["os1-64"].returns
    near = plate("near", 0.2, facing(10.0, -4.9999), (0.1, 10.0, 40.0))
    far = plate("far", 0.9, facing(13.0))
    pattern = beside(1_000, 3.0 * sheet.divergence)
    points = scan([near, far], pattern, unit(echoes=echoes))
    points = points[points["ring"] == 0]
    ranges = np.round(points["x"])
    assert {10.0, 13.0} >= set(ranges)
    if echoes is Echoes.DUAL:
        assert len(points) > 1_800
        assert (np.diff(points["t"].astype(int)) >= 0).all()
        assert np.mean(ranges == 10.0) == pytest.approx(0.5, abs=0.06)
    else:
        assert len(points) <= 1_000
        wanted = 10.0 if echoes is Echoes.FIRST else 13.0
        assert np.mean(ranges == wanted) > 0.85
