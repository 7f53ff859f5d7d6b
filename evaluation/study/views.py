"""Pictures of maps: routes of a city, changes between two stages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cns_drake.base.files import make_folder
from cns_drake.base.jobs.running import Tell
from evaluation.report.drawing import PRINTED
from evaluation.report.figures import (
    SeenRoute,
    Stage,
    draw_change,
    draw_routes,
    top_view,
)
from evaluation.report.page_data import make_drive
from evaluation.study.code_digest import all_code
from evaluation.study.measurements import is_measured, measure_change
from evaluation.study.parts import (
    is_current,
    part_digest,
    read_part,
    write_part,
)
from evaluation.study.study_layout import SurveyFiles

# Of a figure that consists of pixels, on the page.
PAGE_KIND = "webp"


def draw_city(
    map_name: str,
    stages: tuple[tuple[str, SurveyFiles], ...],
    stem: Path,
    drawn: Path,
    pages: Path,
    tell: Tell,
) -> None:
    """Draws the routes of a city; writes its drives for the page: a job.

    Args:
        map_name: of the city.
        stages: name of each, and the survey of its drive.
        stem: of the figure, without ending.
        drawn: part that says what the figure was drawn of.
        pages: part for the drives, name -> `PageDrive`.
        tell: is told how far it is.

    Raises:
        InputError: if a file cannot be read or written.
    """
    inputs = _inputs(map_name, [survey for _, survey in stages])
    routes, drives = [], {}
    for done, (name, survey) in enumerate(stages):
        tell.progress(done, len(stages) + 1)
        drive = read_part(survey.drive)
        view = top_view(read_part(survey.fine), drive.positions)
        routes.append(SeenRoute(name, view, drive.positions))
        drives[drive.name] = make_drive(
            drive.name, view, drive.X_WS, drive.frames, drive.thumbnails
        )
    write_part(pages, inputs, drives)
    tell.progress(len(stages), len(stages) + 1)
    make_folder(stem.parent)
    draw_routes(map_name, routes, stem)
    write_part(drawn, inputs, None)


def is_city_drawn(
    map_name: str,
    stages: tuple[tuple[str, SurveyFiles], ...],
    stem: Path,
    drawn: Path,
    pages: Path,
) -> bool:
    """Tells whether there is nothing to do; see `draw_city`."""
    inputs = _inputs(map_name, [survey for _, survey in stages])
    return is_current(pages, inputs) and _is_drawn([stem], drawn, inputs)


def measure_and_draw(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, ...],
    result: Path,
    stems: tuple[Path, Path],
    drawn: Path,
    tell: Tell,
) -> None:
    """Measures the change between two drives and draws it: a job.

    See `measure_change` and `draw_pair` for arguments and errors.
    """
    del tell
    measure_change(map_name, stages, surveys, result)
    draw_pair((surveys[0], surveys[1]), result, stems, drawn)


def is_measured_and_drawn(
    map_name: str,
    stages: tuple[str, str],
    surveys: tuple[SurveyFiles, ...],
    result: Path,
    stems: tuple[Path, Path],
    drawn: Path,
) -> bool:
    """Tells whether there is nothing to do; see `measure_and_draw`."""
    if not is_measured(map_name, stages, surveys, result):
        return False
    return _is_drawn(stems, drawn, _inputs(part_digest(result), surveys[:2]))


def draw_pair(
    surveys: tuple[SurveyFiles, SurveyFiles],
    change: Path,
    stems: tuple[Path, Path],
    drawn: Path,
) -> None:
    """Draws what changed between two stages, and the sets of the TCR.

    Args:
        surveys: of the earlier drive, and of the later one.
        change: part with their `ChangeResult`.
        stems: of the two figures, without endings.
        drawn: part that says what they were drawn of.

    Raises:
        InputError: if a file cannot be read or written.
    """
    inputs = _inputs(part_digest(change), surveys)
    if _is_drawn(stems, drawn, inputs):
        return
    result = read_part(change)
    earlier, later = (
        _stage(name, survey)
        for name, survey in zip(result.stages, surveys, strict=True)
    )
    make_folder(stems[0].parent)
    draw_change(result.map_name, earlier, later, result.report.change, stems)
    write_part(drawn, inputs, None)


def _stage(name: str, survey: SurveyFiles) -> Stage:
    drive = read_part(survey.drive)
    return Stage(name, read_part(survey.fine), drive.coarse, drive.positions)


def _inputs(what: str, surveys: Sequence[SurveyFiles]) -> dict:
    return {
        "what": what,
        "drives": [part_digest(survey.drive) for survey in surveys],
        "maps": [part_digest(survey.fine) for survey in surveys],
        "code": all_code(),
    }


def _is_drawn(stems: Sequence[Path], drawn: Path, inputs: dict) -> bool:
    return is_current(drawn, inputs) and all(
        stem.with_name(f"{stem.name}.{kind}").is_file()
        for stem in stems
        for kind in (*PRINTED, PAGE_KIND)
    )
