"""Tables of poses (`--poses`) in the forms of other programs."""

from helpers.dataset_folders import make_points, write_bytes, xyzi
import pytest

from cns_drake.base import InputError
from evaluation.drives import open_drive

NAMES = "x,y,z,qx,qy,qz,qw"


def open_posed(root, lines, times=("0", "0.1", "0.2")):
    """Opens a drive of scans at `times` [s] at the poses in a table."""
    folder = root / "sequences" / "11"
    for k in range(len(times)):
        points = xyzi(make_points(5, seed=k))
        write_bytes(folder / "velodyne" / f"{k:06d}.bin", points)
    (folder / "times.txt").write_text("\n".join(times))
    table = root / "poses.csv"
    table.write_text("\n".join(lines))
    return open_drive(folder, poses=table)


@pytest.mark.parametrize("names", ["time,x,y,z,roll,pitch,yaw", "time,x,y,z"])
def test_a_table_without_rotations_is_refused(tmp_path, names):
    row = ",".join("0" * len(names.split(",")))
    fault = r"^\S*poses\.csv: header: no qx qy qz qw$"
    with pytest.raises(InputError, match=fault):
        open_posed(tmp_path, [names, row])
