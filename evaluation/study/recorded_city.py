"""A city of recordings in a study: its pairs, and what the page shows of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from evaluation.base import Job, MakePart, Part, Reporter, doing, make_folder
from evaluation.drives import DriveSource, RecordingSource
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    DescribedSource,
    FeatureExtraction,
    FeatureFiles,
    Further,
    MethodChoice,
    PlaceOutcome,
    RetrievalProtocol,
    Role,
    described_key,
)
from evaluation.results import (
    OWN,
    STAGE,
    ChangePicture,
    DrivenMap,
    PageDrive,
    make_page_drive,
    nearest_images,
)
from evaluation.study.recordings.map_drives import MapDrives
from evaluation.study.study import Study
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.jobs import STARTING_COST, Jobs
from evaluation.study.tasks.pair import NamedDrive, Pair, Result
from evaluation.study.tasks.place import PlaceTask

# Expected seconds to draw a city or a change.
_COST = 5.0


@dataclass(frozen=True)
class ShownCity:
    """What the page shows of a city, once the jobs of the study are done.

    Attributes:
        city: the recordings.
        drives: file with name -> `PageDrive` of the compared drives.
        changes: pictures of what changed between stages.
        places: for each pair whose queries the page shows, the files with the
            outcomes of all methods.
    """

    city: MapDrives
    drives: Part
    changes: tuple[ChangePicture, ...]
    places: tuple[tuple[Result, ...], ...]

    def outcomes(self) -> list[list[PlaceOutcome]]:
        """Returns the methods' outcomes on each pair with a match.

        The outcomes are without geometric verification.
        """
        found = []
        for parts in self.places:
            of_pair = [
                one
                for part in parts
                for one in part.read()
                if not one.protocol.verified and one.outcomes.has_match.any()
            ]
            if of_pair:
                found.append(of_pair)
        return found


def add_city(
    study: Study,
    city: MapDrives,
    pairs: Sequence[Pair],
    distractors: Sequence[NamedDrive] = (),
) -> ShownCity | None:
    """Adds the pairs of a city to a study, and jobs that draw it for the page.

    Args:
        study: the study.
        city: the recordings.
        pairs: pairs of these recordings in all conditions; the first has the
            main protocol.
        distractors: drives through other cities, see `Study.add`.

    Returns:
        What the page shows; None if the study does not measure the change, and
        therefore makes no maps.
    """
    with_map = ChangeTask.name in study.tasks
    planned = study.add(
        pairs, distractors, _ExtractionJobs if with_map else Jobs
    )
    if not (isinstance(planned, _ExtractionJobs) and pairs):
        return None
    shown = ShownCity(
        city,
        _draw_drives(city, pairs, planned, study.pictures),
        tuple(_draw_changes(city, pairs, planned, study)),
        tuple(
            study.results[one][PlaceTask.name]
            for one in pairs
            if PlaceTask.name in study.results[one]
            and not one.is_composed
            and one.factors.get(STAGE, OWN) == OWN
            and one.protocol == pairs[0].protocol
        ),
    )
    study.jobs |= planned.jobs
    return shown


# Expected time to map a drive of usual length [s].
_MAP_COST = 19.0


@dataclass
class _ExtractionJobs(Jobs):
    """Jobs of a study with maps, which read each drive once.

    One job extracts the features of a drive: it maps the drive, describes its
    places and its queries by all methods, and keeps their scans. If pairs use
    several protocols, the first protocol is the main one. The job also serves a
    further protocol that chooses the same scans and changes only how queries
    are seen; see `RetrievalProtocol.with_queries_of`. For any other protocol,
    the drive is read again.
    """

    # Drive -> its roles. They are known before the first job is added.
    _roles: dict[str, set[Role]] = field(default_factory=dict)
    # Drive -> key of descriptors -> the descriptors by a further protocol.
    _further: dict[str, dict[str, Further]] = field(
        default_factory=lambda: defaultdict(dict)
    )
    _protocol: RetrievalProtocol | None = None

    def expect(self, pair: Pair) -> None:
        super().expect(pair)
        if self._protocol is None:
            self._protocol = pair.protocol
        beside: list[tuple[NamedDrive, Role]]
        beside = [(drive, "places") for drive in pair.beside]
        if not self._chooses_same_scans(pair.protocol):
            return
        for drive, role in (*pair.roles, *beside):
            self._roles.setdefault(drive.name, set()).add(role)
            for choice in self.methods:
                if not pair.has_method(choice.name):
                    continue
                key = self._key(choice, role, pair.protocol)
                if key != choice.key:
                    further = self._further[drive.name]
                    _, roles, _ = further.get(key, (None, frozenset(), None))
                    further[key] = choice, roles | {role}, pair.protocol

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        if not self._chooses_same_scans(protocol):
            return super().described(drive, role, protocol, needs, kept=kept)
        files = self.features(drive, needs)
        keys = [self._key(one, role, protocol) for one in self.methods]
        return (files.scans, *map(files.described, keys))

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        if spacing is not None:
            return super().mapped(drive, spacing, needs)
        return self.features(drive, needs).drive

    def features(self, drive: NamedDrive, needs: list[str]) -> FeatureFiles:
        """Returns the files of a drive's features.

        The job that makes these files is added.

        Args:
            drive: the drive.
            needs: list to which the name of the job is appended.
        """
        name = f"features of {drive.name}"
        needs.append(name)
        files = self.files.features(drive.name)
        if name not in self.jobs:
            roles = frozenset(self._roles.get(drive.name, ()))
            protocol = self._protocol or RANDOM_YAW_PROTOCOL
            step = FeatureExtraction(
                drive.source,
                roles,
                self.methods,
                protocol,
                files,
                with_scans=bool(roles),
                further=tuple(self._further[drive.name].values()),
            )
            # All scans are read for the map.
            cost = STARTING_COST + _MAP_COST * drive.share
            for role in roles:
                cost += self.description_cost(drive, role, protocol)
            title = drive.title or drive.name
            self.jobs[name] = Job(name, step, drive.needs, cost, title)
        return files

    def _chooses_same_scans(self, protocol: RetrievalProtocol) -> bool:
        """Returns whether a protocol needs no other scans than the main one."""
        assert self._protocol is not None
        protocol = protocol.with_queries_of(self._protocol)
        return (
            protocol.descriptor_options() == self._protocol.descriptor_options()
        )

    def _key(
        self, choice: MethodChoice, role: Role, protocol: RetrievalProtocol
    ) -> str:
        """Returns the key of a method's descriptors of places or queries."""
        assert self._protocol is not None
        method = choice.make()
        own, main = (
            one.of(method).descriptor_options(queries=role == "queries")
            for one in (protocol, self._protocol)
        )
        return (
            choice.key if own == main else described_key(choice.key, protocol)
        )


def _draw_drives(
    city: MapDrives,
    pairs: Sequence[Pair],
    planned: _ExtractionJobs,
    pictures: dict[str, Job],
) -> Part:
    """Adds the job that makes pictures of drives; returns its file."""
    compared = {name for one in pairs for name in one.names}
    shown = [one.named for one in city.recordings if one.name in compared]
    features = [planned.features(one, []) for one in shown]
    part = planned.files.part("pages", city.name)
    step = MakePart(
        part,
        make_page_drives,
        (
            tuple(
                (found.drive, found.fine, one.source)
                for one, found in zip(shown, features, strict=True)
            ),
        ),
    )
    name = f"draw {city.name}"
    pictures[name] = Job(name, step, (), _COST)
    return part


def _draw_changes(
    city: MapDrives,
    pairs: Sequence[Pair],
    planned: _ExtractionJobs,
    study: Study,
) -> list[ChangePicture]:
    """Adds jobs that draw changes between stages; returns the pictures."""
    found = []
    for earlier, later in city.change_pairs():
        parts = [
            part
            for one in pairs
            if one.names == (earlier.name, later.name)
            and one.factors.get(STAGE, OWN) == OWN
            for part in study.results[one].get(ChangeTask.name, ())
            if isinstance(part, Part)
        ]
        if not parts:
            continue
        stages = earlier.stage, later.stage
        picture = ChangePicture(city.name, stages, planned.files.figures)
        first, last = (
            planned.features(one.named, []) for one in (earlier, later)
        )
        step = MakePart(
            planned.files.change(picture.stem.name),
            draw_change,
            (
                city.name,
                stages,
                picture.folder,
                parts[0],
                (first.drive, last.drive),
                (first.fine, last.fine),
            ),
            figures=picture.files,
        )
        name = f"draw {city.name} {stages[0]} > {stages[1]}"
        study.pictures[name] = Job(name, step, (), _COST)
        found.append(picture)
    return found


def make_page_drives(
    reporter: Reporter, drives: tuple[tuple[Part, Part, DriveSource], ...]
) -> dict[str, PageDrive]:
    """Returns what the page shows of each drive, by the drive's name.

    Args:
        reporter: reports progress.
        drives: for each drive, the file with its `DriveSummary`, the file with
            a cloud for pictures, and its source. If a drive is recorded, the
            result includes the images of its camera.
    """
    found = {}
    for done, (summary, fine, source) in enumerate(drives):
        doing("drawing the maps", done, len(drives), "drives")
        drive = summary.read()
        images = None
        if isinstance(source, RecordingSource):
            stamps_ns = drive.stamps_ns[drive.frames]
            images = nearest_images(source(), stamps_ns, reporter.note)
        found[drive.name] = make_page_drive(
            drive.name,
            fine.read(),
            drive.X_WS,
            drive.frames,
            drive.thumbnails,
            images,
        )
    return found


def draw_change(
    reporter: Reporter,
    map_name: str,
    stages: tuple[str, str],
    folder: Path,
    change: Part,
    drives: tuple[Part, Part],
    clouds: tuple[Part, Part],
) -> float:
    """Draws the change between two drives, and returns TCR_sym.

    Args:
        reporter: unused.
        map_name, stages, folder: see `ChangePicture`.
        change: file with the result of the task `change`.
        drives: files with a `DriveSummary` of the earlier and of the later
            drive, both in one world frame.
        clouds: files with the clouds of the earlier and the later drive.
    """
    doing("drawing the change")
    make_folder(folder)
    earlier, later = (
        DrivenMap(cloud.read(), drive.coarse.merged(), drive.X_WS[:, :3, 3])
        for drive, cloud in zip(
            (part.read() for part in drives), clouds, strict=True
        )
    )
    ChangePicture(map_name, stages, folder).draw(earlier, later)
    return float(change.read().change.symmetric)
