"""Reads and writes the maps of two drives, with a label for each point.

A session is a drive with its map. A folder contains two sessions: the older
one in the subfolder `A`, the newer one in `B`. A session consists of

- `map.ply`: the merged map in the world, one point for each cell of 0.1 m, with
  `x`, `y`, `z` [m], and, where known, `label` (class, SemanticKITTI's ids) and
  `instance` (number of a structure),
- `truth.npy`: a label for each point of the map, see `Label`,
- `Scans/000000.pcd` onwards: the scans in the frame of the LiDAR,
- `poses.txt`: a row for each scan, the upper 3 x 4 of the LiDAR's pose in the
  world,
- `singlesession_posegraph.g2o`: the same poses, as a pose graph.

Scans and poses have the layout that ELite and LT-mapper read.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from evaluation.base import (
    InputError,
    completing,
    draft_folder,
    encode_pcd,
    from_xyz,
    is_there,
    listed,
    poses,
    track,
    user_errors,
    xyz,
)
from evaluation.clouds import read_blocks, read_cloud, read_npy
from evaluation.drives import Drive, check_same_world, read_poses, sample_frames
from evaluation.map_update.labels import (
    MOVING_CLASSES,
    SIDES,
    Label,
    PairLabels,
)
from evaluation.map_update.map_builder import MapBuilder

# Distance driven between two scans [m].
SPACING = 1.0
# Names of the files in the folder of a session.
_MAP_FILE = "map.ply"
_SCANS_FOLDER = "Scans"
# Greatest rounding of coordinates in a file of labels that is usual [m].
_ROUNDED = 0.02
# NumPy's name of a type -> PLY's name.
_PLY_TYPES = {"f8": "double", "u2": "ushort"}


@dataclass(frozen=True)
class Session:
    """A session: one of the two drives of a folder, with its map.

    Attributes:
        folder: folder of the session's files.
        points: (N, 3) points of the map in the world [m].
        classes: (N,) uint16, SemanticKITTI's ids; 0 if unknown.
        instances: (N,) uint16, number of a structure; 0 for none.
        X_WS: (K, 4, 4) poses of the scans; (0, 4, 4) if unknown.
    """

    folder: Path
    points: np.ndarray
    classes: np.ndarray
    instances: np.ndarray
    X_WS: np.ndarray

    @property
    def side(self) -> str:
        """`A` for the older drive, `B` for the newer drive."""
        return self.folder.name

    @property
    def moves(self) -> np.ndarray:
        """(N,) bool, points on vehicles (also parked vehicles) and people."""
        return np.isin(self.classes, MOVING_CLASSES)

    def scan(self, index: int) -> np.ndarray:
        """Returns a scan (M, 3) in the frame of the LiDAR [m].

        Raises:
            InputError: the scan cannot be read.
        """
        scan = xyz(read_cloud(scan_path(self.folder, index)))
        return scan[np.isfinite(scan).all(axis=1)]


def write_session(
    drive: Drive,
    folder: Path,
    spacing: float = SPACING,
) -> tuple[Session, np.ndarray]:
    """Writes the map, scans and poses of a drive to a folder.

    Args:
        drive: the drive.
        folder: folder to create for the session.
        spacing: distance driven between two scans [m].

    Returns:
        The session, and the frames (K,) of the drive that are its scans.

    Raises:
        InputError: a scan cannot be read, or a file cannot be written.
    """
    frames = sample_frames(drive.X_WS[:, :3, 3], spacing)
    X_WS = drive.X_WS[frames]
    builder = MapBuilder(X_WS[0, :3, 3])
    with user_errors(folder):
        (folder / _SCANS_FOLDER).mkdir(parents=True)
        for number, frame in enumerate(
            track(
                frames.tolist(), f"mapping {drive.name}", len(frames), "scans"
            )
        ):
            scan = drive.scan(frame)
            builder.add(scan, X_WS[number])
            scan_path(folder, number).write_bytes(encode_pcd(scan))
        rows = X_WS[:, :3].reshape(-1, 12)
        (folder / "poses.txt").write_text(
            "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())
        )
        (folder / "singlesession_posegraph.g2o").write_text(_g2o(X_WS))
        points = builder.points()
        _write_ply(folder / _MAP_FILE, points)
    return _session_of(folder, points, X_WS), frames


def write_sessions(
    older: Drive,
    newer: Drive,
    folder: Path,
    spacing: float = SPACING,
    on_note: Callable[[str], None] = lambda note: None,
) -> None:
    """Writes the maps of two drives, without labels, to a new folder.

    Args:
        older, newer: the drives.
        folder: folder to create; it appears when it is complete.
        spacing: distance driven between two scans [m].
        on_note: called with notes about how the drives were read.

    Raises:
        InputError: the drives are in different worlds, a scan cannot be read,
            or the folder cannot be written or is not empty.
    """
    check_same_world(older, newer)
    with draft_folder(folder) as draft:
        for side, drive in zip(SIDES, (older, newer), strict=True):
            for note in drive.notes:
                on_note(note)
            write_session(drive, draft / side, spacing)


def read_session(folder: Path) -> Session:
    """Reads a session; labels, instances and poses may be missing.

    Raises:
        InputError: there is no map, or a file cannot be read.
    """
    path = folder / _MAP_FILE
    if not path.is_file():
        raise InputError(f"{path}: no such file; a session needs its map")
    points = np.concatenate(list(read_blocks(path)))
    if not np.isfinite(xyz(points)).all():
        raise InputError(f"{path}: a coordinate is not finite")
    file = folder / "poses.txt"
    X_WS = np.zeros((0, 4, 4))
    if is_there(file):
        X_WS = read_poses(file)
        number = len(listed(folder / _SCANS_FOLDER, "*.pcd"))
        if number != len(X_WS):
            raise InputError(f"{file}: {len(X_WS)} poses for {number} scans")
    return _session_of(folder, points, X_WS)


def read_labels(path: Path, session: Session, *, truth: bool) -> np.ndarray:
    """Reads labels of a session's points.

    Args:
        path: an array `.npy` of integers in the order of the map's points, or a
            cloud `.ply` of the same points, in any order, with a property
            `prediction`.
        session: the session to which the labels belong.
        truth: whether the labels are ground truth. Only ground-truth labels may
            have the value `Label.IGNORED`.

    Returns:
        (N,) uint8.

    Raises:
        InputError: the file cannot be read, or has other points, or the wrong
            length or values.
    """
    labels, points = _read_any_labels(path)
    count = len(session.points)
    if labels.ndim != 1 or labels.dtype.kind not in "iu":
        raise InputError(f"{path}: not one whole number for each point")
    if len(labels) != count:
        raise InputError(
            f"{path}: {len(labels)} labels for the {count} points of "
            f"{session.folder / _MAP_FILE}"
        )
    allowed = [*SIDES[session.side], *([Label.IGNORED] if truth else [])]
    wrong = ~np.isin(labels, allowed)
    if wrong.any():
        place = int(wrong.argmax())
        names = ", ".join(
            f"{int(label)} {label.name.lower()}" for label in allowed
        )
        raise InputError(
            f"{path}: point {place} has the label {labels[place]}; those of "
            f"{session.side} are {names}"
        )
    if points is not None:
        try:
            labels = labels[_places(session.points, points)]
        except ValueError as error:
            raise InputError(
                f"{path}: {error} of {session.folder / _MAP_FILE}"
            ) from error
    return labels.astype(np.uint8)


def _places(points: np.ndarray, labelled: np.ndarray) -> np.ndarray:
    """Returns the index (N,) of each point among labelled points.

    Args:
        points: (N, 3) points [m].
        labelled: structured array (N,) of the same points, which may be in
            another order and rounded [m].

    Raises:
        ValueError: they are other points, or cannot be told apart.
    """
    others = xyz(labelled)
    if not np.isfinite(others).all():
        raise ValueError("a coordinate is not finite, so these are no points")
    step = max(np.spacing(np.abs(labelled[i]).max(initial=0)) for i in "xyz")
    near = max(_ROUNDED, float(step))
    if (np.abs(points - others) <= near).all():
        return np.arange(len(points))
    distances, places = KDTree(others).query(points, workers=-1)
    far = int(np.argmax(distances))
    if distances[far] > near:
        raise ValueError(
            f"no point within {near:.2g} m of point {far}: not the points"
        )
    if len(np.unique(places)) < len(places):
        raise ValueError(
            "in another order, and too coarse to tell apart the points"
        )
    return places


def write_labels(path: Path, labels: np.ndarray) -> None:
    """Writes labels (N,) as a NumPy array of uint8."""
    with completing(path) as part, open(part, "wb") as stream:
        np.save(stream, labels.astype(np.uint8))


def _read_any_labels(path: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Returns labels of any shape and type, and their points, if known."""
    if path.suffix == ".ply":
        points = np.concatenate(list(read_blocks(path)))
        if "prediction" not in (points.dtype.names or ()):
            raise InputError(f"{path}: no property `prediction`")
        return points["prediction"], points
    return read_npy(path), None


def _session_of(folder: Path, points: np.ndarray, X_WS: np.ndarray) -> Session:
    """Returns a session, with zeros for a label or instance that is missing.

    Args:
        folder: folder of the session's files.
        points: structured array (N,) of the map's points.
        X_WS: (K, 4, 4) poses of the scans.
    """
    columns = {}
    for name in ("label", "instance"):
        columns[name] = np.zeros(len(points), np.uint16)
        if name in (points.dtype.names or ()):
            columns[name] = _as_uint16(folder / _MAP_FILE, points, name)
    return Session(
        folder, xyz(points), columns["label"], columns["instance"], X_WS
    )


def _as_uint16(path: Path, points: np.ndarray, name: str) -> np.ndarray:
    """Returns a column of a map as (N,) uint16.

    Args:
        path: file of the map, for error messages.
        points: structured array (N,) of the map's points.
    """
    with np.errstate(invalid="ignore"):
        numbers = points[name].astype(np.uint16)
    wrong = numbers != points[name]
    if wrong.any():
        place = int(wrong.argmax())
        raise InputError(
            f"{path}: {name}: {points[name][place]} of point {place} is no"
            " whole number from 0 to 65535"
        )
    return numbers


def scan_path(folder: Path, number: int) -> Path:
    """Returns the path of a scan in the folder of a session."""
    return folder / _SCANS_FOLDER / f"{number:06d}.pcd"


def _write_ply(path: Path, points: np.ndarray) -> None:
    """Writes a structured array (N,) as a binary PLY file."""
    lines = ["ply", "format binary_little_endian 1.0"]
    lines.append(f"element vertex {len(points)}")
    for name in points.dtype.names or ():
        kind = _PLY_TYPES[points.dtype[name].str[1:]]
        lines.append(f"property {kind} {name}")
    header = "\n".join([*lines, "end_header\n"]).encode()
    with completing(path) as part, open(part, "wb") as stream:
        stream.write(header)
        stream.write(points.tobytes())


def _g2o(X_WS: np.ndarray) -> str:
    """Returns poses (K, 4, 4) as the text of a g2o pose graph, for LT-mapper.

    Each edge is the motion from one pose to the next.
    """
    steps = poses.inverse(X_WS[:-1]) @ X_WS[1:]
    # The upper triangle of a unit matrix, 6 x 6.
    information = " ".join(
        "1" if i == j else "0" for i in range(6) for j in range(i, 6)
    )
    vertices = (
        f"VERTEX_SE3:QUAT {k} {row}" for k, row in enumerate(_g2o_poses(X_WS))
    )
    edges = (
        f"EDGE_SE3:QUAT {k} {k + 1} {row} {information}"
        for k, row in enumerate(_g2o_poses(steps))
    )
    return "\n".join([*vertices, *edges, ""])


def _g2o_poses(X: np.ndarray) -> Iterable[str]:
    """Returns poses (K, 4, 4) as K texts: position, and quaternion x y z w."""
    if len(X) == 0:
        return []
    quat_xyzw = Rotation.from_matrix(X[:, :3, :3]).as_quat(canonical=True)
    numbers = np.hstack([X[:, :3, 3], quat_xyzw]).tolist()
    return [" ".join(map(repr, row)) for row in numbers]


class SessionDrive(Drive):
    """The scans of a session as a drive, which can be aligned."""

    def __init__(self, session: Session):
        """Wraps a session.

        Raises:
            InputError: it has no scans.
        """
        if len(session.X_WS) == 0:
            raise InputError(
                f"{session.folder}: no scans and poses, by which maps are"
                " aligned"
            )
        self.name = session.side
        # Both maps of a folder are in one world, by the form of the folder.
        self.world_frame = "map"
        self._session = session

    def __len__(self) -> int:
        return len(self._session.X_WS)

    @property
    def stamps_ns(self) -> np.ndarray:
        return np.arange(len(self), dtype=np.int64)

    @property
    def X_WS(self) -> np.ndarray:
        return self._session.X_WS

    def scan(self, index: int) -> np.ndarray:
        return from_xyz(self._session.scan(index))


class SessionPair(NamedTuple):
    """The two sessions of a folder: the older drive A and the newer drive B."""

    A: Session
    B: Session


def read_pair(folder: Path) -> SessionPair:
    """Returns the sessions of the two drives in a folder, with their maps.

    The drives are in the subfolders A and B.

    Raises:
        InputError: a map is missing or cannot be read.
    """
    for side in SIDES:
        if not (folder / side).is_dir():
            raise InputError(
                f"{folder}: no folder {side}; cns-drake truth makes both"
            )
    return SessionPair(*(read_session(folder / side) for side in SIDES))


def read_truth(pair: SessionPair) -> PairLabels:
    """Returns the ground-truth labels of both maps.

    Raises:
        InputError: see `read_labels`.
    """
    return PairLabels(
        *(
            read_labels(_truth_of(session), session, truth=True)
            for session in pair
        )
    )


def _truth_of(session: Session) -> Path:
    """Returns the file with the ground truth of a session."""
    path = session.folder / "truth.npy"
    if not is_there(path):
        raise InputError(
            f"{path}: not there; labels are scored against it: what happened to"
            " each point of map.ply (cns-drake truth makes it of simulated"
            " drives)"
        )
    return path
