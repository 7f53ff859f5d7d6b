"""A crossing of two roads with joined ends."""

import yaml

from worlds.roads import load_road_network

# A crossing of a four-lane road (west-east) and a two-lane road, joined in
# a loop so that no road ends in the open.
CROSS = {
    "defaults": {"lanes": [1, 1], "lane_width": 3.0, "sidewalk": 2.0},
    "junctions": {
        "centre": {"position": [0, 0], "kerb_radius": 6.0},
        "east": {"position": [80, 0], "kerb_radius": 6.0},
        "north": {"position": [0, 80], "kerb_radius": 6.0},
        "west": {"position": [-80, 0], "kerb_radius": 6.0},
        "south": {"position": [0, -80], "kerb_radius": 6.0},
    },
    "roads": {
        "e": {"start": "centre", "end": "east", "lanes": [2, 2]},
        "n": {"start": "centre", "end": "north"},
        "w": {"start": "west", "end": "centre", "lanes": [2, 2]},
        "s": {"start": "south", "end": "centre"},
        "ne": {"start": "north", "end": "east", "via": [[80, 80, 40]]},
        "nw": {"start": "west", "end": "north", "via": [[-80, 80, 40]]},
        "sw": {"start": "south", "end": "west", "via": [[-80, -80, 40]]},
        "se": {"start": "east", "end": "south", "via": [[80, -80, 40]]},
    },
}


def load_network(content, folder):
    """Writes `roads.yaml` into a folder and loads it."""
    path = folder / "roads.yaml"
    path.write_text(yaml.safe_dump(content))
    return load_road_network(path)
