"""Exact labels of two maps of one place: gone, new, kept or not observed.

Rays that are cast in the worlds of both drives determine the labels.

- A drive **observes** a point if the LiDAR can see it from one of the drive's
    poses: the point is within the LiDAR's ranges and field of view, and no
    surface occludes it. A surface occludes a point that lies more than `NEAR`
    behind the surface along the line of sight. At grazing angles, the point
    must lie farther behind the surface, so that a wall that has moved a little
    does not occlude its old position.
- A surface is **there** if the surface passes within `NEAR` of the point,
  measured perpendicular to the surface. Moving objects do not count.

A point of the older map A is `kept` if B's drive observes it and a surface of
B's world is there, `gone` if B's drive observes it and no surface is there, and
`unobserved` if B's drive does not observe it. In the same way, A's drive and
A's world decide whether a point of the newer map B is `kept`, `new` or `newly
seen`.

The poses of a drive are those of the scans that make its map. Surfaces are
ideal: glass and leaves count as solid geometry.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import io
import itertools
from pathlib import Path

import jinja2
import numpy as np

from cns_drake.base.complete_files import draft_folder, write_text
from cns_drake.base.drives.drive import Drive
from cns_drake.base.drives.mcap_drive import McapDrive, holds_mcap
from cns_drake.base.drives.same_world import check_same_world
from cns_drake.base.errors import InputError, validated
from cns_drake.base.files import user_errors
from cns_drake.base.process import num_cores
from cns_drake.base.progress import track
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scenarios.planning import DrivePlan
from cns_drake.scenarios.provenance import digest_inputs
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import describe_scenario, load_scenario
from cns_drake.simulation.scanning import still_scene
from cns_drake.simulation.simulated_drive import (
    SimulatedDrive,
    SimulationSource,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.studies.exact_overlap import Sight, sights_of
from evaluation.drives.sampling import sample_frames
from evaluation.map_update.labels import SIDES, Label
from evaluation.map_update.sessions import (
    SPACING,
    Pair,
    Session,
    write_labels,
    write_session,
)
from evaluation.map_update.structures import (
    StructureChange,
    structure_changes,
    write_structures,
)
from evaluation.results.styles import GONE, NEW
from evaluation.study.sources import DriveSource, RecordingSource

# A surface this near to a point is its own [m].
NEAR = 0.1
# At grazing angles, a surface hides points that lie this far behind,
# perpendicular to it [m].
_SKIN = 0.3
# Greatest distance behind a surface, along the line of sight, up to which
# `_SKIN` applies [m].
_GRAZING = 1.0
# Distance driven between the first poses to be tried [m]; most points are seen
# from these.
_FIRST_LOOKS = 32.0
# Number of points per cast.
_CHUNK = 1 << 15
# Side of the tiles in which points are found [m].
_TILE = 16.0
# Side of the cubes in which rays to points are neighbours [m].
_RAY_CUBE = 1.0
# Recorded poses are those of the scenario up to this [m, or without a unit].
_SAME_POSE = 1e-6
# One of each two opposite directions to the neighbours of a cube's middle.
# Every direction is within 28 deg of one of them: a ray of 1.25 times `NEAR`
# meets any plane within `NEAR`.
_AXES = np.array(
    [
        axis
        for axis in itertools.product((-1.0, 0.0, 1.0), repeat=3)
        if axis > (0.0, 0.0, 0.0)
    ]
)
_REACH = 1.25 * NEAR
# Edges and small parts lie in other directions: a spiral over half a sphere has
# one within 15 deg of each.
_SPIRAL = 64

# Drawing order of the labels: changes are on top.
_RGB = {
    Label.UNOBSERVED: (178, 182, 190),
    Label.NEWLY_SEEN: (120, 170, 230),
    Label.KEPT: (90, 96, 104),
    Label.GONE: GONE,
    Label.NEW: NEW,
}
_WORDS = {
    Label.UNOBSERVED: "unobserved: B's drive did not look there",
    Label.KEPT: "kept",
    Label.GONE: "gone",
    Label.NEW: "new",
    Label.NEWLY_SEEN: "newly seen: A's drive did not look there",
}
# Longest side of a picture [pixels].
_LONGEST_SIDE = 1600
# Smallest side of a pixel [m].
_SMALLEST_PIXEL = 0.2
# Structures in the page's table, the largest changes first.
_MOST_ROWS = 200


@dataclass(frozen=True)
class LabelledDrive:
    """A drive whose map is labelled, with the simulation of its world.

    Attributes:
        drive: the source of the scans that make the map: a recording of the
            drive, or the object in `simulated`.
        simulated: simulation of the drive, in whose world rays can be cast.
        scenario: the scenario of the drive.
    """

    drive: Drive
    simulated: SimulatedDrive
    scenario: Scenario

    def still(self) -> RayCastingScene:
        """Returns the drive's world without moving objects, for ray casting.

        The recording vehicle is left out as well.
        """
        if self.scenario.traffic.is_off:
            # The LiDAR does not see its own vehicle.
            return self.simulated.look(0)[0]
        world = load_stage(DrivePlan(self.scenario), with_vehicle=False)
        simulated = self.simulated
        X_WS = simulated.X_WBs[0] @ simulated.X_BS
        return still_scene(world, X_WS, simulated.pattern)


def open_labelled(place: str | Path) -> LabelledDrive:
    """Opens a drive whose world is known, for exact labels of its map.

    Args:
        place: a recording of cns-drake; or the name of a shipped drive, or a
            scenario file, to simulate the drive.

    Raises:
        InputError: the drive cannot be used, its points do not name their
            structures, or the files of its world have changed since it was
            recorded.
    """
    path = Path(place)
    if not path.exists() or not holds_mcap(path):
        return simulate_labelled(load_scenario(place))
    folder = path if path.is_dir() else path.parent
    if not (folder / "scenario.yaml").is_file():
        raise InputError(
            f"{folder}: no scenario.yaml: the geometry of a recording by others"
            " is not known (cns-drake export --format map-sessions makes its"
            " maps)"
        )
    drive = McapDrive(path)
    _check_instances(drive, path)
    scenario = load_scenario(folder / "scenario.yaml")
    _check_unchanged(drive, path, scenario)
    simulated = SimulatedDrive(scenario)
    planned = simulated.X_WS[: len(drive)]
    if planned.shape != drive.X_WS.shape or not np.allclose(
        planned, drive.X_WS, rtol=0.0, atol=_SAME_POSE
    ):
        raise InputError(
            f"{path}: its poses are not those of its scenario.yaml"
        )
    return LabelledDrive(drive, simulated, scenario)


def simulate_labelled(scenario: Scenario) -> LabelledDrive:
    """Returns a drive that is simulated while its scans are read.

    Raises:
        InputError: the scenario cannot be run.
    """
    simulated = SimulatedDrive(scenario)
    return LabelledDrive(simulated, simulated, scenario)


def labelled_drive(source: DriveSource) -> LabelledDrive:
    """Returns the drive of a source with its world, for exact labels.

    Raises:
        InputError: as in `open_labelled` or `simulate_labelled`.
    """
    if isinstance(source, SimulationSource):
        return simulate_labelled(source.scenario)
    assert isinstance(source, RecordingSource)
    return open_labelled(source.path)


def write_truth(
    a: LabelledDrive,
    b: LabelledDrive,
    output: Path,
    spacing: float = SPACING,
    *,
    across_maps: bool = False,
) -> tuple[Mapping[str, Counter[int]], list[StructureChange]]:
    """Writes the maps of two drives, with exact labels of what changed.

    `evaluation.map_update.sessions` describes the files of the maps. The files
    `structures.csv` and `index.html` show how much of each structure is gone or
    new.

    Args:
        a: the older drive A.
        b: the newer drive B.
        output: the folder to write, new or empty.
        spacing: distance driven between two scans [m].
        across_maps: whether the drives' maps may have different names, as an
            aged map has.

    Returns:
        Numbers of points: A or B -> label -> number of the map's points with
        this label; and a list with the change of each structure.

    Raises:
        InputError: the drives are of different worlds, or the folder cannot be
            written.
    """
    check_same_world(a.drive, b.drive, across_maps=across_maps)
    _check_same_map(a, b)
    with user_errors(output):
        if output.exists() and (not output.is_dir() or any(output.iterdir())):
            raise InputError(f"{output}: exists already; give a new folder")
    with draft_folder(output) as draft:
        sessions, frames = [], []
        for side, one in zip(SIDES, (a, b), strict=True):
            session, taken = write_session(one.drive, draft / side, spacing)
            sessions.append(session)
            frames.append(taken)
        pair = Pair(*sessions)
        truth = (
            label_points(pair.A, b, frames[1]),
            label_points(pair.B, a, frames[0]),
        )
        for session, labels in zip(pair, truth, strict=True):
            write_labels(session.folder / "truth.npy", labels)
        names = [one.drive.instances or {} for one in (a, b)]
        present = [one.simulated.structures for one in (a, b)]
        table = structure_changes(pair, truth, names, present)
        write_structures(draft / "structures.csv", table)
        write_page(
            draft / "index.html",
            pair,
            truth,
            table,
            (a.drive.name, b.drive.name),
        )
    counts = {
        side: Counter(labels.tolist())
        for side, labels in zip(SIDES, truth, strict=True)
    }
    return counts, table


def label_points(
    session: Session, other: LabelledDrive, frames: np.ndarray
) -> np.ndarray:
    """Returns the exact label of each point of a drive's map, (N,) uint8.

    The labels are values of `evaluation.map_update.labels.Label`. A label
    states whether the other drive observes the point and, if so, whether the
    world of the other drive has a surface there.

    Args:
        session: the drive whose map of N points is labelled.
        other: the other drive.
        frames: (K,) frame numbers of the scans of the other drive that count.
    """
    unobserved, kept, changed = SIDES[session.side]
    labels = np.full(len(session.points), unobserved, np.uint8)
    seen = observed_points(session.points, other.simulated, frames)
    rows = np.flatnonzero(seen)
    there = is_there(session.points[rows], other.still())
    labels[rows] = np.where(there, kept, changed)
    return labels


def observed_points(
    points: np.ndarray,
    drive: SimulatedDrive,
    frames: np.ndarray,
) -> np.ndarray:
    """Returns which points a simulated drive observes, (N,) bool.

    A point is observed if the LiDAR can see it at one of the given frames: the
    point is within the LiDAR's ranges and field of view, and no surface
    occludes it.

    Args:
        points: (N, 3) points in W [m].
        drive: the drive.
        frames: (K,) frame numbers.
    """
    result = np.zeros(len(points), bool)
    look = sights_of(drive)
    tiles = _Tiles(points)
    first = sample_frames(drive.X_WS[frames, :3, 3], _FIRST_LOOKS)
    looks = np.concatenate([frames[first], np.delete(frames, first)]).tolist()
    with ThreadPoolExecutor(num_cores()) as threads:
        for frame in track(
            looks, f"looking from {drive.name}", len(looks), "scans"
        ):
            near = tiles.near(drive.X_WS[frame, :3, 3], drive.pattern.max_range)
            if not near:
                continue
            sight = look(frame)
            rows = np.concatenate([tiles.left[tile] for tile in near])
            for seen in threads.map(
                lambda chunk, sight=sight: chunk[
                    _observed_rows(points[chunk], sight)
                ],
                list(_chunks(rows)),
            ):
                result[seen] = True
            # Points that are seen already need no more rays.
            for tile in near:
                left = tiles.left[tile]
                tiles.left[tile] = left[~result[left]]
    return result


def _observed_rows(points: np.ndarray, sight: Sight) -> np.ndarray:
    """Returns the rows of the points (N, 3) in W that are observed."""
    p_WS, R_WS = sight.X_WS.translation(), sight.X_WS.rotation().matrix()
    rows, d_Sset, distances = sight.reached((points - p_WS) @ R_WS)
    hits = sight.scene.cast_rays(p_WS, d_Sset, distances, R_WSset=R_WS)
    # A miss is infinitely far behind the point.
    before = distances - hits.ranges
    is_free = before <= NEAR
    grazed = np.flatnonzero(~is_free & (before <= _GRAZING))
    d_Sset = d_Sset[grazed]
    hits = sight.scene.cast_rays(
        p_WS, d_Sset, distances[grazed], R_WSset=R_WS, with_normals=True
    )
    cosines = np.einsum("ij,ij->i", hits.normals_W, d_Sset @ R_WS.T)
    is_free[grazed] = before[grazed] * np.abs(cosines) <= _SKIN
    return rows[is_free]


class _Tiles:
    """Points sorted into square tiles; `left` has rows not yet observed."""

    def __init__(self, points: np.ndarray):
        cells = np.floor(points[:, :2] / _TILE).astype(np.int64)
        # Rays to neighbours meet the same surfaces, which is fast.
        fine = np.floor(points / _RAY_CUBE).astype(np.int64)
        order = np.lexsort((*fine.T, *cells.T))
        cells = cells[order]
        is_first = np.ones(len(points), bool)
        is_first[1:] = (np.diff(cells, axis=0) != 0).any(axis=1)
        starts = np.flatnonzero(is_first)
        self.left = np.split(order, starts[1:])
        self._middles = _TILE * (cells[starts] + 0.5)

    def near(self, p_WS: np.ndarray, reach: float) -> list[int]:
        """Returns the numbers of the tiles near a sensor at `p_WS` (3,) [m].

        Tiles beyond `reach` [m], and tiles whose points have all been observed,
        are left out.
        """
        away = np.linalg.norm(self._middles - p_WS[:2], axis=1)
        near = np.flatnonzero(away <= reach + _TILE)
        return [int(tile) for tile in near if len(self.left[tile])]


def _spiral() -> np.ndarray:
    """Returns unit directions at even distances, (_SPIRAL, 3), z > 0.

    Source: Swinbank and Purser, Fibonacci grids, QJRMS 2006.
    """
    number = np.arange(_SPIRAL) + 0.5
    z = 1.0 - number / _SPIRAL
    angle = np.pi * (1.0 + np.sqrt(5.0)) * number
    around = np.sqrt(1.0 - z * z)
    return np.stack([around * np.cos(angle), around * np.sin(angle), z], axis=1)


def is_there(points: np.ndarray, scene: RayCastingScene) -> np.ndarray:
    """Returns which points (N, 3) in W [m] lie on a surface, (N,) bool.

    A point lies on a surface of the scene if it is at most `NEAR` [m] away.
    """
    result = np.zeros(len(points), bool)
    left = np.arange(len(points))
    for axis in _AXES / np.linalg.norm(_AXES, axis=1, keepdims=True):
        for rows in _chunks(left):
            hits = scene.cast_rays(
                points[rows] - _REACH * axis,
                np.broadcast_to(axis, (len(rows), 3)),
                2.0 * _REACH,
                with_normals=True,
            )
            along = np.abs(np.minimum(hits.ranges, np.float32(9.0)) - _REACH)
            # The normal of a miss is zero.
            across = along * np.abs(hits.normals_W @ axis)
            result[rows] = (hits.geometry >= 0) & (across <= NEAR)
        left = left[~result[left]]
    for axis in _spiral():
        for rows in _chunks(left):
            hits = scene.cast_rays(
                points[rows] - NEAR * axis,
                np.broadcast_to(axis, (len(rows), 3)),
                2.0 * NEAR,
            )
            result[rows] = hits.geometry >= 0
        left = left[~result[left]]
    return result


def _chunks(rows: np.ndarray) -> Iterator[np.ndarray]:
    for start in range(0, len(rows), _CHUNK):
        yield rows[start : start + _CHUNK]


def _check_instances(drive: McapDrive, path: Path) -> None:
    names = drive.scan(0).dtype.names or () if len(drive) else ()
    if drive.instances is None or not {"label", "instance"} <= set(names):
        raise InputError(
            f"{path}: its points have no label and instance; record the drive "
            "anew"
        )


def _check_unchanged(drive: McapDrive, path: Path, scenario: Scenario) -> None:
    """Refuses a recording of another scenario, or of a changed world.

    The files beside an MCAP can belong to another recording, so the MCAP's own
    data decide.
    """
    if drive.scenario is None or not isinstance(drive.inputs, dict):
        raise InputError(
            f"{path}: the recording does not say which world it shows"
        )
    recorded = describe_scenario(validated(Scenario, drive.scenario, path))
    told = describe_scenario(scenario)
    for field in sorted({*recorded, *told}):
        if recorded.get(field) != told.get(field):
            raise InputError(
                f"{path}: {field}: its scenario.yaml is that of another drive"
            )
    if drive.inputs != digest_inputs(scenario):
        raise InputError(
            f"{path}: its world ({scenario.folder.path}) has changed "
            "since it was recorded; record the drive anew"
        )


def _check_same_map(a: LabelledDrive, b: LabelledDrive) -> None:
    """Refuses drives of different map folders, even of the same name.

    For worlds without a map folder this cannot be checked; the user must make
    sure that both show the same place.
    """
    if (a.scenario.map is None) != (b.scenario.map is None):
        raise InputError(
            f"{b.drive.name}: one drive is through a map, the other through a "
            "world; give two of one place"
        )


def write_page(
    path: Path,
    pair: Pair,
    truth: Sequence[np.ndarray],
    table: Sequence[StructureChange],
    names: tuple[str, str],
) -> None:
    """Writes a web page with two labelled maps and their changed structures.

    Args:
        path: path of the page.
        pair: the maps of A and B, which the page shows from above.
        truth: labels of the points of each map.
        table: the changed structures.
        names: names of the two drives.
    """
    low, step, shape = _picture_frame(pair)
    maps = []
    for session, labels, name in zip(pair, truth, names, strict=True):
        counts = ", ".join(
            f"{(labels == label).sum():,} "
            f"{label.name.lower().replace('_', ' ')}"
            for label in _RGB
            if (labels == label).any()
        )
        image = _draw(session.points, labels, low, step, shape)
        maps.append((session.side, name, counts, _png(image)))
    rows = sorted(
        (row for row in table if row.verdict in ("gone", "new")),
        key=lambda row: -row.changed,
    )[:_MOST_ROWS]
    template = Path(__file__).with_name("map_truth.html").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined
    )
    text = environment.from_string(template).render(
        names=names,
        legend=[(_RGB[label], words) for label, words in _WORDS.items()],
        maps=maps,
        rows=rows,
    )
    write_text(path, f"{text}\n")


def _picture_frame(pair: Pair) -> tuple[np.ndarray, float, tuple[int, int]]:
    """Returns corner [m], side of a pixel [m], and pixels (rows, columns)."""
    points = np.concatenate([one.points[:, :2] for one in pair])
    if len(points) == 0:
        points = np.zeros((1, 2))
    # A few far points would make the streets small.
    low, high = np.percentile(points, (0.2, 99.8), axis=0)
    step = max(float((high - low).max()) / _LONGEST_SIDE, _SMALLEST_PIXEL)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    return low, step, (int(rows), int(columns))


def _draw(
    points: np.ndarray,
    labels: np.ndarray,
    low: np.ndarray,
    step: float,
    shape: tuple[int, int],
) -> np.ndarray:
    """Returns the map from above, (rows, columns, 3) uint8, north up."""
    image = np.full((*shape, 3), 255, np.uint8)
    columns, rows = ((points[:, :2] - low) / step).astype(int).T
    inside = (columns >= 0) & (columns < shape[1])
    inside &= (rows >= 0) & (rows < shape[0])
    for label, rgb in _RGB.items():
        chosen = inside & (labels == label)
        image[shape[0] - 1 - rows[chosen], columns[chosen]] = rgb
    return image


def _png(image: np.ndarray) -> str:
    import base64

    from matplotlib.image import imsave

    stream = io.BytesIO()
    imsave(stream, image)
    return base64.b64encode(stream.getvalue()).decode()
