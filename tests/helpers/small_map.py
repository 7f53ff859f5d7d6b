"""A map that takes no time to load: boxes beside the roads of Metropolis."""

import shutil

import numpy as np
import yaml

from worlds.maps import recordable_drives, shipped_maps

_WORLD = """<?xml version="1.0"?>
<sdf version="1.9">
  <world name="stage">
    <model name="city">
      <static>true</static>
      <link name="city">{visuals}</link>
    </model>
  </world>
</sdf>
"""
_VISUAL = """
        <visual name="{name}">
          <pose>{pose}</pose>
          <geometry><box><size>{size}</size></box></geometry>
        </visual>"""


def box_visual(name, pose, size):
    """One visual of an SDF link; pose and size as sequences of numbers."""
    return _VISUAL.format(
        name=name,
        pose=" ".join(f"{value:g}" for value in pose),
        size=" ".join(f"{value:g}" for value in size),
    )


def world_text(visuals):
    """An SDF world with one static model of these visuals."""
    return _WORLD.format(visuals="".join(visuals))


def write_small_map(folder):
    """Writes a map with stages 01 and 04 and returns its folder."""
    folder.mkdir()
    source = shipped_maps()["metropolis"]
    for name in ("roads.yaml", "traffic.npz"):
        shutil.copy(source / name, folder)
    rng = np.random.default_rng(0)
    visuals = [
        box_visual("ground/plate", (0, -36, -0.5, 0, 0, 0), (500, 500, 1))
    ]
    for k in range(40):
        x, y, yaw = rng.uniform((-200, -230, 0), (200, 160, 3))
        visuals.append(
            box_visual(f"tower_{k:03d}/body", (x, y, 9, 0, 0, yaw), (9, 7, 20))
        )
    (folder / "stage_04.sdf").write_text(world_text(visuals))
    (folder / "stage_01.sdf").write_text(world_text(visuals[:20]))
    rows = ["instance,name,class", "1,ground,terrain"]
    rows += [f"{k + 2},tower_{k:03d},building" for k in range(40)]
    (folder / "structures.csv").write_text("\n".join(rows) + "\n")
    return folder


def scenario_values(map_folder, drive="metropolis_04"):
    """The fields of a shipped drive, moved to another map."""
    path = recordable_drives()[drive]
    values = yaml.safe_load(path.read_text())
    return values | {"map": str(map_folder), "name": drive}


def write_town(folder, routes, frames):
    """Writes a map with a drive for each stage, on the start of a route.

    The car never comes to the end of the second road; to plan the rest would
    take longer than to simulate some frames.
    """
    write_small_map(folder)
    for stage, route in routes.items():
        values = scenario_values(folder, route)
        values |= {
            "map": ".",
            "stage": stage,
            "route": values["route"][:2],
            "frames": frames,
            "lidars": {"lidar": {"columns": 16}},
        }
        del values["name"]
        file = folder / f"sequence_{stage}.yaml"
        file.write_text(yaml.safe_dump(values))
    return folder
