"""The pictures of a map, as jobs: its drives, and how its streets change."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cns_drake import __version__
from cns_drake.paths import sequences_of_map
from cns_drake.provenance import digest_file, digest_inputs
from cns_drake.scenario import load_scenario
from evaluation.interrupts import uninterrupted
from evaluation.jobs import Job, Tell
from evaluation.study.parts import is_current, write_part

# Expected time to draw a stage [s].
_STAGE_COST = 10.0


def plan_pictures(folder: Path, pictures: Path) -> list[Job]:
    """Returns the jobs that draw a map.

    Args:
        folder: of the map.
        pictures: folder to write: `<map>_drives.png`, the drives from above;
            `<map>_stages.png`, a street in the first and the last stage, if
            the map has a `views.yaml`.
    """
    # Workers may run elsewhere.
    folder, pictures = folder.resolve(), pictures.absolute()

    def job(what: str, function: Callable[..., None], num_stages: int) -> Job:
        path = pictures / f"{folder.name}_{what}.png"
        return Job(
            name=f"picture {folder.name} {what}",
            function=function,
            arguments=(folder, path),
            cost=_STAGE_COST * num_stages,
            output=path,
        )

    jobs = [job("drives", draw_map_drives, len(sequences_of_map(folder)))]
    if (folder / "views.yaml").is_file():
        jobs.append(job("stages", draw_map_stages, 2))
    return jobs


def draw_map_drives(folder: Path, path: Path, tell: Tell) -> None:
    """Draws the drives of a map from above: a job.

    Args:
        folder: of the map.
        path: the picture.
        tell: is told nothing.

    Raises:
        InputError: see `draw_drives`.
    """
    del tell
    scenarios = [load_scenario(file) for file in sequences_of_map(folder)]

    def draw() -> None:
        with uninterrupted():
            from cns_drake.aerial_pictures import draw_drives

        draw_drives({s.name.replace("_", " "): s for s in scenarios}, path)

    inputs = {
        s.name: [s.model_dump(mode="json"), digest_inputs(s)] for s in scenarios
    }
    _draw_once(path, inputs, draw)


def draw_map_stages(folder: Path, path: Path, tell: Tell) -> None:
    """Draws a street of a map in its first and its last stage: a job.

    Args:
        folder: of the map.
        path: the picture.
        tell: is told nothing.

    Raises:
        InputError: see `draw_stages`.
    """
    del tell
    views = folder / "views.yaml"
    files = sorted(folder.glob("stage_*.sdf"))
    stages = {
        file.stem.replace("_", " "): file for file in (files[0], files[-1])
    }

    def draw() -> None:
        with uninterrupted():
            from cns_drake.stage_pictures import draw_stages, load_views

        draw_stages(stages, load_views(views)["street"], path)

    inputs = {title: digest_file(file) for title, file in stages.items()}
    _draw_once(path, {**inputs, "views": digest_file(views)}, draw)


def _draw_once(path: Path, inputs: dict, draw: Callable[[], None]) -> None:
    """Draws a picture, unless one of these inputs is there."""
    drawn = path.parent / "parts" / f"{path.stem}.data"
    inputs = {**inputs, "version": __version__}
    if path.is_file() and is_current(drawn, inputs):
        return
    draw()
    write_part(drawn, inputs, None)
