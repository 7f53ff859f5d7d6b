"""Simulators that stop early, begin again or jump, and Contexts put back."""

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus
import pytest

from cns_drake.sensors import add_lidar, add_odometry
from cns_drake.simulation import add_mcap_recorder
from evaluation.base import InputError
from evaluation.drives import open_drive

PERIOD = 0.125  # Exact, so that every frame falls where it is said.


class Drive:
    """A robot that drifts at 1 m/s towards a wall, and its recording."""

    def __init__(self, folder):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        plant.RegisterVisualGeometry(
            plant.world_body(),
            RigidTransform([8.0, 0.0, 0.0]),
            Box(0.2, 40.0, 10.0),
            "wall",
            np.full(4, 0.5),
        )
        inertia = SpatialInertia.SolidBoxWithMass(1.0, 0.5, 0.3, 0.2)
        robot = plant.AddRigidBody("robot", inertia)
        plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        plant.Finalize()
        self.folder = folder
        self.lidar = add_lidar(
            builder,
            scene_graph,
            robot,
            RigidTransform(),
            "vlp-16",
            range_noise=0.01,
        )
        self.bag = add_mcap_recorder(
            builder,
            folder,
            lidars=[self.lidar],
            odometry=add_odometry(builder, robot),
            period=PERIOD,
        )
        self.plant = plant
        self.robot = robot
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram, self.fresh_context())

    def fresh_context(self):
        root = self.diagram.CreateDefaultContext()
        velocity = np.r_[np.zeros(3), 1.0, 0.0, 0.0]
        context = self.plant.GetMyMutableContextFromRoot(root)
        self.plant.SetVelocities(context, velocity)
        return root

    def scan(self, root):
        context = self.lidar.GetMyContextFromRoot(root)
        return self.lidar.GetOutputPort("scan").Eval(context).copy()

    def recorded_frames(self):
        stamps = open_drive(self.folder).stamps_ns * 1e-9
        return (stamps / PERIOD).tolist()


@pytest.fixture
def drive(tmp_path):
    return Drive(tmp_path / "drive")


def test_a_monitor_may_stop_it(drive):
    def stop(context):
        if context.get_time() >= 3.5 * PERIOD:
            return EventStatus.ReachedTermination(drive.diagram, "enough")
        return EventStatus.DidNothing()

    drive.simulator.set_monitor(stop)
    with drive.bag:
        drive.simulator.AdvanceTo(10 * PERIOD)
    assert drive.simulator.get_context().get_time() < 5 * PERIOD
    assert drive.recorded_frames()[:4] == [0, 1, 2, 3]


@pytest.mark.parametrize("what", ["reset", "back", "same"])
def test_a_recording_only_goes_on(drive, what):
    def run_twice():
        simulator = drive.simulator
        with drive.bag:
            simulator.AdvanceTo(4 * PERIOD)
            if what == "reset":
                simulator.reset_context(drive.fresh_context())
            elif what == "back":
                simulator.get_mutable_context().SetTime(2 * PERIOD)
            simulator.Initialize()
            simulator.AdvanceTo(6 * PERIOD)

    with pytest.raises(InputError, match=r"drive: /tf: a message at .* begin"):
        run_twice()
    assert not (drive.folder / "metadata.yaml").exists()


def test_a_clock_may_jump_ahead(drive):
    simulator = drive.simulator
    with drive.bag:
        simulator.get_mutable_context().SetTime(1.5 * PERIOD)
        simulator.AdvanceTo(3 * PERIOD)
        simulator.get_mutable_context().SetTime(100 * PERIOD)
        simulator.Initialize()
        simulator.AdvanceTo(101 * PERIOD)
    assert drive.recorded_frames() == [2, 3, 100, 101]
    # The fixed frames are there, though frame 0 is not.
    assert open_drive(drive.folder).X_WS.shape == (4, 4, 4)


def test_nothing_is_recorded_in_silence_to_nowhere(drive):
    with pytest.raises(RuntimeError, match="the recording is not open"):
        drive.simulator.AdvanceTo(PERIOD)
    with drive.bag:
        drive.simulator.AdvanceTo(2 * PERIOD)
    with pytest.raises(RuntimeError, match="the recording is not open"):
        drive.simulator.AdvanceTo(3 * PERIOD)


def test_a_saved_context_gives_the_same_scan_again(drive):
    simulator = drive.simulator
    with drive.bag:
        simulator.AdvanceTo(2 * PERIOD)
        saved = simulator.get_context().Clone()
        seen = drive.scan(simulator.get_context())
        simulator.AdvanceTo(8 * PERIOD)
    later = drive.scan(simulator.get_context())
    # Six periods nearer to the wall, but for the noise.
    nearest = [scan["x"].min() for scan in (seen, later)]
    assert nearest[0] - nearest[1] == pytest.approx(6 * PERIOD, abs=0.1)
    np.testing.assert_array_equal(drive.scan(saved), seen)
    other = drive.diagram.CreateDefaultContext()
    other.SetTimeStateAndParametersFrom(saved)
    np.testing.assert_array_equal(drive.scan(other), seen)
    np.testing.assert_array_equal(drive.scan(simulator.get_context()), later)
