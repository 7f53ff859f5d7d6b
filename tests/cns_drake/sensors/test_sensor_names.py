"""Names of sensors: what Drake takes, and what a recording takes."""

import math

import numpy as np
from pydrake.geometry import Box, Meshcat
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.recording import (
    BagWriter,
    McapRecorder,
    RecordedSensor,
    points_topic,
    recording_topics,
)
from cns_drake.sensors import (
    ApplyImuConfig,
    ApplyLidarConfig,
    ApplyOdometryConfig,
    ImuConfig,
    ImuNoise,
    LidarConfig,
    OdometryConfig,
    add_imu,
    add_lidar,
    add_lidar_view,
    add_odometry,
)
from cns_drake.simulation import add_mcap_recorder

X_PS = RigidTransform([0.0, 0.0, 1.0])
# What no recording can have as the name of a LiDAR.
UNRECORDED = (
    *("a/b", "a b", "A::b", "..", "/", "ünï", "9a", "a__b", "a-b", "a\n"),
    *("map", "base_link", "imu", "odometry", "objects", "tf", "tf_static"),
)


class Site:
    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, 0.0
        )
        self.plant.RegisterVisualGeometry(
            self.plant.world_body(), X_PS, Box(9, 9, 9), "b", np.ones(4)
        )
        self.plant.Finalize()
        self.lcm = DrakeLcm("memq://")

    def lidar(self, name):
        body = self.plant.world_body()
        return add_lidar(
            self.builder, self.scene_graph, body, X_PS, "vlp-16", name=name
        )

    def imu(self, name):
        noise = ImuNoise(gyroscope_noise_density=0.1)
        body = self.plant.world_body()
        add_imu(self.builder, body, X_PS, name=name, rate=9, noise=noise)

    def odometry(self, name):
        add_odometry(self.builder, self.plant.world_body(), name=name)

    def lidar_config(self, name):
        ApplyLidarConfig(LidarConfig(name=name), self.builder, lcm=self.lcm)

    def imu_config(self, name):
        ApplyImuConfig(ImuConfig(name=name), self.builder, lcm=self.lcm)

    def odometry_config(self, name):
        config = OdometryConfig(name=name)
        ApplyOdometryConfig(config, self.builder, lcm=self.lcm)


WAYS = [name for name in vars(Site) if not name.startswith("_")]


@pytest.mark.parametrize("way", WAYS)
def test_a_name_is_any_that_drake_takes(way):
    for name in ("", 3, None):
        site = Site()
        with pytest.raises((TypeError, ValueError), match=r"name: "):
            getattr(site, way)(name)
        assert len(site.builder.GetSystems()) == 2
    site = Site()
    for name in ("roof", *UNRECORDED):
        getattr(site, way)(name)
    site.builder.Build()


@pytest.mark.parametrize("name", UNRECORDED)
def test_a_recorded_name_is_a_part_of_a_topic(tmp_path, name):
    site = Site()
    fault = "cannot be a part of a ROS 2 topic|is the name of another frame"
    with pytest.raises(ValueError, match=fault):
        add_mcap_recorder(
            site.builder, tmp_path / "bag", lidars=[site.lidar(name)]
        )
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("second", WAYS)
@pytest.mark.parametrize("first", WAYS)
def test_a_diagram_with_two_sensors_can_be_built(first, second):
    """Two of a name are refused, of whatever kinds."""
    site = Site()
    getattr(site, first)("one")
    known = [system.get_name() for system in site.builder.GetSystems()]
    with pytest.raises(ValueError, match="the diagram has a system 'one"):
        getattr(site, second)("one")
    names = [system.get_name() for system in site.builder.GetSystems()]
    assert names == known
    getattr(site, second)("two")
    site.builder.Build()


def test_a_lidar_has_one_view():
    site = Site()
    meshcat = Meshcat()
    lidar = site.lidar("roof")
    for period in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match=f"^period: {period} is not"):
            add_lidar_view(site.builder, lidar, meshcat, period=period)
    add_lidar_view(site.builder, lidar, meshcat, period=0.0)
    with pytest.raises(ValueError, match="has a system 'roof_view'"):
        add_lidar_view(site.builder, lidar, meshcat)
    site.builder.Build()


def test_names_of_a_recorder_of_ones_own(tmp_path):
    bag = BagWriter(
        tmp_path / "bag",
        recording_topics(["a"]),
        start_ns=0,
        attachments={},
        scenario={},
    )
    further = RecordedSensor(points_topic("a"), X_PS, lambda *values: None)
    for lidars, sensors, fault in (
        (["a/b"], {}, "'a/b' cannot be a part"),
        (["base_link"], {}, "'base_link' is the name of another"),
        (["a"], {"a": further}, "'a' is the name of another"),
        (["a"], {"imu": further}, "'imu' is the name of another"),
        (["a"], {"radar": further}, "/a/points: two sensors have this topic"),
        (
            ["b"],
            {"b_scan": further},
            "two sensors would have the port 'b_scan'",
        ),
        (
            ["b"],
            {"c": further._replace(frame="map")},
            "'map' is the name of another",
        ),
    ):
        with pytest.raises(ValueError, match=fault):
            McapRecorder(
                bag,
                X_BSs=dict.fromkeys(lidars, X_PS),
                further=sensors,
                period=0.1,
            )
