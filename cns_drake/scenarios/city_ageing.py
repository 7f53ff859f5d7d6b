"""Ages a city whose drives are planned and whose world is read by Drake."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
import shutil

import numpy as np
import yaml

from cns_drake.motion import Trajectory
from cns_drake.scenarios.drive_table import write_table
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario_files import (
    describe_scenario,
    load_scenario,
    make_paths_absolute,
)
from cns_drake.scene import geometry_by_structure, load_world
from evaluation.base import read_yaml
from worlds.ageing import AgedMap, age_map
from worlds.maps import MapFolder
from worlds.shapes import Way

# Distance between the places along a drive [m].
_SPACING = 0.5


def age_city(
    source: Path,
    years: Sequence[int],
    seed: int,
    rates: Mapping[str, float],
    output: Path,
    finish: Callable[[Path, AgedMap, Trajectory], None] = (
        lambda folder, aged, trajectory: None
    ),
) -> AgedMap:
    """Writes a map folder in which a city ages, as `cns-drake age` does.

    It contains a drive through each stage, and the table of these drives.

    Args:
        source: the folder of the map; its last stage is today.
        years: see `worlds.ageing.age_map`.
        seed: the seed of all random numbers, not negative.
        rates: event -> rate per year, see `worlds.ageing.read_rates`.
        output: the folder to write, which must not exist yet.
        finish: function that can add files of your own. It is called with the
            folder, the result and the trajectory of the map's last drive when
            all other work is done, before the folder gets its final name.

    Returns:
        The stages and the events.

    Raises:
        InputError: an argument or the map cannot be used.
    """
    driven: list[Trajectory] = []

    def plan_ways(drives: Sequence[Path]) -> list[Way]:
        driven.extend(plan_drive(load_scenario(path)) for path in drives)
        return list(map(_way_of, driven))

    def complete(draft: Path, aged: AgedMap) -> None:
        _write_drives(MapFolder(source.resolve()), draft, aged.years, seed)
        write_table(draft, sizes=aged.sizes)
        finish(draft, aged, driven[-1])

    return age_map(
        source,
        years,
        seed,
        rates,
        output,
        lambda stage: geometry_by_structure(load_world(stage)),
        plan_ways,
        complete,
    )


def _way_of(trajectory: Trajectory) -> Way:
    number = max(2, int(trajectory.length / _SPACING))
    times = np.linspace(0.0, trajectory.duration, number)
    return Way(trajectory.poses(times)[1][:, :2])


def _way_name(drive: Path) -> str:
    """Returns a name for the copy of a drive's waypoints.

    The copies of different drives have different names, and no copy has the
    name of the map's own waypoint file.
    """
    return f"waypoints_{drive.stem.removeprefix('sequence_')}.csv"


def _write_drives(
    folder: MapFolder,
    draft: Path,
    stages: Mapping[str, int],
    seed: int,
) -> None:
    """Writes a drive through each stage.

    The drive through today's stage has the route of the map's first drive. All
    other drives have the route of the map's last drive, which is the query.
    """
    drives = folder.recordable_drives()
    for path in drives:
        way = load_scenario(path).waypoints
        if way is not None:
            shutil.copyfile(way, draft / _way_name(path))
    for stage, year in stages.items():
        path = drives[0] if year == 0 else drives[-1]
        values = read_yaml(path)
        if "base" in values:
            scenario = load_scenario(path)
            values = describe_scenario(scenario, folder.path)
        # Other files, such as traces of SUMO, are not copied.
        make_paths_absolute(values, path)
        kept = {
            key: value
            for key, value in values.items()
            if key not in ("name", "map", "stage", "title", "without", "base")
        }
        if "waypoints" in kept:
            kept["waypoints"] = _way_name(path)
        when = "today" if year == 0 else f"in year {year} of seed {seed}"
        text = yaml.safe_dump(
            {
                "map": ".",
                "stage": stage,
                "title": f"{folder.name.capitalize()} {when}",
                **kept,
            },
            sort_keys=False,
        )
        MapFolder(draft).drive(stage).write_text(text, "utf-8")
