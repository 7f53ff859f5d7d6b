"""The table of a map's drives and their figures: `sequences.csv`.

Planning a drive and reading a stage take seconds, which is too slow for a list
of drives. Each row of the table therefore contains a checksum of its input
files. If a checksum changes, the figures of the row are computed again.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import get_type_hints
import zlib

from cns_drake.recording import frames_within
from cns_drake.scenarios import scenario_files
from cns_drake.scenarios.scenario import Scenario
from evaluation.base import (
    InputError,
    check_writable,
    doing,
    is_there,
    read_records,
    user_errors,
    write_csv,
)
from worlds.maps import MapFolder, drive_name, no_drives, shipped_cities


@dataclass(frozen=True)
class DriveRow:
    """A drive, as a row of the table of a map's drives.

    Attributes:
        sequence: name of the drive.
        map: name of the map.
        stage: stage through which the drive goes.
        title: one line on what the drive shows.
        checksum: checksum of the files from which the figures in this row are
            computed.
        length: length of the path [m].
        duration: duration of the drive [s].
        frames: number of frames that are recorded.
        structures, triangles: numbers of structures and triangles in the stage.
    """

    sequence: str
    map: str
    stage: str
    title: str
    checksum: str
    length: float
    duration: float
    frames: int
    structures: int
    triangles: int


def listed_drives(folders: Iterable[Path] = ()) -> list[DriveRow]:
    """Returns the drives whose stages exist, as `cns-drake list` shows them.

    Args:
        folders: folders of maps; by default those of the shipped cities.

    Raises:
        InputError: if a folder has no drive, a drive cannot be read or planned,
            or its stage cannot be parsed.
    """
    rows = []
    for folder in folders or shipped_cities().values():
        of_map = _drive_rows(folder)
        if folders and not of_map:
            raise no_drives(folder)
        rows += of_map
    return rows


def _drive_rows(
    folder: Path,
    sizes: Mapping[str, tuple[int, int]] | None = None,
) -> list[DriveRow]:
    """Returns the rows of a map's drives, see `write_table`."""
    map_folder = MapFolder(folder)
    known = {row.checksum: row for row in _known_rows(map_folder.drive_table)}
    # Names and sizes stand for the meshes: reading them all would take too long
    # for a listing.
    meshes = "".join(
        f"{mesh.name} {mesh.stat().st_size}"
        for mesh in sorted(map_folder.meshes.glob("*"))
    ).encode()
    rows = []
    for path in map_folder.drives():
        scenario = scenario_files.read_scenario_file(path)
        world = scenario.world_file
        if not is_there(world):
            continue
        # A map whose drives follow waypoints has no roads.
        roads = [p for p in (map_folder.roads,) if is_there(p)]
        checksum = _checksum([*scenario.files, *roads, world], meshes)
        row = known.get(checksum)
        if row is None:
            doing(f"measuring {drive_name(path)}")
            size = (sizes or {}).get(str(scenario.stage))
            row = _measured_row(scenario, checksum, size)
        rows.append(row)
    return rows


def check_table(folder: Path) -> None:
    """Checks that the table of drives in a map's folder may be written.

    Raises:
        InputError: a file that is no such table has its name, or it cannot be
            written.
    """
    path = MapFolder(folder).drive_table
    if not path.parent.is_dir():
        return  # The check would make a folder whose files nobody has written.
    check_writable(path)
    if is_there(path):
        head = ",".join(field.name for field in fields(DriveRow)[:3])
        with user_errors(path), path.open("rb") as stream:
            if not stream.read(len(head)).startswith(head.encode()):
                raise InputError(
                    f"{path}: no table of drives; move it to another folder"
                )


def write_table(
    folder: Path,
    sizes: Mapping[str, tuple[int, int]] | None = None,
) -> None:
    """Updates the table of drives in a map's folder.

    A folder without drives gets no table.

    Args:
        folder: folder of the map.
        sizes: stage -> numbers of structures and triangles in the stage, if
            known. For a stage without an entry, the world is loaded to count
            structures and triangles, which takes long.

    Raises:
        InputError: if a drive cannot be read or planned, its stage cannot be
            parsed, or the table may not be written.
    """
    rows = _drive_rows(folder, sizes)
    if not rows:
        return
    check_table(folder)
    names = [field.name for field in fields(DriveRow)]
    write_csv(MapFolder(folder).drive_table, names, map(astuple, rows))


def _known_rows(path: Path) -> list[DriveRow]:
    """Returns the rows of a table; empty if it is damaged."""
    types = get_type_hints(DriveRow)
    try:
        return [
            DriveRow(**{name: kind(row[name]) for name, kind in types.items()})
            for _, row in read_records(path, list(types))
        ]
    except (InputError, ValueError):
        return []


def _checksum(files: Sequence[Path], last: bytes) -> str:
    """Returns the CRC-32 of files and of the bytes `last`, as hexadecimal."""
    total = 0
    for file in files:
        with user_errors(file):
            total = zlib.crc32(file.read_bytes(), total)
    return f"{zlib.crc32(last, total):08x}"


def _measured_row(
    scenario: Scenario, checksum: str, size: tuple[int, int] | None
) -> DriveRow:
    """Plans a drive, and returns the table row of the drive.

    `size` gives the numbers of structures and triangles in the stage, if known.
    """
    # Slow to import, and rarely needed.
    from cns_drake.scenarios.planning import plan_drive

    trajectory = plan_drive(scenario)
    frames = frames_within(trajectory.duration, scenario.frame_period)
    structures, triangles = size or _stage_size(scenario)
    return DriveRow(
        sequence=scenario.name,
        map=scenario.folder.path.resolve().name,
        stage=str(scenario.stage),
        title=scenario.title,
        checksum=checksum,
        length=round(trajectory.length, 1),
        duration=round(trajectory.duration, 2),
        frames=min(frames, scenario.frames or frames),
        structures=structures,
        triangles=triangles,
    )


def _stage_size(scenario: Scenario) -> tuple[int, int]:
    """Returns the numbers of structures and triangles of a stage."""
    from cns_drake.scenarios.planning import load_scenario_world
    from cns_drake.scene import TriangleSurface, read_perception_geometry

    world = load_scenario_world(scenario)
    geometries = read_perception_geometry(world.scene_graph.model_inspector())
    return len({geometry.structure for geometry in geometries}), sum(
        len(geometry.surface.triangles)
        for geometry in geometries
        if isinstance(geometry.surface, TriangleSurface)
    )
