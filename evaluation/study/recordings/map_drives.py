"""The drives through one map, and the pairs in which a study compares them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import csv
from dataclasses import dataclass, replace
from pathlib import Path

from evaluation.alignment import When, WorldVerdict, open_pair
from evaluation.base import InputError, fingerprint, natural_key, read_text
from evaluation.drives import (
    Drive,
    DriveSource,
    LidarField,
    Placement,
    RecordingSource,
)
from evaluation.study.pair import StudyDrive

_GUESSED = (
    " Map and stage were guessed from the drive's name; a scenario.yaml in its"
    " folder states them."
)


# Drive -> digest of its scenario, of all shipped drives.
_SHIPPED = Path(__file__).with_name("shipped_drives.csv")


def scenario_digest(scenario: Mapping) -> str:
    """Returns a digest of what a scenario's fields say of a drive.

    Titles do not count, and neither does the number of frames: the answers of
    another one have another number of queries.
    """
    return fingerprint(
        {k: v for k, v in scenario.items() if k not in ("title", "frames")}
    )


def unlike_shipped(recordings: Iterable[RecordingInfo]) -> str:
    """Returns which recording is not the shipped drive of its name, or ""."""
    rows = csv.DictReader(read_text(_SHIPPED).splitlines())
    known = {row["drive"]: row["scenario"] for row in rows}
    for one in recordings:
        if known.get(one.name, one.scenario) != one.scenario:
            return f"{one.name} has other settings than the shipped drive"
    return ""


@dataclass(frozen=True)
class RecordingInfo:
    """A drive with its map and stage, recorded or simulated.

    Attributes:
        name: name of the recording.
        path: file or folder of the recording.
        map_name: name of the map.
        stage: name of the stage. The names of a map's stages, sorted in natural
            order, are in the order of time.
        way: fields of the scenario that determine the path of the drive; None
            if unknown.
        made_by: function that opens the drive; None to open the recording at
            `path` with its default options.
        lidar_field: number of rings and field of view of the LiDAR; None if
            unknown.
        is_guessed: whether map and stage come from the name of the drive.
        scenario: digest of the drive's scenario, see `scenario_digest`; empty
            if unknown.
        world: name of the world of its poses, see `Drive.world`; None if the
            drive is simulated.
    """

    name: str
    path: Path
    map_name: str
    stage: str
    way: dict | None
    made_by: DriveSource | None = None
    lidar_field: LidarField | None = None
    is_guessed: bool = False
    scenario: str = ""
    world: str | None = None

    @property
    def source(self) -> DriveSource:
        """Function that opens the drive."""
        return self.made_by or RecordingSource(self.path.absolute())

    @property
    def drive(self) -> StudyDrive:
        """The drive, in the form in which tasks take drives."""
        return StudyDrive(self.name, self.source)

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
        others: further drives, such as controls. A control follows the route of
            the drive through one stage, but goes through another stage.
        world: the world of the drives; None if they are simulated, or none is
            compared.
    """

    name: str
    stages: dict[str, RecordingInfo]
    others: tuple[RecordingInfo, ...]
    world: WorldVerdict | None = None

    @property
    def recordings(self) -> tuple[RecordingInfo, ...]:
        """All drives through the map."""
        return (*self.stages.values(), *self.others)

    @property
    def last(self) -> RecordingInfo:
        """The drive through the last stage."""
        return self.stages[max(self.stages, key=natural_key)]

    def change_pairs(self) -> list[Recordings]:
        """Returns the pairs of drives between which change is measured.

        Each drive of an earlier stage is paired with the drive of the last
        stage.
        """
        *earlier, _ = sorted(self.stages, key=natural_key)
        return [(self.stages[key], self.last) for key in earlier]

    def recognition_pairs(self) -> list[Recordings]:
        """Returns the pairs (database, query) for place recognition.

        Each earlier stage is paired with the last stage as the query. If the
        map has only two stages, each of the two stages is the query once.
        """
        pairs = self.change_pairs()
        if len(pairs) == 1:
            pairs += [(later, earlier) for earlier, later in pairs]
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


def _in_one_world(
    city: MapDrives, on_note: Callable[[str], None], align: When
) -> MapDrives:
    """Returns a map's recordings in the world of the last stage's drive."""
    last = city.last
    there = [last, *(one for one in city.recordings if one is not last)]
    if any(one.world is None for one in there) or not city.change_pairs():
        return city
    drives = [one.source() for one in there]
    # Those who found the recordings have told how they are read.
    told = {text for one in drives for text in one.notes}
    opened = open_pair(
        drives,
        when=align,
        on_note=lambda text: None if text in told else on_note(text),
    )
    city = replace(city, world=opened.world)
    if not opened.world.aligned:
        return city
    placed = {
        one.name: replace(one, made_by=_placed(one, drive))
        for one, drive in zip(there, opened.drives, strict=True)
    }
    return replace(
        city,
        stages={key: placed[one.name] for key, one in city.stages.items()},
        others=tuple(placed[one.name] for one in city.others),
    )


def _placed(one: RecordingInfo, drive: Drive | Path) -> RecordingSource:
    """Returns the source of a recording at the poses of an aligned drive."""
    source = one.source
    assert isinstance(source, RecordingSource)
    assert isinstance(drive, Drive)
    return replace(source, placement=Placement.of(drive))


def nothing_to_compare(cities: Iterable[MapDrives]) -> list[str]:
    """Returns a note for the user on each map with drives in only one stage."""
    return [
        f"{city.name}: nothing to compare: all drives are through stage"
        f" {', '.join(city.stages)}. A report compares drives through two"
        " stages of a city: add a drive through another stage to the folder."
        " The shipped drives of a city (cns-drake simulate), such as"
        " riverside_01 and riverside_02, go through different stages."
        " cns-drake import --years makes stages of a real city."
        " --exclude-recent compares a drive with itself."
        + (
            _GUESSED
            if any(one.is_guessed for one in city.stages.values())
            else ""
        )
        for city in cities
        if not city.change_pairs()
    ]


def drives_by_map(
    recordings: Iterable[RecordingInfo],
    on_note: Callable[[str], None] = lambda text: None,
    align: When = "auto",
) -> list[MapDrives]:
    """Groups recordings by map, and sorts the maps by name.

    The recordings of a map are then in one world, see `open_pair`.

    Args:
        recordings: the recordings.
        on_note: is called with notes on the world, and on each alignment.
        align: when they are aligned, see `open_pair`.

    Raises:
        InputError: if two recordings have the same name, or the same map and
            stage; or they cannot be aligned.
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
        _in_one_world(
            _drives_of_map(name, [r for r in recordings if r.map_name == name]),
            on_note,
            align,
        )
        for name in sorted({recording.map_name for recording in recordings})
    ]


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
