"""What a member of the family of data sets says of itself."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evaluation.base import InputError, value_errors
from evaluation.drives.drive import Drive

# Greatest error of a rotation by rounding.
_ROUNDED = 1e-3


@dataclass(frozen=True)
class DataSet:
    """A layout in which drives are stored.

    A module of this package has a data set as its constant `DATA_SET`. Register
    one of your own with `register_data_set`.

    Attributes:
        title: name of the layout in messages.
        holds: function that returns whether a file or folder is a drive in this
            layout.
        open: function that opens a drive. Its arguments are the path and the
            name of a LiDAR (None for the usual one), if the layout
            `has_lidars`; otherwise the path and the number of values of a
            point in `.bin` files (None to guess it).
        files: the path that the user gives, and what must be there.
        has_lidars: whether a drive can have several LiDARs.
        is_nested: whether the drives lie some folders below the folder of the
            data set.
        needs_scenario: whether only the file `scenario.yaml` in a drive's
            folder says in which city the drive is.

    Example:
        from evaluation import DataSet

        def is_mine(path):
            return (path / "mine.txt").is_file()

        DataSet("Mine", is_mine, open_mine, "the folder with `mine.txt`")
    """

    title: str
    holds: Callable[[Path], bool]
    open: (
        Callable[[Path, str | None], Drive]
        | Callable[[Path, int | None], Drive]
    )
    files: str
    has_lidars: bool = False
    is_nested: bool = False
    needs_scenario: bool = False

    @property
    def is_own(self) -> bool:
        """Whether it is a module of this package."""
        home = getattr(self.open, "__module__", "")
        return home.startswith(f"{__package__}.")


def check_interface(drive: Drive) -> None:
    """Checks that a drive has values of the types and shapes of `Drive`.

    Raises:
        InputError: a value is missing, or is of another type or shape; or a
            pose is not rigid.
    """
    if not isinstance(drive, Drive):
        raise InputError(f"{drive!r} is no Drive")
    for name in ("name", "world_frame"):
        if not isinstance(getattr(drive, name, None), str):
            raise InputError(f"{name}: no text")
    with value_errors("len"):
        number = len(drive)
    for name, shape, kinds in (
        ("stamps_ns", (number,), "iu"),
        ("X_WS", (number, 4, 4), "f"),
    ):
        value = getattr(drive, name)
        if not (
            isinstance(value, np.ndarray)
            and value.shape == shape
            and value.dtype.kind in kinds
        ):
            kind = "integers" if kinds == "iu" else "floating-point numbers"
            raise InputError(f"{name}: no array of {kind} of shape {shape}")
    if bad := _pose_fault(drive.X_WS):
        raise InputError(f"{drive.name}: X_WS: {bad}")
    if number:
        scan = drive.scan(0)
        names = getattr(getattr(scan, "dtype", None), "names", None) or ()
        if np.ndim(scan) != 1 or not {"x", "y", "z"} <= set(names):
            raise InputError("scan 0: no array of points with x, y and z")


def _pose_fault(X_WS: np.ndarray) -> str:
    """Returns the first pose (4, 4) of many that is not rigid; "" if all are.

    Rotations may differ from orthogonal ones as much as in files of poses.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        R = X_WS[:, :3, :3]
        lengths = np.linalg.norm(R, axis=1)
        is_scaled = np.abs(lengths - 1.0).max(axis=1) > _ROUNDED
        error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
        faults = {
            "not finite": ~np.isfinite(X_WS).all(axis=(1, 2)),
            "the last row is not 0, 0, 0, 1": np.any(
                np.abs(X_WS[:, 3] - [0.0, 0.0, 0.0, 1.0]) > _ROUNDED, axis=1
            ),
            "the axes have other lengths than 1": is_scaled,
            "the axes are not orthogonal": error > _ROUNDED,
            "a mirror, not a rotation": np.linalg.det(R) < 0.0,
        }
    bad = np.any(list(faults.values()), axis=0)
    if not bad.any():
        return ""
    index = int(bad.argmax())
    fault = next(text for text, some in faults.items() if some[index])
    return f"pose {index}: {fault}"
