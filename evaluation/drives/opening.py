"""Opening a recorded drive with the reader for its format."""

from pathlib import Path
from typing import Any

from cns_drake.base import InputError, doing, listed
from cns_drake.drives import Drive


def open_drive(
    path: Path, lidar: str | None = None, columns: int | None = None
) -> Drive:
    """Opens a recorded drive with the reader for its format.

    Args:
        path: an .mcap file; a folder with such a file, as cns-drake and rosbag2
            write it; or a drive's folder, as MulRan, HeLiPR, NCLT, Boreas,
            KITTI odometry or CNS publish it. `LiDAR/<name>` in a folder of
            HeLiPR chooses the LiDAR.
        lidar: name of the LiDAR to read, if the recording has several LiDARs.
        columns: number of float32 values per point in `.bin` files of KITTI and
            MulRan; by default the number is guessed from the values.

    Raises:
        InputError: if nothing at `path` can be read as a drive, or the drive
            has no such LiDAR.

    Example:
        from evaluation import open_drive

        for scan in open_drive("recordings/downtown_01"):
            print(len(scan))
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    doing(f"opening {path.name}")
    fitting = find_readers(path)
    from cns_drake.drives import McapDrive
    from evaluation.drives.helipr import HeliprDrive

    if len(fitting) > 1:
        names = ", ".join(reader.__name__ for reader in fitting)
        raise InputError(f"{path}: files of several formats ({names})")
    if fitting and fitting[0] in (McapDrive, HeliprDrive):
        return fitting[0](path, lidar)
    if fitting and lidar is not None:
        raise InputError(f"{path}: has one LiDAR, not a '{lidar}'")
    if fitting:
        return fitting[0](path, columns)
    if path.is_dir() and any(path.glob("*.mcap.part")):
        raise InputError(
            f"{path}: the recording was not finished; simulate the drive again"
        )
    one = [path] if ".mcap.zst" in path.name else []
    for file in listed(path, "*.mcap.zst*") if path.is_dir() else one:
        raise InputError(
            f"{file}: the whole recording is compressed (rosbag2's mode"
            " `file`); uncompress it first"
        )
    raise InputError(
        f"{path}: not a recorded drive (a folder with an .mcap file, or"
        " one, or a drive of MulRan, HeLiPR, NCLT, Boreas, KITTI odometry or"
        " CNS)"
    )


def find_readers(path: Path) -> list[Any]:
    """Returns the drive classes whose format a file or folder has."""
    # Imported here: the readers' libraries are slow to load, and a map file
    # needs none of them.
    from cns_drake.drives import McapDrive, holds_mcap
    from evaluation.drives import (
        boreas,
        cns_folder,
        helipr,
        kitti,
        mulran,
        nclt,
    )

    readers = (
        (holds_mcap, McapDrive),
        (mulran.holds_mulran, mulran.MulranDrive),
        (helipr.holds_helipr, helipr.HeliprDrive),
        (nclt.holds_nclt, nclt.NcltDrive),
        (boreas.holds_boreas, boreas.BoreasDrive),
        (kitti.holds_kitti, kitti.KittiDrive),
        (cns_folder.holds_cns, cns_folder.CnsFolderDrive),
    )
    return [reader for holds, reader in readers if holds(path)]
