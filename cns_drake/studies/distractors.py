"""Drives through other cities, whose places distract from the right one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_loading import load_scenario
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.studies.redrawing import redraw_cities
from evaluation.sequences.sampling import sample_frames

# Name of the only stage of a city that is drawn anew.
_STAGE = "01"


def distracting_drives(
    asking: Scenario,
    number: int,
    spacing: float,
    output: Path,
    cluster: Cluster,
) -> list[Scenario]:
    """Returns drives through other cities with about so many places.

    These are the shipped drives of other maps, each through its own stage;
    then through the other stages; then through those cities drawn anew.

    Args:
        asking: a drive through the map that is left out; its LiDARs measure
            the others, too.
        number: of places.
        spacing: between two places [m].
        output: folder for cities that are drawn anew.
        cluster: where these are drawn.

    Raises:
        InputError: a shipped map cannot be used.
    """
    drives: list[Scenario] = []
    for drive in _drives(asking, output, cluster):
        if number <= 0:
            break
        drive = drive.model_copy(update={"lidars": asking.lidars})
        drives.append(drive)
        number -= _num_places(drive, spacing)
    return drives


def _num_places(scenario: Scenario, spacing: float) -> int:
    trajectory = plan_drive(scenario)
    frames = count_frames(scenario, trajectory)
    _, p_WB = trajectory.poses(
        frame_period(scenario.lidars) * np.arange(frames)
    )
    return len(sample_frames(p_WB, spacing))


def _drives(
    asking: Scenario, output: Path, cluster: Cluster
) -> Iterator[Scenario]:
    """Yields drives without end."""
    maps = {
        name: MapFolder(path)
        for name, path in shipped_maps().items()
        if name != Path(str(asking.map)).name
    }
    sequences = {
        name: [load_scenario(path) for path in folder.recordable_sequences()]
        for name, folder in maps.items()
    }
    for same in sequences.values():
        yield from same
    for name, same in sequences.items():
        for stage in maps[name].stages():
            yield from (
                _elsewhere(one, one.map, stage, stage)
                for one in same
                if one.stage != stage
            )
    seed = 0
    while True:
        seed += 1
        for name, same in sequences.items():
            cities = redraw_cities(
                maps[name].path, _STAGE, [seed], output, cluster
            )
            for one in same:
                place = str(cities[seed])
                yield _elsewhere(one, place, _STAGE, f"c{seed}")


def _elsewhere(
    scenario: Scenario, place: str | None, stage: str, ending: str
) -> Scenario:
    return scenario.model_copy(
        update={
            "name": f"{scenario.name}_in_{ending}",
            "map": place,
            "stage": stage,
        }
    )
