"""Two drives past walls, as sessions with labels by rays."""

from cns_drake.simulation.simulated_drive import SimulatedDrive
from cns_drake.studies.ground_truth.labelled_drive import LabelledDrive
from helpers.small_map import box_visual, world_text
from helpers.tiny_drive import tiny_scenario

GROUND = box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (200, 200, 1))
# Its front is 10 m to the left of the drive.
WALL = box_visual("wall/body", (0, 15.5, 3, 0, 0, 0), (30, 1, 6))


def wall_at(offset):
    """The wall, farther from the drive by an offset [m]."""
    return box_visual("wall/body", (0, 15.5 + offset, 3, 0, 0, 0), (30, 1, 6))


def labelled_drive(folder, visuals, frames=40, **lidar):
    """The drive of `tiny_scenario` in a world of these visuals, simulated."""
    folder.mkdir(parents=True)
    world = folder / "world.sdf"
    world.write_text(world_text(visuals))
    config = {"preset": "vlp-16", "columns": 720} | lidar
    scenario = tiny_scenario(
        folder,
        world=str(world),
        name=folder.name,
        lidars={"lidar": config},
        frames=frames,
    )
    simulated = SimulatedDrive(scenario)
    return LabelledDrive(simulated, simulated, scenario)
