"""A drive that costs little: one hall, few beams, three seconds."""

import yaml

from cns_drake.scenarios import make_scenario
from helpers.small_map import box_visual, world_text

FRAMES = 60
LONG = 1200


def tiny_scenario(folder, **changes):
    """Writes world and waypoints; returns their scenario, `tiny_01`."""
    visuals = [
        box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (200, 200, 1)),
        box_visual("hall/body", (30, 25, 5, 0, 0, 0.3), (20, 12, 10)),
    ]
    (folder / "tiny.sdf").write_text(world_text(visuals))
    (folder / "tiny.csv").write_text("x,y\n-10,5\n40,5\n40,60\n")
    values = {
        "name": "tiny_01",
        "world": str(folder / "tiny.sdf"),
        "waypoints": str(folder / "tiny.csv"),
        "speeds": {
            "cruise": 6.0,
            "longitudinal_acceleration": 1.5,
            "lateral_acceleration": 2.0,
        },
        # Noise and motion must not depend on the first frame of a run.
        "lidars": {
            "lidar": {
                "preset": "vlp-16",
                "columns": 8,
                "range_noise": 0.02,
                "dropout": 0.1,
                "motion_distortion": True,
            }
        },
        "frames": FRAMES,
    }
    return make_scenario(values | changes, "test")


def long_scenario(folder, name):
    """The same drive at a low speed: seconds of work, in which it is killed."""
    crawl = {
        "cruise": 0.6,
        "longitudinal_acceleration": 1.5,
        "lateral_acceleration": 2.0,
    }
    return tiny_scenario(folder, name=name, frames=LONG, speeds=crawl)


def write_scenario(scenario, folder):
    """Writes a scenario as a file for the command line; returns its path."""
    file = folder / f"{scenario.name}.yaml"
    file.write_text(yaml.safe_dump(scenario.model_dump(exclude_none=True)))
    return file
