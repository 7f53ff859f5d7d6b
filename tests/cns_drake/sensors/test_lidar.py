"""The Lidar system in a Diagram with a SceneGraph, against closed forms."""

from helpers.closed_forms import box, cylinder, ellipsoid
from helpers.lidar_stage import (
    FORWARD,
    X_WS,
    Stage,
    ahead,
    beam_index,
    positions,
)
import numpy as np
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.perception import PointCloud
import pytest

from cns_drake.sensors import POINT_DTYPE, MeasurementModel
from worlds.shapes import StructureEntry, StructureTable


def test_box_room():
    """A room's inner walls, seen from a tilted sensor off its middle."""
    size = (10.0, 8.0, 3.0)
    center = np.array([0.7, 0.2, 1.0])
    stage = Stage()
    for axis in range(3):
        for side in (-1, 1):
            wall = np.full(3, 30.0)
            wall[axis] = 1.0
            p = center.copy()
            p[axis] += side * (size[axis] / 2 + 0.5)
            name = f"room::wall_{axis}_{side}"
            stage.add(name, Box(*wall), RigidTransform(p))
    scan = stage.finish().eval()

    pattern = stage.lidar.pattern
    d_W = pattern.d_Sset @ X_WS.rotation().matrix().T
    expected = box(X_WS.translation() - center, d_W, size)
    beams = beam_index(scan, pattern)
    outside = expected < pattern.min_range
    np.testing.assert_array_equal(beams, np.flatnonzero(~outside))
    p_S = positions(scan)
    np.testing.assert_allclose(
        p_S, expected[beams, None] * pattern.d_Sset[beams], atol=3e-6
    )
    np.testing.assert_allclose(
        scan["intensity"], np.exp(-0.004 * expected[beams]), atol=1e-6
    )
    assert np.unique(scan["instance"]).tolist() == [1]


@pytest.mark.parametrize(
    ("shape", "closed_form"),
    [
        (Sphere(3.0), lambda p, d: ellipsoid(p, d, (3.0, 3.0, 3.0))),
        (Cylinder(2.0, 5.0), lambda p, d: cylinder(p, d, 2.0, 5.0)),
    ],
)
def test_curved_shape(shape, closed_form):
    X_WG = RigidTransform(RollPitchYaw(0.4, 0.9, -0.2), [12.0, 9.0, 1.0])
    stage = Stage()
    stage.add("thing", shape, X_WG)
    scan = stage.finish().eval()
    pattern = stage.lidar.pattern
    X_GS = X_WG.inverse() @ X_WS
    d_G = pattern.d_Sset @ X_GS.rotation().matrix().T
    expected = closed_form(X_GS.translation(), d_G)
    beams = beam_index(scan, pattern)
    hit = np.flatnonzero(np.isfinite(expected))
    assert len(hit) > 300
    assert len(np.setxor1d(beams, hit)) <= 1  # A beam along the very edge.
    common = np.intersect1d(beams, hit)
    measured = np.linalg.norm(positions(scan), axis=1)
    error = np.abs(measured[np.isin(beams, common)] - expected[common])
    assert error.max() < 1e-3
    assert np.median(error) < 5e-6


@pytest.mark.parametrize(
    ("distance", "seen"),
    [
        (0.8 - 1e-4, False),
        (0.8 + 1e-4, True),
        (120.0 - 1e-3, True),
        (120.0 + 1e-3, False),
    ],
)
def test_range_limits(distance, seen):
    stage = Stage()
    X_WG = RigidTransform([distance + 0.5, 0.0, 0.0])
    stage.add("wall", Box(1.0, 0.2, 0.2), X_WG)
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    measured = ahead(stage.eval())
    assert (measured is not None) == seen
    if seen:
        assert measured == pytest.approx(distance, abs=1e-5)


def test_too_near_surfaces_hide_those_behind():
    stage = Stage()
    stage.add("film", Box(0.01, 1.0, 1.0), RigidTransform([0.5, 0.0, 0.0]))
    stage.add("wall", Box(1.0, 9.0, 9.0), RigidTransform([8.0, 0.0, 0.0]))
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    assert ahead(stage.eval()) is None


@pytest.mark.parametrize(("offset", "seen"), [(-1e-4, True), (1e-4, False)])
def test_grazing_an_edge(offset, seen):
    stage = Stage()
    stage.add(
        "box", Box(2.0, 2.0, 2.0), RigidTransform([6.0, 1.0 + offset, 0.0])
    )
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    assert (ahead(stage.eval()) is not None) == seen


def test_follows_moving_geometry():
    stage = Stage()
    frame = stage.add_frame("car", 7, RigidTransform([10.0, 0.0, 0.0]))
    stage.add("body", Sphere(1.0), frame=frame)
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    assert ahead(stage.eval()) == pytest.approx(9.0, abs=1e-5)
    stage.poses[frame] = RigidTransform([30.0, 0.6, 0.0])
    stage.set_poses()
    assert ahead(stage.eval()) == pytest.approx(30.0 - 0.8, abs=1e-5)
    stage.poses[frame] = RigidTransform([30.0, 1.2, 0.0])
    stage.set_poses()
    assert ahead(stage.eval()) is None


def test_labels_and_instances_come_from_the_structure_table():
    stage = Stage()
    stage.add("city::tower_2/door", Box(1, 1, 9), RigidTransform([5, 0, 0]))
    stage.add("city::oak_1/crown", Sphere(1.0), RigidTransform([-5, 0, 0]))
    stage.add("city::new_9/top", Sphere(1.0), RigidTransform([0, 5, 0]))
    table = StructureTable(
        [
            StructureEntry(41, "tower_2", "building"),
            StructureEntry(7, "oak_1", "vegetation"),
        ]
    )
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD, structures=table)
    scan = stage.eval()
    found = {
        (round(float(r["x"])), round(float(r["y"]))): (
            r["label"],
            r["instance"],
        )
        for r in scan
    }
    assert found == {(4, 0): (50, 41), (-4, 0): (70, 7), (0, 4): (0, 42)}


def test_point_cloud_has_the_points_of_the_scan():
    stage = Stage()
    stage.add("ball", Sphere(1.0), RigidTransform([5, 2, 1]))
    stage.finish()
    cloud = stage.eval("point_cloud_S")
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(
        cloud.xyzs(), positions(stage.eval()).T.astype(np.float32)
    )


def test_a_cloned_context_has_poses_of_its_own():
    stage = Stage()
    stage.add("wall", Box(1.0, 9.0, 9.0), RigidTransform([20.5, 0.0, 0.0]))
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)

    def ahead_from(x):
        columns = FORWARD.num_columns
        X_WB = np.eye(4)[:3]
        X_WB[0, 3] = x
        port = stage.lidar.GetInputPort("sweep")
        port.FixValue(
            stage.lidar.GetMyMutableContextFromRoot(stage.context),
            np.tile(X_WB, (columns, 1, 1)).ravel(),
        )
        return ahead(stage.eval())

    assert ahead_from(1.0) == pytest.approx(19.0, abs=1e-5)
    original = stage.context
    stage.context = stage.context.Clone()
    assert ahead_from(3.0) == pytest.approx(17.0, abs=1e-5)
    stage.context = original
    assert ahead(stage.eval()) == pytest.approx(19.0, abs=1e-5)


def test_a_world_without_geometry_gives_an_empty_scan():
    stage = Stage().finish()
    assert stage.eval().tolist() == []
    assert stage.eval("point_cloud_W").size() == 0


def test_point_layout_is_that_of_a_c_struct():
    offsets = [POINT_DTYPE.fields[n][1] for n in POINT_DTYPE.names]
    assert offsets == [0, 4, 8, 12, 16, 20, 24, 26]
    assert POINT_DTYPE.itemsize == 28


def test_resolution_rounds_coordinates_and_intensity():
    rng = np.random.default_rng(7)
    exact, rounded = (Stage() for _ in range(2))
    for stage in (exact, rounded):
        stage.add("room::ball", Sphere(6.0), RigidTransform([9.0, 1.0, 2.0]))
        stage.add("room::floor", Box(200, 200, 0.2))
    step = 2.0 ** -int(rng.integers(8, 11))
    exact = exact.finish().eval()
    rounded = rounded.finish(
        measurement=MeasurementModel(resolution=step)
    ).eval()
    steps = positions(rounded) / step
    np.testing.assert_array_equal(steps, np.rint(steps))
    error = np.abs(positions(rounded) - positions(exact))
    assert 0.4 * step < error.max() <= 0.5 * step + 1e-5
    error = np.abs(rounded["intensity"] - exact["intensity"])
    assert 0 < error.max() <= 2.0**-13 + 1e-7
    for name in ("ring", "t", "label", "instance"):
        np.testing.assert_array_equal(rounded[name], exact[name])
