"""Which share of the returns lies on which class, beside SemanticKITTI.

    python tests/benchmarks/class_shares.py [--drive NAME ...] [--roadsides]

Simulates scans of an `hdl-64e` with calibrated returns at 1.73 m, evenly over
each drive, without traffic, and prints the share of the returns on each class.
The last row has the shares in SemanticKITTI's training sequences, from the
field `content` of its file semantic-kitti.yaml.
"""

from __future__ import annotations

import argparse
from collections import Counter
import csv
import sys

from cns_drake.scenarios import Scenario, load_scenario, make_scenario
from cns_drake.simulation import SimulatedDrive

DRIVES = ("metropolis_04", "downtown_04", "riverside_02", "suburbia_02")
_SCANS = 12
# Class -> labels of SemanticKITTI, and their share in its training sequences.
_CLASSES = {
    "road": ((40, 60), 0.1987),
    "sidewalk": ((48,), 0.1439),
    "parking and other ground": ((44, 49), 0.0186),
    "terrain": ((72,), 0.0781),
    "building": ((50,), 0.1327),
    "fence": ((51,), 0.0724),
    "vegetation and trunk": ((70, 71), 0.2729),
    "pole": ((80,), 0.0029),
    "traffic sign": ((81,), 0.0006),
    "vehicle": ((10, 11, 13, 15, 16, 18, 20, 252, 256, 257, 258, 259), 0.0474),
    "person and rider": ((30, 31, 32, 253, 254, 255), 0.0005),
}


def judged(name: str, *, roadsides: bool) -> Scenario:
    """Returns the scenario of a drive."""
    own = load_scenario(name).model_dump(mode="json", exclude_none=True)
    key, lidar = next(iter(own["lidars"].items()))
    lidar |= {
        "preset": "hdl-64e",
        "rate": 1,
        "returns": "calibrated",
        "columns": 1078,
        "xyz": [0.0, 0.0, 1.73],
    }
    for field in ("min_range", "max_range"):
        lidar.pop(field, None)
    own["lidars"] = {key: lidar}
    if roadsides:
        own["transient"] = {"roadsides": 1.0}
    return make_scenario(own, name)


def shares(drive: SimulatedDrive) -> dict[str, float]:
    """Returns the share of the returns on each class."""
    found: Counter[int] = Counter()
    for k in range(_SCANS):
        scan = drive.scan(round((k + 0.5) * len(drive) / _SCANS))
        found.update(scan["label"].tolist())
    total = sum(found.values())
    return {
        name: sum(found[label] for label in labels) / total
        for name, (labels, _) in _CLASSES.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drive", nargs="*", default=DRIVES)
    parser.add_argument("--roadsides", action="store_true")
    given = parser.parse_args()
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["drive", *_CLASSES])
    for name in given.drive:
        scenario = judged(name, roadsides=given.roadsides)
        found = shares(SimulatedDrive(scenario))
        writer.writerow([name, *(f"{one:.4f}" for one in found.values())])
        sys.stdout.flush()
    real = [share for _, share in _CLASSES.values()]
    writer.writerow(["semantic-kitti", *real])


if __name__ == "__main__":
    main()
