"""Which share of the returns lies on which class, beside SemanticKITTI.

    python tests/benchmarks/class_shares.py [--drive NAME ...]
        [--roadsides VALUE ...] [--scans N]

Simulates scans of an `hdl-64e` with calibrated returns at 1.73 m, evenly over
each drive, without traffic, and prints the share of the returns on each class,
and the share of plants among the returns above the ground. The last row has the
shares in SemanticKITTI's training sequences, from the field `content` of its
file config/semantic-kitti.yaml.
"""

import argparse
from collections import Counter
import csv
import itertools
import sys

from cns_drake.scenarios import Scenario, load_scenario, make_scenario
from cns_drake.simulation import SimulatedDrive

DRIVES = ("metropolis_04", "downtown_04", "riverside_02", "suburbia_02")
# Class -> labels of SemanticKITTI, and their share in its training sequences.
_PLANTS = "vegetation and trunk"
_CLASSES = {
    "road": ((40, 60), 0.1987),
    "sidewalk": ((48,), 0.1439),
    "parking and other ground": ((44, 49), 0.0186),
    "terrain": ((72,), 0.0781),
    "building": ((50,), 0.1327),
    "fence": ((51,), 0.0724),
    _PLANTS: ((70, 71), 0.2729),
    "pole": ((80,), 0.0029),
    "traffic sign": ((81,), 0.0006),
    "vehicle": ((10, 11, 13, 15, 16, 18, 20, 252, 256, 257, 258, 259), 0.0474),
    "person and rider": ((30, 31, 32, 253, 254, 255), 0.0005),
}
# The first classes are the ground.
_GROUND = 4
# Labels of no class, and their share in SemanticKITTI.
_UNLABELLED = (0, 1)
_SHARE_UNLABELLED = 0.0192


def judged(name: str, roadsides: float, columns: int = 1078) -> Scenario:
    """Returns a drive with an `hdl-64e` of so many columns, as KITTI's."""
    own = load_scenario(name).model_dump(mode="json", exclude_none=True)
    key, lidar = next(iter(own["lidars"].items()))
    lidar |= {
        "preset": "hdl-64e",
        "rate": 1,
        "returns": "calibrated",
        "columns": columns,
        "xyz": [0.0, 0.0, 1.73],
    }
    for field in ("min_range", "max_range"):
        lidar.pop(field, None)
    own["lidars"] = {key: lidar}
    if roadsides > 0.0:
        own["transient"] = {"roadsides": roadsides}
    return make_scenario(own, name)


def shares(drive: SimulatedDrive, number: int) -> list[float]:
    """Returns the share of each class, and last of labels of no class."""
    found: Counter[int] = Counter()
    for k in range(number):
        scan = drive.scan(round((k + 0.5) * len(drive) / number))
        found.update(scan["label"].tolist())
    total = sum(found.values())
    return [
        sum(found[label] for label in labels) / total
        for labels in (*(one for one, _ in _CLASSES.values()), _UNLABELLED)
    ]


def above_ground(found: list[float], unlabelled: float) -> float:
    """Returns the share of plants among the returns above the ground."""
    plants = found[list(_CLASSES).index(_PLANTS)]
    return plants / (1.0 - sum(found[:_GROUND]) - unlabelled)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drive", nargs="*", default=DRIVES)
    parser.add_argument("--roadsides", nargs="*", type=float, default=(0.0,))
    parser.add_argument("--scans", type=int, default=12)
    given = parser.parse_args()
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["drive", "roadsides", *_CLASSES, "plants above ground"])
    for name, roadsides in itertools.product(given.drive, given.roadsides):
        drive = SimulatedDrive(judged(name, roadsides))
        *found, unlabelled = shares(drive, given.scans)
        values = (*found, above_ground(found, unlabelled))
        row = (f"{value:.4f}" for value in values)
        writer.writerow([name, f"{roadsides:g}", *row])
        sys.stdout.flush()
    real = [share for _, share in _CLASSES.values()]
    ratio = above_ground(real, _SHARE_UNLABELLED)
    writer.writerow(["semantic-kitti", "", *real, f"{ratio:.4f}"])


if __name__ == "__main__":
    main()
