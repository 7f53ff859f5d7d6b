"""Finds the recordings in a folder, and the pairs in which to compare them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
import os
from pathlib import Path
import re

from cns_drake.base.drives.drive import SCENARIO, driven_way
from cns_drake.base.drives.lidar_fields import LidarField
from cns_drake.base.errors import InputError, one_line
from cns_drake.base.listing import listed, natural_key
from evaluation.drives import find_readers, open_drive
from evaluation.drives.cns_folder import holds_cns
from evaluation.drives.kitti import holds_kitti
from evaluation.study.sources import (
    DriveSource,
    RecordingSource,
)
from evaluation.study.tasks.task import NamedDrive

# The names of drives that state map and stage, the first ones as those of NCLT,
# Boreas and rosbag2, which end in a date and a time, the last ones as MulRan's.
_NAMES = (
    re.compile(r"(?P<map>.*?)[-_]?(?P<stage>\d{4}([-_])\d\d?\3\d\d?(\D.*)?)"),
    re.compile(r"(?P<map>.+)_(?P<stage>[^_]+)"),
    re.compile(r"(?P<map>.*\D)(?P<stage>\d+)"),
)
# A whole disk has more folders, and takes minutes to search.
_MOST_FOLDERS = 10_000
_GUESSED = (
    " Map and stage were guessed from the drive's name; a scenario.yaml in its"
    " folder states them."
)
_UNPLACED = "map and stage are unknown: no scenario, and no name <map>_<stage>"


@dataclass(frozen=True)
class RecordingInfo:
    """A recording that exists or will be made, with its map and stage.

    Attributes:
        name: name of the recording.
        path: file or folder of the recording.
        map_name: name of the map.
        stage: name of the stage. The names of a map's stages, sorted in natural
            order, are in the order of time.
        way: fields of the scenario that determine the path of the drive; None
            if unknown.
        needs: names of the jobs that make the recording; empty if it exists.
        made_by: function that opens the drive; None to open the recording at
            `path` with its default options.
        lidar_field: number of rings and field of view of the LiDAR; None if
            unknown.
        is_guessed: whether map and stage come from the name of the drive.
    """

    name: str
    path: Path
    map_name: str
    stage: str
    way: dict | None
    needs: tuple[str, ...] = ()
    made_by: DriveSource | None = None
    lidar_field: LidarField | None = None
    is_guessed: bool = False

    @property
    def source(self) -> DriveSource:
        """Function that opens the drive."""
        return self.made_by or RecordingSource(self.path.absolute())

    @property
    def named(self) -> NamedDrive:
        """The drive, in the form in which tasks take drives."""
        return NamedDrive(self.name, self.source, self.needs)

    def drives_like(self, other: RecordingInfo) -> bool:
        """Returns whether another drive follows the same route.

        The result is false if the route of one drive is unknown.
        """
        return self.way is not None and self.way == other.way


# Two recordings: of places and of queries, or of an earlier stage and of a
# later one.
Recordings = tuple[RecordingInfo, RecordingInfo]


@dataclass(frozen=True)
class MapDrives:
    """The drives through one map.

    Attributes:
        name: name of the map.
        stages: stage -> the drive through this stage.
        others: further drives, such as controls, which follow the route of one
            stage through another stage.
    """

    name: str
    stages: dict[str, RecordingInfo]
    others: tuple[RecordingInfo, ...]

    @property
    def last(self) -> RecordingInfo:
        """The drive through the last stage."""
        return self.stages[max(self.stages, key=natural_key)]

    def sessions(self, stage: str) -> tuple[RecordingInfo, ...]:
        """Returns all drives through a stage, without controls.

        A control follows the route of the drive through another stage.

        Args:
            stage: name of the stage.
        """
        elsewhere = [one for name, one in self.stages.items() if name != stage]
        further = (
            other
            for other in self.others
            if other.stage == stage
            and not any(other.drives_like(one) for one in elsewhere)
        )
        return (self.stages[stage], *further)

    def change_pairs(self) -> list[Recordings]:
        """Returns the pairs of drives between which change is measured.

        Each drive of an earlier stage is paired with the drive of the last
        stage.
        """
        *earlier, _ = sorted(self.stages, key=natural_key)
        return [(self.stages[key], self.last) for key in earlier]

    def recognition_pairs(
        self, *, with_itself: bool = False
    ) -> list[Recordings]:
        """Returns the pairs (database, query) for place recognition.

        Each earlier stage is paired with the last stage as the query. If the
        map has only two stages, each of the two stages is the query once.

        Args:
            with_itself: whether to add a pair of each stage with itself, for
                loop closure.
        """
        pairs = self.change_pairs()
        if len(pairs) == 1:
            pairs += [(later, earlier) for earlier, later in pairs]
        if with_itself:
            pairs += [(one, one) for one in self.stages.values()]
        return pairs

    def unchanged_pair(
        self, database: RecordingInfo, query: RecordingInfo
    ) -> Recordings | None:
        """Returns the control of a pair: the same two routes, in one stage.

        One drive of the pair is replaced by a drive on the same route, but in
        the stage of the other drive. If possible, the database is replaced, so
        the queries keep their scans.

        Args:
            database: drive of the database.
            query: drive of the queries.

        Returns:
            The new database and query; None if there is no suitable drive, or
            if a drive is compared with itself.
        """
        if database is query:
            return None
        for replaced, kept in ((database, query), (query, database)):
            for other in self.others:
                if other.stage == kept.stage and other.drives_like(replaced):
                    if replaced is database:
                        return other, query
                    return database, other
        return None


def find_recordings(
    folder: Path,
    on_note: Callable[[str], None] = lambda text: None,
    lidar: str | None = None,
    columns: int | None = None,
) -> list[RecordingInfo]:
    """Returns all recordings in a folder and its direct subfolders.

    The recordings can have any format that `evaluation.drives.open_drive`
    reads. Recordings in the layouts of CNS and KITTI are found up to three
    levels down, where exports put them. A recording in the layout of KITTI
    needs a `scenario.yaml`.

    Map and stage of a recording come from its scenario. Without a scenario,
    the name of the recording gives both: `<map>_<stage>`, `<map><stage>` as in
    KAIST01, or `<map>-<date>`. If the name is only a date, as in NCLT, the
    world frame is the map. Recordings without map and stage, and recordings in
    deeper folders, are left out with a note.

    Args:
        folder: the folder.
        on_note: is called with each note on how recordings are read or left
            out.
        lidar: name of the LiDAR, for recordings with several LiDARs.
        columns: number of columns of `.bin` files; by default guessed from the
            values.

    Raises:
        InputError: if no recording has a map and a stage, or a recording cannot
            be read.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    paths = _find_drives(folder, on_note)
    placed = {path: _place(path, on_note, lidar, columns) for path in paths}
    found = [one for one in placed.values() if one is not None]
    if not found:
        raise InputError(f"{paths[0]}: {_UNPLACED}")
    for path, one in placed.items():
        if one is None:
            on_note(f"{path}: left out: {_UNPLACED}")
    return found


def nothing_to_compare(cities: Iterable[MapDrives]) -> list[str]:
    """Returns a note for the user on each map with drives in one stage only."""
    return [
        f"{city.name}: nothing to compare: all drives are through stage"
        f" {', '.join(city.stages)}. A report compares drives through two"
        " stages: `cns-drake import --years` makes stages of a real city, and"
        " a second drive (sequence_NN.yaml) goes through one of them."
        " --exclude-recent compares a drive with itself."
        + (_GUESSED if any(map(_is_guessed, city.stages.values())) else "")
        for city in cities
        if not city.change_pairs()
    ]


def drives_by_map(recordings: Iterable[RecordingInfo]) -> list[MapDrives]:
    """Groups recordings by map, and sorts the maps by name.

    Raises:
        InputError: if two recordings have the same name, or the same map and
            stage.
    """
    recordings = list(recordings)
    paths: dict[str, Path] = {}
    for one in recordings:
        if one.name in paths:
            raise InputError(
                f"{one.path}: {one.name} is there twice (also"
                f" {paths[one.name]})"
            )
        paths[one.name] = one.path
    return [
        _drives_of_map(name, [r for r in recordings if r.map_name == name])
        for name in sorted({recording.map_name for recording in recordings})
    ]


def _find_drives(folder: Path, on_note: Callable[[str], None]) -> list[Path]:
    """Returns the paths of the drives in a folder, in order.

    Raises:
        InputError: there is none, or there are too many folders.
    """
    children = listed(folder)
    drives = [path for path in children if _holds_drive(path)]
    nested = [path for path in children if path.is_dir() and path not in drives]
    deeper: list[Path] = []
    below = (path for child in nested for path in _folders(child, 2))
    for number, path in enumerate(below):
        if number == _MOST_FOLDERS:
            raise InputError(
                f"{folder}: more than {_MOST_FOLDERS} folders in it; give the"
                " folder of the recordings"
            )
        if _holds_drive(path):
            is_export = holds_cns(path) or holds_kitti(path)
            (drives if is_export else deeper).append(path)
    for path in sorted(deeper, key=_natural):
        on_note(
            f"{path}: left out: not directly in {folder}; give its folder, or"
            " move it up"
        )
    paths: list[Path] = []
    unnamed: list[Path] = []
    for path in sorted(drives, key=_natural):
        is_placed = not holds_kitti(path) or (path / SCENARIO).is_file()
        (paths if is_placed else unnamed).append(path)
    if unnamed:
        fault = (
            f"{unnamed[0]}: no {SCENARIO}, which states map and stage of a"
            f" drive in KITTI's layout ({len(unnamed)} drives have none)"
        )
        if not paths:
            raise InputError(fault)
        on_note(f"{fault}; left out")
    if not paths:
        raise InputError(f"{folder}: no recorded drive in it")
    return paths


def _natural(path: Path) -> tuple:
    return natural_key(str(path))


def _folders(folder: Path, levels: int) -> Iterator[Path]:
    """Yields the folders in a folder, down to a number of levels."""
    with os.scandir(folder) as entries:
        found = [
            Path(entry)
            for entry in entries
            if entry.is_dir() and not entry.name.startswith(".")
        ]
    for path in found:
        yield path
        if levels > 1:
            yield from _folders(path, levels - 1)


def _holds_drive(path: Path) -> bool:
    return path.suffix != ".part" and bool(find_readers(path))


def _is_guessed(recording: RecordingInfo) -> bool:
    return recording.is_guessed


def _place(
    path: Path,
    on_note: Callable[[str], None],
    lidar: str | None,
    columns: int | None,
) -> RecordingInfo | None:
    """Returns a recording; None if its map or stage is unknown."""
    drive = open_drive(path, lidar, columns)
    for note in drive.notes:
        on_note(note)
    scenario = drive.scenario or {}
    way = driven_way(scenario)
    is_guessed = not {"map", "stage"} <= set(scenario)
    if not is_guessed:
        map_name = one_line(Path(str(scenario["map"])).name)
        stage = one_line(scenario["stage"])
    else:
        matches = (name.fullmatch(drive.session) for name in _NAMES)
        match = next(filter(None, matches), None)
        if match is None:
            return None
        map_name = match["map"] or drive.world_frame.partition("/")[0]
        stage = match["stage"]
    source = None
    if (lidar, columns) != (None, None):
        source = RecordingSource(path.absolute(), lidar, columns)
    return RecordingInfo(
        drive.name,
        path,
        map_name,
        stage,
        way,
        made_by=source,
        lidar_field=drive.lidar_field,
        is_guessed=is_guessed,
    )


def _drives_of_map(name: str, recordings: list[RecordingInfo]) -> MapDrives:
    stages = {}
    stages_there = {recording.stage for recording in recordings}
    for stage in sorted(stages_there, key=natural_key):
        candidates = [r for r in recordings if r.stage == stage]
        named = [r for r in candidates if r.name == f"{name}_{stage}"]
        if len(candidates) > 1 and len(named) != 1:
            raise InputError(
                f"{candidates[0].path}: one of {len(candidates)} recordings of"
                f" {name} at stage {stage}, and not one of them named"
                f" {name}_{stage}"
            )
        stages[stage] = (named or candidates)[0]
    chosen = {recording.name for recording in stages.values()}
    others = tuple(r for r in recordings if r.name not in chosen)
    return MapDrives(name, stages, others)
