"""Draws the figures of a study's cities and changes, and names their files."""

from dataclasses import replace
from pathlib import Path

from cns_drake.base.files import make_folder
from cns_drake.base.jobs.running import Job
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import doing
from evaluation.change.drive_change import (
    ChangeReport,
    ChangeResult,
    spread_over_grids,
)
from evaluation.recognition.metrics import MODES
from evaluation.report import map_figures
from evaluation.report.camera_images import nearest_images
from evaluation.report.illustrations import Illustration
from evaluation.report.page_data import PageDrive, make_page_drive
from evaluation.results.figure_files import PIXELS
from evaluation.study.extraction_jobs import ExtractionJobs
from evaluation.study.features import DriveSummary
from evaluation.study.recordings.map_drives import MapDrives, Recordings
from evaluation.study.sources import DriveSource, RecordingSource
from evaluation.study.storage.parts import MakePart, Part
from evaluation.study.storage.study_files import StudyFiles, file_name
from evaluation.study.tasks.jobs import job_name

# Format of pictures on the page.
_PAGE_KIND = PIXELS[-1]
# Expected seconds to draw a city or a change.
_COST = 5.0


def draw_city(
    reporter: Reporter,
    map_name: str,
    stages: tuple[tuple[str, Part, Part, DriveSource], ...],
    stem: Path,
) -> dict[str, PageDrive]:
    """Draws the routes of a city's drives on its maps, and saves the figure.

    Args:
        reporter: reports progress.
        map_name: name of the map.
        stages: for each stage, its name, the file with its `DriveSummary`, the
            file with a cloud for pictures, and the source of the drive.
        stem: path of the figure without the ending.

    Returns:
        Drive -> what the page shows of it. If a drive is recorded, this
        includes the images of its camera.
    """
    names = []
    views = []
    routes = []
    drives = {}
    for done, (name, summary, fine, source) in enumerate(stages):
        doing("drawing the maps", done, len(stages), "drives")
        drive = summary.read()
        view = map_figures.top_view(fine.read(), drive.positions)
        names.append(name)
        views.append(view)
        routes.append(drive.positions)
        images = None
        if isinstance(source, RecordingSource):
            stamps_ns = drive.stamps_ns[drive.frames]
            images = nearest_images(source(), stamps_ns, reporter.note)
        drives[drive.name] = make_page_drive(
            drive.name, view, drive.X_WS, drive.frames, drive.thumbnails, images
        )
    doing("drawing the routes")
    make_folder(stem.parent)
    map_figures.draw_routes(map_name, names, views, routes, stem)
    return drives


def draw_change_with_spread(
    reporter: Reporter,
    map_name: str,
    stages: tuple[str, str],
    changes: tuple[Part, ...],
    drives: tuple[Part, Part],
    clouds: tuple[Part, Part],
    stems: tuple[Path, Path],
) -> ChangeResult:
    """Draws the change between two drives, and returns it with its spread.

    The spread over shifted grids is measured here, and not by the task
    `change`. A measurement of the spread takes sixteen times as long as a
    measurement of the change, and only drawn changes need a spread.

    Args:
        reporter: reports progress.
        map_name: name of the map.
        stages: the earlier and the later stage.
        changes: files with the results of the task `change`: of the earlier and
            the later drive, and, if there is one, of their control.
        drives: files with a `DriveSummary` of the earlier and of the later
            drive, both in one world frame.
        clouds: files with the clouds of the earlier and the later drive.
        stems: paths of the two figures, without ending. The first figure shows
            what changed, the second figure shows the sets of points from which
            TCR is computed.
    """
    doing("comparing the maps on other grids")
    report: ChangeReport
    report, *controls = (part.read() for part in changes)
    read: list[DriveSummary] = [part.read() for part in drives]
    earlier, later = (one.drive_map for one in read)
    spread = spread_over_grids(earlier, later, report.change)
    report = replace(report, spread=spread)
    for control in controls:
        report = report.beside(control)
    result = ChangeResult(map_name, stages, report)
    doing("drawing the change")
    make_folder(stems[0].parent)
    map_figures.draw_change(
        result,
        (clouds[0].read(), clouds[1].read()),
        (earlier.voxels.merged(), later.voxels.merged()),
        stems,
    )
    return result


def city_job(
    city: MapDrives, files: StudyFiles, planned: ExtractionJobs
) -> tuple[Part, Job]:
    """Returns the job that draws a city, and the file of its result.

    Args:
        city: the city.
        files: files of the study.
        planned: jobs to which a job for each drive of the figure is added; this
            job extracts the drive's features.
    """
    needs: list[str] = []
    features = [
        (one, planned.features(one.named, needs))
        for one in city.stages.values()
    ]
    stem = files.figures / routes_stem(city)
    part = files.part("pages", city.name)
    shown = tuple(
        (drive.stage, one.drive, one.fine, drive.source)
        for drive, one in features
    )
    step = MakePart(
        part, draw_city, (city.name, shown, stem), figure_files(stem)
    )
    return part, Job(f"draw {city.name}", step, tuple(needs), _COST)


def change_job(
    city: MapDrives,
    pair: Recordings,
    changes: tuple[Part, ...],
    files: StudyFiles,
    planned: ExtractionJobs,
) -> tuple[Part, Job]:
    """Returns the job that draws a change, and the file of its result.

    Args:
        city: the city.
        pair: recordings in the earlier and in the later stage of the city.
        changes: files with the change of the pair and, if there is a control,
            with the change of the control; see `ChangeTask`.
        files: files of the study.
        planned: jobs to which the jobs are added that extract the features of
            both drives.
    """
    needs = [job_name(one) for one in changes]
    features = [planned.features(one.named, needs) for one in pair]
    earlier, later = pair
    stems = tuple(files.figures / name for name in change_stems(city, pair))
    part = files.part("changes", earlier.name, later.name)
    step = MakePart(
        part,
        draw_change_with_spread,
        (
            city.name,
            (earlier.stage, later.stage),
            changes,
            (features[0].drive, features[1].drive),
            (features[0].fine, features[1].fine),
            stems,
        ),
        figure_files(*stems),
    )
    name = f"draw {city.name} {earlier.stage} > {later.stage}"
    return part, Job(name, step, tuple(needs), _COST)


def figure_files(*stems: Path) -> tuple[Path, ...]:
    """Returns the paths of all files of figures, given their stems."""
    return tuple(
        stem.with_name(f"{stem.name}.{kind}")
        for stem in stems
        for kind in PIXELS
    )


def routes_stem(city: MapDrives) -> str:
    """Returns the file name of the figure with a city's routes.

    The name has no ending.
    """
    return file_name(f"routes_{city.name}")


def change_stems(city: MapDrives, pair: Recordings) -> tuple[str, str]:
    """Returns the file names, without ending, of the two figures of a change.

    The first figure shows which points changed; the second figure shows the
    sets of points from which TCR is computed.

    Args:
        city: the city.
        pair: recordings in the earlier and in the later stage of the city.
    """
    # Underscores join the parts. They are escaped in all but the first, so that
    # two pairs of stages never share a name.
    earlier, later = (
        one.stage.replace("%", "%p").replace("_", "%u") for one in pair
    )
    change, sets = (
        file_name(f"{kind}_{city.name}_{earlier}_{later}")
        for kind in ("change", "sets")
    )
    return change, sets


def curves_stem(city: MapDrives) -> str:
    """Returns the file name of a city's figure of precision-recall curves.

    The name has no ending.
    """
    return file_name(f"pr_{city.name}")


def illustrations(
    city: MapDrives, folder: Path, *, with_curves: bool
) -> list[Illustration]:
    """Returns the figures of a city, in the order of the report.

    Args:
        city: the city.
        folder: folder of the figures.
        with_curves: whether precision-recall curves were drawn.
    """
    shown = [
        Illustration(
            folder / routes_stem(city),
            f"Routes in {city.name}, from red to blue",
            _PAGE_KIND,
            # The page shows each drive's map in a figure of its own.
            section="print",
        )
    ]
    for pair in city.change_pairs():
        first, last = (one.stage for one in pair)
        titles = (
            f"What changed in {city.name} between {first} and {last}",
            f"What TCR_sym counts in {city.name}: {first} beside {last},"
            f" {last} beside {first}, both together",
        )
        shown += [
            Illustration(
                folder / stem,
                title,
                _PAGE_KIND,
                section="change",
                num_panels=num_panels,
                legend=legend,
            )
            for stem, title, num_panels, legend in zip(
                change_stems(city, pair),
                titles,
                (2, 3),
                (map_figures.CHANGE_LEGEND, map_figures.SETS_LEGEND),
                strict=True,
            )
        ]
    if with_curves:
        shown.append(
            Illustration(
                folder / curves_stem(city),
                f"Precision over recall in {city.name}; numbers are AUC",
                "svg",
                num_panels=len(MODES),
            )
        )
    return shown
