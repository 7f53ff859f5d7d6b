"""Three roads that a car turns round on, and the curve that it drives."""

import numpy as np
import yaml

from cns_drake.motion import Speeds, Trajectory
from worlds.roads import load_road_network, make_lane_path
from worlds.shapes import POINT_SPACING, Route


def network_of(folder, *, kerb_radius=8.0, **style):
    """Roads "in", from the west, and "up" and "down" at its eastern end."""
    end = {"dead_end": True, "kerb_radius": kerb_radius}
    junctions = {
        "west": {"position": [0, 0], **end},
        "middle": {"position": [100, 0]},
        "north": {"position": [100, 80], **end},
        "south": {"position": [100, -80], **end},
    }
    roads = {
        "in": {"start": "west", "end": "middle"},
        "up": {"start": "middle", "end": "north", "via": [[105, 40, 60]]},
        "down": {"start": "middle", "end": "south"},
    }
    file = folder / "roads.yaml"
    content = {"defaults": style, "junctions": junctions, "roads": roads}
    file.write_text(yaml.safe_dump(content))
    return load_road_network(file)


def leg(road, direction="forward", lane=1, **ends):
    return {"road": road, "direction": direction, "lane": lane, **ends}


def drive(network, *legs, aside=0.0):
    route = Route.model_validate(list(legs))
    path = make_lane_path(network, route, POINT_SPACING, "d.yaml", aside=aside)
    return Trajectory(path, Speeds())


def driven(trajectory):
    """Returns (N, 2) places and (N,) curvatures of the driven curve."""
    t = np.linspace(0, trajectory.duration, 6000)
    moments = trajectory.at(t)
    return moments.jet.p[:, :2], moments.jet.turn / moments.jet.speed
