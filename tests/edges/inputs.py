"""What the programs read: small files, the same each time.

Nothing here imports the project, so that a change of its insides changes none
of these files.
"""

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.layered_scans import seen_from, town
from helpers.small_city import write_small_city
from helpers.small_cityjson import write_blocks
from helpers.small_opendrive import (
    TWO_LANES,
    geometry,
    road,
    section,
    straight,
    write_roads,
)
from helpers.small_osm import write_corner
import numpy as np
import yaml

_NORTH = {"road": "north", "direction": "forward", "lane": 1}
# A drive along the north of the small city, 110 m.
_DRIVE = {
    "map": ".",
    "stage": "02",
    "title": "Around the north",
    "route": [_NORTH | {"start": 10.0, "end": 120.0}],
    "speeds": {"cruise": 8.0},
}
_LIDAR = {"preset": "vlp-16", "columns": 360}
_RECORDINGS = {
    "plain": {},
    "rain_and_traffic": {
        "lidars": {"lidar": _LIDAR | {"returns": "calibrated"}},
        "weather": {"rain": 20.0},
        "traffic": {"vehicles": 3, "walkers": 3},
    },
    "ride_and_camera": {
        "lidars": {"lidar": _LIDAR},
        "ride": {"roughness": "D"},
        "cameras": {"front": {"width": 64, "height": 48, "rate": 10.0}},
    },
}
_EXPERIMENT = {
    "about": "What do missing houses cost?",
    "maps": ["town"],
    "database": {"stage": ["last", "first"]},
    "tasks": ["place", "pose", "change"],
    "methods": ["scan-context++", "solid", "layered-overlap", "ring++", "btc"],
    "protocol": {"base": "random-yaw", "query_spacing": 8.0},
}


def write_city(folder):
    """Writes the small city with a drive, as `town`."""
    world = write_small_city(folder / "town")
    (world / "sequence_02.yaml").write_text(yaml.safe_dump(_DRIVE))


def write_scenarios(folder):
    """Writes a file for each recording, of the drive through the city."""
    for name, more in _RECORDINGS.items():
        values = _DRIVE | {"map": "town", "name": name} | more
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(values))
    return tuple(_RECORDINGS)


def write_experiment(folder):
    text = yaml.safe_dump(_EXPERIMENT)
    (folder / "houses.yaml").write_text(text)


def write_drives(folder):
    """Writes recordings `before` and `after`, 23 scans along 110 m each.

    Of four towns along the way, the second is another one afterwards.
    """
    for name, side, seeds in (
        ("before", 0.0, (1, 2, 3, 4)),
        ("after", 1.0, (1, 5, 3, 4)),
    ):
        parts = [
            town(seed, number=25) + np.array([45.0 * k - 10.0, 0.0, 0.0])
            for k, seed in enumerate(seeds)
        ]
        points = np.concatenate(parts)
        scans, X_WBs = [], []
        for i in range(23):
            x, yaw = 5.0 * i, 0.02 * i
            rng = np.random.default_rng([i, len(name)])
            near = points[np.hypot(points[:, 0] - x, points[:, 1]) < 50.0]
            chosen = rng.permutation(len(near))[:6000]
            scan = seen_from(near[chosen], yaw, x, side)
            scan += rng.normal(scale=0.01, size=scan.shape)
            scans.append(make_scan(scan))
            X_WBs.append(yaw_pose(x, side, 0.0, yaw))
        write_recording(folder / name, scans, X_WBs)


def write_revisits(folder):
    """Writes four scans as KITTI 00's revisits: two places, seen twice."""
    frames = {
        "000026": (1, 0.1, 0.0, 0.0),
        "000560": (2, 1.0, 400.0, 0.0),
        "003528": (1, 2.5, 2.0, 1.0),
        "004481": (2, 1.2, 401.0, 2.0),
    }
    scans = folder / "scans" / "kitti_00_revisits"
    scans.mkdir(parents=True)
    rows = ["# frame x y z qx qy qz qw"]
    for name, (seed, yaw, x, y) in frames.items():
        scan = seen_from(town(seed), yaw, x - 400.0 * (seed - 1), y)
        np.save(scans / f"{name}.npy", np.c_[scan, scan[:, 0] * 0 + 0.5])
        cells = x, y, 1.6, 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
        rows.append(" ".join(map(str, (int(name), *cells))))
    (scans / "poses.txt").write_text("\n".join(rows) + "\n")


def write_maps(folder):
    """Writes two maps with labels at random, some of which are true."""
    rng = np.random.default_rng(3)
    kept = rng.uniform(0.0, 9.0, (300, 3))
    for side, change in (("A", 2), ("B", 3)):
        own = rng.uniform(0.0, 9.0, (100, 3))
        points = np.concatenate([kept, own]).round(4)
        labels = np.repeat([1, change], [300, 100]).astype(np.uint8)
        (folder / "maps" / side).mkdir(parents=True)
        rows = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
        (folder / "maps" / side / "map.ply").write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
            "property double x\nproperty double y\nproperty double z\n"
            f"end_header\n{rows}\n"
        )
        np.save(folder / "maps" / side / "truth.npy", labels)


def write_corner_osm(folder):
    write_corner(folder / "corner.osm")


def write_blocks_cityjson(folder):
    write_blocks(folder / "blocks.json")


def write_roads_opendrive(folder):
    """Writes two streets and the bend between them."""
    bend = geometry(
        0.0, 150.0, 0.0, 0.0, 40.0 * np.pi / 2, '<arc curvature="0.025"/>'
    )
    lanes = (section(0.0, *TWO_LANES),)
    write_roads(
        folder / "bend.xodr",
        straight("1", 0, 0, 150, 0),
        road("2", 40.0 * np.pi / 2, [bend], lanes),
        straight("3", 190, 40, 190, 160),
    )
