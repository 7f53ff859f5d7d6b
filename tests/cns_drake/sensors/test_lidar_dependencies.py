"""Which outputs of a LiDAR depend on which inputs."""

from dataclasses import dataclass

from helpers.lidar_stage import Stage
import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem
import pytest

from cns_drake.sensors import MeasurementModel
from worlds.shapes import StructureEntry, StructureTable

POSE = {"geometry_query", "sweep", "frame_poses"}
ALL = POSE | {"geometry", "moving_instances"}
NOISE = {"noise_draw"}
SCANS = ("scan", "point_cloud_S", "point_cloud_W", "positions_W")


@dataclass(frozen=True)
class CountedMeasurement(MeasurementModel):
    """Counts the revolutions that are measured."""

    calls = 0

    def measure(self, *args, **kwargs):
        type(self).calls += 1
        return super().measure(*args, **kwargs)


class MovesWhenFar(LeafSystem):
    """Says from X_WS which structures move."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractInputPort("X_WS", Value(RigidTransform()))
        self.DeclareAbstractOutputPort(
            "moving", lambda: Value(np.zeros(0, np.uint16)), self._calc
        )

    def _calc(self, context, output):
        x = self.get_input_port().Eval(context).translation()[0]
        output.set_value(np.array([1] if x > 1.0 else [], np.uint16))


def stage(**kwargs):
    made = Stage()
    made.frame = made.add_frame("car", 1, RigidTransform())
    made.add("wall", Box(1, 9, 9), RigidTransform([9.0, 0, 0]))
    table = StructureTable([StructureEntry(1, "wall", "building")])
    return made, {"parent": made.frame, "structures": table, **kwargs}


@pytest.mark.parametrize("rate", [None, 20])
@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_outputs_depend_on_what_they_read(moves, noise, rate):
    made, arguments = stage(rate=rate)
    arguments["measurement"] = MeasurementModel(range_noise=noise)
    if moves:
        arguments["moving_bodies"] = {made.frame: 0}
    lidar = made.finish(**arguments).lidar
    velocities = {"body_spatial_velocities"} if moves else set()
    scans = ALL | velocities | (NOISE if noise else set())
    expected = {"X_WS": POSE, "scan_time": set()} | dict.fromkeys(SCANS, scans)
    if rate is not None:
        expected = {name: set() for name in expected}  # They show the state.
    found = {
        name: {
            lidar.get_input_port(i).get_name()
            for i in range(lidar.num_input_ports())
            if lidar.HasDirectFeedthrough(
                i, lidar.GetOutputPort(name).get_index()
            )
        }
        for name in expected
    }
    assert found == expected


def test_a_system_says_from_the_pose_what_moves():
    made, arguments = stage()
    near = made.builder.AddSystem(MovesWhenFar())
    build = made.builder.Build

    def connect_and_build():
        lidar = made.lidar
        made.builder.Connect(lidar.X_WS_output_port(), near.get_input_port())
        made.builder.Connect(
            near.get_output_port(), lidar.GetInputPort("moving_instances")
        )
        return build()

    made.builder = _Builder(made.builder, connect_and_build)
    made.finish(**arguments, X_PS=RigidTransform())
    still = set(made.eval()["label"].tolist())
    made.poses[made.frame] = RigidTransform([2.0, 0, 0])
    made.set_poses()
    moving = set(made.eval()["label"].tolist())
    assert len(still) == len(moving) == 1
    assert still != moving


class _Builder:
    """A builder with a `Build` of its own."""

    def __init__(self, builder, build):
        self._builder, self.Build = builder, build

    def __getattr__(self, name):
        return getattr(self._builder, name)


def test_labels_change_without_another_measurement():
    made, arguments = stage()
    model = CountedMeasurement(range_noise=0.1)
    made.finish(**arguments, measurement=model, X_PS=RigidTransform())
    CountedMeasurement.calls = 0
    context = made.lidar.GetMyMutableContextFromRoot(made.context)
    port = made.lidar.GetInputPort("moving_instances")
    scans = []
    for moving in ([], [1], []):
        port.FixValue(context, Value(np.array(moving, np.uint16)))
        scans.append(made.eval().copy())
    assert CountedMeasurement.calls == 1
    np.testing.assert_array_equal(scans[0], scans[2])
    np.testing.assert_array_equal(scans[0]["x"], scans[1]["x"])
    assert (scans[0]["label"] != scans[1]["label"]).all()
    # Noise differs from revolution to revolution.
    made.context.SetTime(1.0)
    assert (made.eval()["x"] != scans[0]["x"]).any()
    assert CountedMeasurement.calls == 2


@pytest.mark.parametrize("moving", [[-1], [65_536], [1.0]])
def test_only_instance_ids_can_move(moving):
    made, arguments = stage()
    made.finish(**arguments, X_PS=RigidTransform())
    port = made.lidar.GetInputPort("moving_instances")
    context = made.lidar.GetMyMutableContextFromRoot(made.context)
    for valid in ([0], [65_535], []):
        port.FixValue(context, Value(np.array(valid, int)))
        made.eval()
    port.FixValue(context, Value(np.array(moving)))
    with pytest.raises(ValueError, match=r"moving_instances: \[.*no instance"):
        made.eval()
