"""What the page of a study shows of recorded cities, and how it is drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from evaluation.base import (
    Job,
    MakePart,
    Part,
    Reporter,
    doing,
    file_name,
    make_folder,
    run_jobs,
    user_errors,
)
from evaluation.drives import DriveSource, RecordingSource
from evaluation.recognition import Asked, Map, Picture, PlaceOutcome, asked_key
from evaluation.results import (
    OWN,
    STAGE,
    ChangePicture,
    DrivenMap,
    PageDrive,
    make_page_drive,
    nearest_images,
)
from evaluation.study.pair import Pair, StudyDrive
from evaluation.study.recordings.map_drives import MapDrives
from evaluation.study.run import DriveAsked
from evaluation.study.study import Study
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.place import PlaceTask


@dataclass(frozen=True)
class RecordedCity:
    """A city of recordings in a study.

    Attributes:
        city: the recordings.
        pairs: pairs of these recordings in all conditions; the first has the
            main protocol.
    """

    city: MapDrives
    pairs: tuple[Pair, ...]

    def shown(self) -> Iterator[DriveAsked]:
        """Yields what the page needs of the drives that are compared."""
        compared = {name for one in self.pairs for name in one.names}
        for one in self.city.recordings:
            if one.name in compared:
                yield one.drive, Map()
                yield one.drive, self._picture(one.drive)

    def outcomes(self, study: Study) -> list[list[PlaceOutcome]]:
        """Returns the methods' outcomes on each pair with a match.

        The outcomes are without geometric verification.
        """
        task = study.tasks[PlaceTask.name]
        found = []
        for pair in self.pairs:
            if (
                pair.is_composed
                or pair.factors.get(STAGE, OWN) != OWN
                or pair.protocol != self.pairs[0].protocol
            ):
                continue
            of_pair = [
                one
                for one in task.found(pair, study.store)
                if not one.protocol.verified and one.outcomes.has_match.any()
            ]
            if of_pair:
                found.append(of_pair)
        return found

    def changes(self, study: Study) -> Iterator[tuple[ChangePicture, MakePart]]:
        """Yields each picture of what changed, and the step that draws it."""
        task, store = study.tasks[ChangeTask.name], study.store
        for earlier, later in self.city.change_pairs():
            pair = next(
                (
                    one
                    for one in self.pairs
                    if one.names == (earlier.name, later.name)
                    and one.factors.get(STAGE, OWN) == OWN
                    and task.keys(one)
                ),
                None,
            )
            if pair is None:
                continue
            stages = earlier.stage, later.stage
            picture = ChangePicture(self.city.name, stages, study.figures)
            (key,) = task.keys(pair)
            maps, clouds = (
                tuple(
                    _part(study, one.drive, asked(one.drive))
                    for one in (earlier, later)
                )
                for asked in (lambda _: Map(), self._picture)
            )
            step = MakePart(
                _witness(study, picture.stem.name),
                draw_change,
                (
                    self.city.name,
                    stages,
                    picture.folder,
                    store.part(key),
                    maps,
                    clouds,
                ),
                figures=picture.files,
            )
            yield picture, step

    def page_drives(self, study: Study) -> MakePart:
        """Returns the step that makes name -> `PageDrive` of the drives."""
        drives = {drive.digest: drive for drive, _ in self.shown()}
        part = Part(
            study.store.folder / "pages" / f"{file_name(self.city.name)}.data"
        )
        arguments = tuple(
            (
                _part(study, one, Map()),
                _part(study, one, self._picture(one)),
                one.source,
            )
            for one in drives.values()
        )
        return MakePart(part, make_page_drives, (arguments,))

    def _picture(self, drive: StudyDrive) -> Picture:
        """Returns what to ask for, of the scans by the main protocol."""
        main = self.pairs[0].protocol
        spacings: dict[float, None] = {}
        for one in self.pairs:
            protocol = one.protocol.with_queries_of(main)
            if protocol.descriptor_options() != main.descriptor_options():
                continue
            if drive in one.database:
                spacings[main.place_spacing] = None
            if drive == one.query:
                spacings[main.query_spacing] = None
        return Picture(tuple(spacings), main.half_extent)


@dataclass(frozen=True)
class ShownCity:
    """A city as the page shows it.

    Attributes:
        city: the recordings.
        drives: name -> what the page shows of each drive that is compared.
        changes: pictures of what changed between stages.
        outcomes: see `RecordedCity.outcomes`.
    """

    city: MapDrives
    drives: dict[str, PageDrive]
    changes: tuple[ChangePicture, ...]
    outcomes: list[list[PlaceOutcome]]


def draw_cities(
    study: Study, cities: Sequence[RecordedCity]
) -> list[ShownCity]:
    """Draws cities for the page, once the tables are written.

    A picture that cannot be drawn takes no number along. Pictures of an earlier
    run, of drives that are no longer there, are removed.

    Raises:
        InputError: a picture cannot be drawn, or a file not be removed.
    """
    changes = [tuple(one.changes(study)) for one in cities]
    pages = [one.page_drives(study) for one in cities]
    jobs = [
        Job(f"drawing {one.city.name}", page)
        for one, page in zip(cities, pages, strict=True)
    ]
    jobs += [
        Job(f"drawing {picture.title}", step)
        for some in changes
        for picture, step in some
    ]
    run_jobs(jobs, study.cluster, "pictures")
    kept = {path for some in changes for one, _ in some for path in one.files}
    for path in sorted({*study.figures.glob("change_*.*")} - kept):
        # Its witness says that this program drew it.
        if _witness(study, path.stem).path.is_file():
            with user_errors(path):
                path.unlink()
    return [
        ShownCity(
            one.city,
            page.part.read(),
            tuple(picture for picture, _ in some),
            one.outcomes(study),
        )
        for one, page, some in zip(cities, pages, changes, strict=True)
    ]


def _part(study: Study, drive: StudyDrive, asked: Asked) -> Part:
    return study.store.part(asked_key(drive.digest, asked))


def _witness(study: Study, stem: str) -> Part:
    """Returns the file that names the inputs of a picture of a change."""
    return Part(study.store.folder / "changes" / f"{stem}.data")


def make_page_drives(
    reporter: Reporter, drives: tuple[tuple[Part, Part, DriveSource], ...]
) -> dict[str, PageDrive]:
    """Returns what the page shows of each drive, by the drive's name.

    Args:
        reporter: reports progress.
        drives: for each drive, the files with its `DriveMapping` and its
            `DrivePicture`, and its source. If a drive is recorded, the result
            includes the images of its camera.
    """
    found = {}
    for done, (mapped, pictured, source) in enumerate(drives):
        doing("drawing the maps", done, len(drives), "drives")
        drive, picture = mapped.read(), pictured.read()
        images = None
        if isinstance(source, RecordingSource):
            stamps_ns = drive.stamps_ns[picture.frames]
            images = nearest_images(source(), stamps_ns, reporter.note)
        found[drive.name] = make_page_drive(
            drive.name,
            picture.fine,
            drive.X_WS,
            picture.frames,
            picture.thumbnails,
            images,
        )
    return found


def draw_change(
    reporter: Reporter,
    map_name: str,
    stages: tuple[str, str],
    folder: Path,
    change: Part,
    maps: tuple[Part, Part],
    pictures: tuple[Part, Part],
) -> float:
    """Draws the change between two drives, and returns TCR_sym.

    Args:
        reporter: unused.
        map_name, stages, folder: see `ChangePicture`.
        change: file with the result of the task `change`.
        maps, pictures: files with the `DriveMapping` and the `DrivePicture` of
            the earlier and of the later drive, both in one world frame.
    """
    doing("drawing the change")
    make_folder(folder)
    earlier, later = (
        DrivenMap(
            picture.read().fine, drive.voxels.merged(), drive.X_WS[:, :3, 3]
        )
        for drive, picture in zip(
            (part.read() for part in maps), pictures, strict=True
        )
    )
    ChangePicture(map_name, stages, folder).draw(earlier, later)
    return float(change.read().change.symmetric)
