"""The pictures of a map, as jobs: its drives, and how its streets change."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.running import Job, Tell
from cns_drake.base.map_folder import MapFolder
from cns_drake.base.version import __version__
from cns_drake.scenarios.provenance import digest_file, digest_inputs
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_loading import load_scenario
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

    def job(
        what: str,
        function: Callable[..., None],
        is_done: Callable[..., bool],
        num_stages: int,
    ) -> Job:
        path = pictures / f"{folder.name}_{what}.png"
        return Job(
            name=f"picture {folder.name} {what}",
            function=function,
            arguments=(folder, path),
            cost=_STAGE_COST * num_stages,
            output=path,
            is_done=is_done,
        )

    num_drives = len(MapFolder(folder).recordable_sequences())
    jobs = [job("drives", draw_map_drives, are_drives_drawn, num_drives)]
    if MapFolder(folder).views.is_file():
        jobs.append(job("stages", draw_map_stages, are_stages_drawn, 2))
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
    with uninterrupted():
        from cns_drake.pictures.aerial_pictures import draw_drives

    inputs = _drives_inputs(folder)
    scenarios = _scenarios(folder)
    draw_drives({s.name.replace("_", " "): s for s in scenarios}, path)
    _write_note(path, inputs)


def are_drives_drawn(folder: Path, path: Path) -> bool:
    """Tells whether there is nothing to do; see `draw_map_drives`."""
    return _is_drawn(path, _drives_inputs(folder))


def _drives_inputs(folder: Path) -> dict:
    return {
        s.name: [s.model_dump(mode="json"), digest_inputs(s)]
        for s in _scenarios(folder)
    }


def _scenarios(folder: Path) -> list[Scenario]:
    return [
        load_scenario(file) for file in MapFolder(folder).recordable_sequences()
    ]


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
    with uninterrupted():
        from cns_drake.pictures.stage_pictures import draw_stages, load_views

    inputs = _stages_inputs(folder)
    stages = {f.stem.replace("_", " "): f for f in _two_stages(folder)}
    draw_stages(stages, load_views(MapFolder(folder).views)["street"], path)
    _write_note(path, inputs)


def are_stages_drawn(folder: Path, path: Path) -> bool:
    """Tells whether there is nothing to do; see `draw_map_stages`."""
    return _is_drawn(path, _stages_inputs(folder))


def _stages_inputs(folder: Path) -> dict:
    files = [*_two_stages(folder), MapFolder(folder).views]
    return {file.name: digest_file(file) for file in files}


def _two_stages(folder: Path) -> tuple[Path, Path]:
    files = list(MapFolder(folder).stages().values())
    return files[0], files[-1]


def _write_note(path: Path, inputs: dict) -> None:
    """Says what a picture was drawn of."""
    write_part(_note_of(path), _versioned(inputs), None)


def _is_drawn(path: Path, inputs: dict) -> bool:
    return path.is_file() and is_current(_note_of(path), _versioned(inputs))


def _note_of(path: Path) -> Path:
    """Returns the part that says what a picture was drawn of."""
    return path.parent / "parts" / f"{path.stem}.data"


def _versioned(inputs: dict) -> dict:
    return {**inputs, "version": __version__}
