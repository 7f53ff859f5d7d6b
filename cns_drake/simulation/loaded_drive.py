"""A scenario with all that its simulation needs: path, stage, traffic."""

from dataclasses import dataclass
import functools

from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody

from cns_drake.base import doing
from cns_drake.drives import BASE_FRAME
from cns_drake.motion import Trajectory
from cns_drake.scenarios import DrivePlan, Scenario, count_frames
from cns_drake.scene import World
from cns_drake.sensors import sensor_pose
from cns_drake.simulation.recording_schedule import (
    RecordingPlan,
    plan_recording,
)
from cns_drake.simulation.scenario_traffic import (
    plan_traffic_of_drive,
    with_traffic,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.traffic import TrafficPlan


@dataclass(frozen=True)
class LoadedDrive:
    """A scenario with all that its simulation needs, loaded.

    Attributes:
        scenario: the scenario; its field `frames` is never None.
        trajectory: motion of the vehicle.
        world: world of the stage, with the vehicle and the objects of the
            traffic. The first Diagram that is built takes over the world's
            SceneGraph.
        traffic: motion of all other vehicles and of pedestrians; None without
            traffic.
    """

    scenario: Scenario
    trajectory: Trajectory
    world: World
    traffic: TrafficPlan | None = None

    @functools.cached_property
    def recording(self) -> RecordingPlan:
        """The topics of the recording, and the times of their messages."""
        return plan_recording(self.scenario)

    @property
    def num_frames(self) -> int:
        """Number of frames to record."""
        assert self.scenario.frames is not None
        return self.scenario.frames

    @property
    def structures(self) -> list[dict]:
        """A description of each structure of the world, ready for JSON."""
        return [
            {
                "instance": entry.instance,
                "name": entry.name,
                "class": entry.semantic_class,
                "label": entry.label,
                **({"causes": list(entry.causes)} if entry.causes else {}),
            }
            for entry in self.world.structures
        ]

    @property
    def base_link(self) -> RigidBody:
        """The vehicle's body B."""
        return self.world.plant.GetBodyByName(BASE_FRAME, self.world.vehicle)

    @property
    def X_BSs(self) -> dict[str, RigidTransform]:
        """LiDAR name -> pose of the LiDAR in base_link."""
        lidars = self.scenario.lidars
        return {name: sensor_pose(lidar) for name, lidar in lidars.items()}


def load_drive(plan: DrivePlan) -> LoadedDrive:
    """Plans the traffic of a drive, and loads its stage.

    If the vehicle keeps its distance to the vehicle ahead (field
    `driver.follows`), the drive is slower than planned without traffic.

    Raises:
        InputError: the scenario cannot be run.
    """
    scenario = plan.scenario
    doing("planning the drive")
    trajectory = plan.trajectory
    if not scenario.driver.follows:
        count_frames(scenario, trajectory)  # An error comes at once.
    world = load_stage(plan)
    traffic = None
    if not scenario.traffic.is_off:
        doing("planning the traffic")
        traffic = plan_traffic_of_drive(plan, trajectory, world)
        world = with_traffic(world, traffic)
        if traffic.positions is not None:
            trajectory = plan.trajectory_at(traffic.positions)
    return LoadedDrive(
        scenario.replaced(frames=count_frames(scenario, trajectory)),
        trajectory,
        world,
        traffic,
    )
