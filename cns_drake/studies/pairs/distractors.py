"""Drives through other cities, which make recognition harder."""

from collections.abc import Callable, Iterator
import itertools
from pathlib import Path

import numpy as np

from cns_drake.base import Cluster
from cns_drake.scenarios import (
    Scenario,
    count_frames,
    load_scenario,
    plan_drive,
    shipped_maps,
)
from cns_drake.scene import MapFolder
from cns_drake.studies.maps.made_maps import ONLY_STAGE
from cns_drake.studies.maps.redrawing import redraw_cities
from evaluation.drives import sample_frames

# Number of drives after which a note reports the search for places elsewhere.
_NOTED_DRIVES = 20


def distracting_drives(
    query: Scenario,
    number: int,
    spacing: float,
    output: Path,
    cluster: Cluster,
    on_note: Callable[[str], None] = lambda text: None,
) -> list[Scenario]:
    """Returns drives through cities other than the query's city.

    Adding the places of these drives to a database makes recognition harder.
    The drives come in this order, until they have about the wanted number of
    places: the shipped drives of other maps, each through its own stage; if the
    query's map is shipped, drives along its streets between other buildings;
    the drives of other maps through their other stages; and drives along the
    streets of other maps, between other buildings.

    Args:
        query: the query drive. The returned drives have the LiDARs of the query
            drive, and do not go through its city.
        number: approximate number of places.
        spacing: distance between two places [m].
        output: folder for the newly generated cities, with other buildings.
        cluster: runs the jobs.
        on_note: is called with each note for the user.

    Raises:
        InputError: a shipped map cannot be used.
    """
    drives: list[Scenario] = []
    found = 0
    if number:
        on_note(f"{query.name}: looking for {number} places elsewhere")
    for drive in _drives_elsewhere(query, output, cluster):
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


def _drives_elsewhere(
    query: Scenario, output: Path, cluster: Cluster
) -> Iterator[Scenario]:
    """Yields drives without end, in the order of `distracting_drives`."""
    maps = {name: MapFolder(path) for name, path in shipped_maps().items()}
    drives = {
        name: [load_scenario(path) for path in folder.recordable_drives()]
        for name, folder in maps.items()
    }
    own = Path(str(query.map)).name
    others = [name for name in maps if name != own]

    def redrawn(name: str, seed: int) -> Iterator[Scenario]:
        cities = redraw_cities(
            maps[name].path, ONLY_STAGE, [seed], output, cluster
        )
        for one in drives[name]:
            yield _moved(one, str(cities[seed]), ONLY_STAGE, f"c{seed}")

    for name in others:
        yield from drives[name]
    if own in maps:
        yield from redrawn(own, 1)
    for name in others:
        for stage in maps[name].stages():
            yield from (
                _moved(one, one.map, stage, stage)
                for one in drives[name]
                if one.stage != stage
            )
    for seed in itertools.count(1):
        for name in others:
            yield from redrawn(name, seed)


def _moved(
    scenario: Scenario, place: str | None, stage: str, ending: str
) -> Scenario:
    name = f"{scenario.name}_in_{ending}"
    return scenario.replaced(name=name, map=place, stage=stage)
