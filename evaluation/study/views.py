"""Pictures of maps: routes of a city, changes between two stages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.files import make_folder
from cns_drake.base.jobs.step import Reporter
from evaluation.report.drawing import PIXELS
from evaluation.report.figures import (
    SeenRoute,
    Stage,
    draw_change,
    draw_routes,
    top_view,
)
from evaluation.report.page_data import PageDrive, make_drive
from evaluation.study.parts import PartStep, part_digest, read_part
from evaluation.study.study_layout import SurveyFiles

# Format of pictures on the page.
PAGE_KIND = PIXELS[-1]


@dataclass(frozen=True)
class DrawCity(PartStep):
    """Draws the routes of a city; writes its drives for the page.

    Attributes:
        map_name: of the city.
        stages: name of each, and the survey of its drive.
        stem: of the figure, without ending.
        part: to write, name -> `PageDrive`.
    """

    map_name: str
    stages: tuple[tuple[str, SurveyFiles], ...]
    stem: Path
    part: Path

    @property
    def figures(self) -> tuple[Path, ...]:
        return _files_of(self.stem)

    def inputs(self) -> dict[str, object]:
        surveys = [survey for _, survey in self.stages]
        names = [name for name, _ in self.stages]
        return {
            "map": self.map_name,
            "stages": names,
            "surveys": _digests(surveys),
        }

    def make(self, reporter: Reporter) -> dict[str, PageDrive]:
        routes, drives = [], {}
        for done, (name, survey) in enumerate(self.stages):
            reporter.progress(done, len(self.stages) + 1)
            drive = read_part(survey.drive)
            view = top_view(read_part(survey.fine), drive.positions)
            routes.append(SeenRoute(name, view, drive.positions))
            drives[drive.name] = make_drive(
                drive.name, view, drive.X_WS, drive.frames, drive.thumbnails
            )
        reporter.progress(len(self.stages), len(self.stages) + 1)
        make_folder(self.stem.parent)
        draw_routes(self.map_name, routes, self.stem)
        return drives


@dataclass(frozen=True)
class DrawChange(PartStep):
    """Draws what changed between two stages, and the sets of the TCR.

    Attributes:
        surveys: of the earlier drive, and of the later one.
        change: part with their `ChangeResult`.
        stems: of the two figures, without endings.
        part: names their inputs.
    """

    surveys: tuple[SurveyFiles, SurveyFiles]
    change: Path
    stems: tuple[Path, Path]
    part: Path

    @property
    def figures(self) -> tuple[Path, ...]:
        return _files_of(*self.stems)

    def inputs(self) -> dict[str, object]:
        return {
            "change": part_digest(self.change),
            "surveys": _digests(self.surveys),
        }

    def make(self, reporter: Reporter) -> None:
        result = read_part(self.change)
        earlier, later = (
            _stage(name, survey)
            for name, survey in zip(result.stages, self.surveys, strict=True)
        )
        make_folder(self.stems[0].parent)
        draw_change(
            result.map_name, earlier, later, result.report.change, self.stems
        )


def _stage(name: str, survey: SurveyFiles) -> Stage:
    drive = read_part(survey.drive)
    return Stage(name, read_part(survey.fine), drive.coarse, drive.positions)


def _digests(surveys: Iterable[SurveyFiles]) -> list[list[str]]:
    return [[part_digest(s.drive), part_digest(s.fine)] for s in surveys]


def _files_of(*stems: Path) -> tuple[Path, ...]:
    return tuple(
        stem.with_name(f"{stem.name}.{kind}")
        for stem in stems
        for kind in PIXELS
    )
