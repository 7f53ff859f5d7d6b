"""Places elsewhere: drives through other cities, for a crowded database."""

from collections.abc import Callable, Iterator
import itertools
from pathlib import Path

import numpy as np

from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.studies.redrawing import redraw_cities
from evaluation.drives.sampling import sample_frames

# A search for places elsewhere is noted after each so many drives.
_NOTED_DRIVES = 20
# Name of the only stage of a redrawn city.
_STAGE = "01"


def distracting_drives(
    query: Scenario,
    number: int,
    spacing: float,
    output: Path,
    cluster: Cluster,
    on_note: Callable[[str], None] = lambda text: None,
) -> list[Scenario]:
    """Returns drives through other cities that distract a method.

    They have about the wanted number of places. These are the shipped drives of
    other maps, each through its own stage; then those of this map, along the
    same streets between other buildings, if it is shipped; then the drives of
    other maps through the other stages; then through those cities drawn anew.

    Args:
        query: the drive whose LiDARs measure all of them, and whose city is
            left out.
        number: number of places, about.
        spacing: distance between two places [m].
        output: folder for cities that are drawn anew.
        cluster: runs the jobs.
        on_note: takes what a user should know.

    Raises:
        InputError: a shipped map cannot be used.
    """
    drives: list[Scenario] = []
    found = 0
    if number:
        on_note(f"{query.name}: looking for {number} places elsewhere")
    for drive in _drives(query, output, cluster):
        if found >= number:
            break
        drive = drive.replaced(lidars=query.lidars)
        drives.append(drive)
        found += _num_places(drive, spacing)
        if len(drives) % _NOTED_DRIVES == 0:
            on_note(f"{query.name}: found {found} places elsewhere")
    return drives


def _num_places(scenario: Scenario, spacing: float) -> int:
    trajectory = plan_drive(scenario)
    frames = count_frames(scenario, trajectory)
    _, p_WB = trajectory.poses(scenario.frame_period * np.arange(frames))
    return len(sample_frames(p_WB, spacing))


def _drives(
    query: Scenario, output: Path, cluster: Cluster
) -> Iterator[Scenario]:
    """Yields an endless series of drives."""
    maps = {name: MapFolder(path) for name, path in shipped_maps().items()}
    drives = {
        name: [load_scenario(path) for path in folder.recordable_drives()]
        for name, folder in maps.items()
    }
    own = Path(str(query.map)).name
    others = [name for name in maps if name != own]

    def redrawn(name: str, seed: int) -> Iterator[Scenario]:
        cities = redraw_cities(maps[name].path, _STAGE, [seed], output, cluster)
        for one in drives[name]:
            yield _elsewhere(one, str(cities[seed]), _STAGE, f"c{seed}")

    for name in others:
        yield from drives[name]
    if own in maps:
        yield from redrawn(own, 1)
    for name in others:
        for stage in maps[name].stages():
            yield from (
                _elsewhere(one, one.map, stage, stage)
                for one in drives[name]
                if one.stage != stage
            )
    for seed in itertools.count(1):
        for name in others:
            yield from redrawn(name, seed)


def _elsewhere(
    scenario: Scenario, place: str | None, stage: str, ending: str
) -> Scenario:
    name = f"{scenario.name}_in_{ending}"
    return scenario.replaced(name=name, map=place, stage=stage)
