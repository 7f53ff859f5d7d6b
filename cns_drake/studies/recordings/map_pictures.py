"""Draws pictures of a map: its drives, and how its streets change."""

from dataclasses import dataclass
from pathlib import Path

from cns_drake.base import Job, Reporter
from cns_drake.pictures import draw_drives, draw_stages, load_views
from cns_drake.scenarios import (
    Scenario,
    digest_file,
    digest_inputs,
    load_scenario,
)
from cns_drake.scene import MapFolder
from evaluation.study import MakePart, Part

# Expected time to draw a stage [s].
_STAGE_COST = 10.0


@dataclass(frozen=True)
class _ReadFile:
    """Input of a job: the content of a file and of all files it refers to."""

    path: Path

    def identity(self) -> list[str]:
        return [self.path.name, digest_file(self.path)]


@dataclass(frozen=True)
class _PictureInput:
    """Input of a job: a scenario and the content of its files."""

    scenario: Scenario

    def identity(self) -> list[object]:
        values = self.scenario.model_dump(mode="json")
        return [values, digest_inputs(self.scenario)]


def plan_pictures(folder: Path, pictures: Path) -> list[Job]:
    """Returns the jobs that draw pictures of a map.

    Args:
        folder: folder of the map.
        pictures: folder to which the jobs write `<map>_drives.png`, the drives
            from above, and, if the map has a `views.yaml`, `<map>_stages.png`,
            a street in the first and the last stage.
    """
    # Workers may run elsewhere.
    source = MapFolder(folder.resolve())
    pictures = pictures.absolute()
    drives = tuple(
        _PictureInput(load_scenario(file))
        for file in source.recordable_drives()
    )
    drawn: dict[str, tuple] = {"drives": (picture_drives, drives)}
    if source.views.is_file():
        stages = list(source.stages().values())
        read = tuple(map(_ReadFile, (source.views, stages[0], stages[-1])))
        drawn["stages"] = (picture_stages, read)
    jobs = []
    for what, (draw, shown) in drawn.items():
        name = f"{source.name}_{what}"
        picture = pictures / f"{name}.png"
        jobs.append(
            Job(
                name=f"picture {source.name} {what}",
                step=MakePart(
                    Part(pictures / "parts" / f"{name}.data"),
                    draw,
                    (shown, picture),
                    (picture,),
                ),
                cost=_STAGE_COST * len(shown),
            )
        )
    return jobs


def picture_drives(
    reporter: Reporter, drives: tuple[_PictureInput, ...], picture: Path
) -> None:
    """Draws the drives of a map from above, and writes the image file."""
    scenarios = [one.scenario for one in drives]
    draw_drives({s.name.replace("_", " "): s for s in scenarios}, picture)


def picture_stages(
    reporter: Reporter, read: tuple[_ReadFile, ...], picture: Path
) -> None:
    """Draws a street of a map in its first and its last stage."""
    views, *stages = (one.path for one in read)
    draw_stages(
        {stage.stem.replace("_", " "): stage for stage in stages},
        load_views(views)["street"],
        picture,
    )
