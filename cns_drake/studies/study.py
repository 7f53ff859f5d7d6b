"""Makes and measures the pairs of drives of an experiment on maps."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
import itertools
from pathlib import Path

import numpy as np

from cns_drake.scenarios import (
    OffsetConfig,
    Scenario,
    combined_digest,
    count_frames,
    digest_inputs,
    load_scenario,
    make_maps,
    plan_drive,
    redrawn_city,
)
from cns_drake.simulation import SimulationSource
from cns_drake.studies.cause_check import cause_fault
from cns_drake.studies.maps.experiment_maps import MapPairs, pairs_by_map
from cns_drake.studies.pairs.changed_pairs import (
    changed_pairs,
    pair_fingerprint,
    simulated_drives,
)
from cns_drake.studies.pairs.map_upkeep import UpkeptSource, plain_source
from cns_drake.studies.recording import is_recorded
from cns_drake.studies.tasks.map_task import DrivenMapTask
from cns_drake.studies.tasks.seen_task import SeenTask
from evaluation.alignment import When
from evaluation.base import (
    Cluster,
    InputError,
    check_folder_writable,
    doing,
    errors_at,
    fingerprint,
    read_records,
    whole_number,
)
from evaluation.drives import DriveSource, RecordingSource, sample_frames
from evaluation.results import LEVEL, PrintStyle
from evaluation.study import (
    ChangeTask,
    CostTask,
    Experiment,
    LocaliseTask,
    Pair,
    PlaceTask,
    PoseTask,
    RecordedCity,
    Study,
    StudyDrive,
    Task,
    causes,
    condition_protocol,
    draw_cities,
    drives_by_map,
    find_recordings,
    load_experiment,
    recorded_pairs,
    recorded_sections,
    shipped_experiments,
)
from worlds.maps import MapFolder, shipped_cities, worlds_folder

TASKS: Mapping[str, type[Task]] = {
    task.name: task
    for task in (
        PlaceTask,
        PoseTask,
        LocaliseTask,
        DrivenMapTask,
        ChangeTask,
        CostTask,
        SeenTask,
    )
}


def run_study(
    experiment: Experiment,
    output: Path,
    cluster: Cluster,
    maps: Sequence[str] = (),
    *,
    source: str = "",
    printed: PrintStyle | None = None,
    on_note: Callable[[str], None] = lambda text: None,
    align: When = "auto",
    pose_gap: float | None = None,
) -> Path:
    """Measures all conditions of an experiment; writes tables and a page.

    The folder `output` then contains the tables `results.csv` and
    `queries.csv`, the page `index.html`, and in `cities` the maps that were
    made. Finished work is not repeated.

    Args:
        experiment: the experiment.
        output: folder of the results.
        cluster: does the work.
        maps: maps that replace the experiment's maps.
        source: file of the experiment, for errors.
        printed: style of the charts for print; None for the default.
        on_note: is called with notes on what is left out, and on how long the
            study takes.
        align: when recordings are aligned, see `open_pair` of
            `evaluation.alignment`.
        pose_gap: of recordings, see `open_drive`.

    Returns:
        The path of the page.

    Raises:
        InputError: a field of the experiment, a map or the folder cannot be
            used, or a step failed.
    """
    study = Study(
        experiment,
        output.absolute(),
        source or experiment.name,
        cluster,
        on_note,
    )
    pairs, cities = plan_study(study, maps, align, pose_gap)
    shown = [asked for one in cities for asked in one.shown()]
    results, queries = study.measure(pairs, shown)
    own = [one.name for one, _ in study.methods.values() if one.file]
    notes = [one.to_text() for one in study.protocols]
    if own and (changed := _unlike_shipped(study, maps)):
        notes.append(f"Shipped results are not shown: {changed}.")
        own = []
    sections = []
    if cities:
        drawn = draw_cities(study, cities)
        sections = recorded_sections(drawn, results, queries, study.output, {})
    doing("writing the page")
    return study.write_page(
        results,
        queries,
        pairs,
        notes,
        sections,
        own_methods=own,
        printed=printed,
    )


# Fields of an experiment that change no result of a condition.
_ONLY_SHOWN = frozenset(
    ("name", "about", "maps", "tasks", "methods", "metrics", "charts", "quick")
)


def _unlike_shipped(study: Study, maps: Sequence[str]) -> str:
    """Returns why a study's conditions are no shipped ones; "" if they are.

    The tables have no column for a field without several values.
    """
    experiment = study.experiment
    if experiment.name not in shipped_experiments():
        return f"{experiment.name} is no shipped experiment"
    known = load_experiment(experiment.name).model_dump()
    changed = [
        name
        for name, value in experiment.model_dump().items()
        if name not in _ONLY_SHOWN and value != known[name]
    ]
    if changed:
        return f"other values of {', '.join(changed)}"
    other = [
        str(one)
        for one in maps or experiment.maps or ()
        if one not in shipped_cities()
    ]
    return f"{other[0]} is no shipped map" if other else ""


def plan_study(
    study: Study,
    maps: Sequence[str] = (),
    align: When = "auto",
    pose_gap: float | None = None,
) -> tuple[list[Pair], list[RecordedCity]]:
    """Chooses what is measured, and makes the cities of all drives.

    Args:
        study: the study.
        maps: names or folders of maps that replace the experiment's maps.
        align, pose_gap: see `run_study`.

    Returns:
        The pairs of all maps; the recorded cities that the page shows.

    Raises:
        InputError: a field of the experiment, a map or the folder cannot be
            used, there is nothing to measure, or a drive differs from the
            frozen drive.
    """
    check_folder_writable(study.output)
    experiment = study.experiment
    study.choose(TASKS)
    experiment = study.experiment = _with_usable_causes(study)
    if experiment.frozen is not None:
        with errors_at(f"{study.source}: frozen"):
            frozen_drives(experiment.frozen)
    found = list(
        pairs_by_map(
            study,
            maps,
            lambda folder: drives_by_map(
                find_recordings(folder, study.on_note, pose_gap=pose_gap),
                study.on_note,
                align,
            ),
        )
    )
    doing("looking at all conditions")
    changed = changed_pairs(study, found)
    if experiment.frozen is not None:
        _check_drives_are_frozen(experiment.frozen, changed)
    pairs: list[Pair] = []
    cities: list[RecordedCity] = []
    for some, simulated in zip(found, changed, strict=True):
        if some.city is None:
            of_map = [
                _recorded_if_there(one, study.output) for one in simulated
            ]
            if any(one.num_distractors for one in of_map):
                of_map = _with_distractors(study, some, of_map)
        else:
            conditions = [
                (one, condition_protocol(one, study.source))
                for one in experiment.conditions
            ]
            of_map = list(
                recorded_pairs(
                    some.city,
                    conditions,
                    experiment.seeds[0],
                    study.source,
                    study.on_note,
                    both_ways=experiment.drives == "both-ways",
                )
            )
            # Without maps of the drives, there is nothing to show.
            if of_map and ChangeTask.name in study.tasks:
                cities.append(RecordedCity(some.city, tuple(of_map)))
        if not of_map:
            study.on_note(f"{some.map_name}: no two drives to compare")
        pairs += of_map
    if not pairs:
        raise InputError(f"{study.source}: no condition that can be measured")
    return pairs, cities


def _recorded_if_there(pair: Pair, output: Path) -> Pair:
    """Returns a pair whose drives are read where they are recorded."""

    def source(one: DriveSource) -> DriveSource:
        if isinstance(one, UpkeptSource):
            return replace(one, sources=tuple(map(source, one.sources)))
        drive = plain_source(one).scenario
        if not is_recorded(drive, output):
            return one
        return RecordingSource(output / drive.name)

    def drive(one: StudyDrive) -> StudyDrive:
        return replace(one, source=source(one.source))

    return replace(
        pair,
        database=tuple(map(drive, pair.database)),
        query=drive(pair.query),
        way=pair.way and drive(pair.way),
    )


def _with_usable_causes(study: Study) -> Experiment:
    """Returns the experiment without cases of causes that cannot be used."""
    cases, known = study.experiment.cases, causes()
    unusable = set()
    for name in cases:
        if name in known and (fault := cause_fault(known[name])):
            study.on_note(f"left out: {fault}")
            unusable.add(name)
    if not unusable:
        return study.experiment
    kept = {}
    for name, case in cases.items():
        if isinstance(case, tuple):
            case = tuple(one for one in case if one not in unusable)
        if case and name not in unusable:
            kept[name] = case
    return study.experiment.replaced(cases=kept)


# Number of drives after which a note reports the search for places elsewhere.
_NOTED_DRIVES = 20


def _with_distractors(
    study: Study, some: MapPairs, pairs: Iterable[Pair]
) -> list[Pair]:
    """Returns the pairs of a map with the drives through other cities.

    Adding the places of these drives to a database makes recognition harder.
    The drives come in this order, until they have about as many places as a
    pair adds: the shipped drives of other maps, each through its own stage; if
    the map is shipped, drives along its streets between other buildings; the
    drives of other maps through their other stages; and drives along the
    streets of other maps, between other buildings.
    """
    pairs = list(pairs)
    most = max(one.num_distractors for one in pairs)
    # The same LiDARs see all places.
    database, _ = some.pairs[0]
    study.on_note(f"{database.name}: looking for {most} places elsewhere")
    spacing = study.protocols[0].place_spacing
    drives: list[StudyDrive] = []
    # Number of places before each drive.
    before: list[int] = []
    number = 0
    for drive in _drives_elsewhere(
        database, study.output / "cities", study.cluster
    ):
        if number >= most:
            break
        drive = drive.replaced(lidars=database.lidars, offset=database.offset)
        drives.append(StudyDrive(drive.name, SimulationSource(drive)))
        before.append(number)
        trajectory = plan_drive(drive)
        frames = np.arange(count_frames(drive, trajectory))
        _, p_WB = trajectory.poses(drive.frame_period * frames)
        number += len(sample_frames(p_WB, spacing))
        if len(drives) % _NOTED_DRIVES == 0:
            study.on_note(f"{database.name}: found {number} places elsewhere")
    return [
        replace(
            one,
            distractors=tuple(
                drive
                for drive, first in zip(drives, before, strict=True)
                if first < one.num_distractors
            ),
        )
        for one in pairs
    ]


def _check_drives_are_frozen(
    table: str, changed: Iterable[Iterable[Pair]]
) -> None:
    """Checks that the drives of each map and level are those of a table."""
    prints: dict[tuple[str, int], list[str]] = {}
    worlds: dict[tuple, str] = {}
    for pairs in changed:
        for one in pairs:
            place = one.map_name, one.factors.get(LEVEL, 0)
            drawn = drives_fingerprint(one, worlds)
            prints.setdefault(place, []).append(drawn)
    check_frozen(table, prints)


# Columns of a table of frozen drives.
_FROZEN = ("map", "level", "drives")


def frozen_drives(table: str) -> dict[tuple[str, int], str]:
    """Reads a table of drives that must stay the same in all releases.

    Args:
        table: name of a CSV file in the folder of the shipped worlds.

    Returns:
        (map, level) -> fingerprint, a hash of the drives that are compared. The
        level is the degree of difficulty, see `docs/ladder.md`.

    Raises:
        InputError: there is no such file, or a level is not a number.
    """
    path = worlds_folder() / table
    return {
        (
            row["map"],
            whole_number(row["level"], f"{path}: line {line}: level"),
        ): row["drives"]
        for line, row in read_records(path, _FROZEN)
    }


def drives_fingerprint(pair: Pair, worlds: dict[tuple, str]) -> str:
    """Returns a hash of all drives and of the cities along these drives.

    Args:
        pair: the drives.
        worlds: cache: world file, folders of models and traffic -> digest of
            these files. This function adds the digests of these drives.

    Raises:
        InputError: a file of a world cannot be read.
    """
    drives = simulated_drives(pair)
    keys = [
        (drive.world_file, drive.model_paths, drive.traffic) for drive in drives
    ]
    for drive, key in zip(drives, keys, strict=True):
        if key not in worlds:
            worlds[key] = combined_digest(digest_inputs(drive))
    return fingerprint(
        {
            # Where the LiDARs pass counts, not by which field.
            "drives": pair_fingerprint(
                pair,
                [
                    one.replaced(
                        lidars=one.mounted_lidars, offset=OffsetConfig()
                    )
                    for one in drives
                ],
            ),
            "worlds": [worlds[key] for key in keys],
        }
    )


def check_frozen(
    table: str, compared: Mapping[tuple[str, int], Sequence[str]]
) -> None:
    """Checks that the drives of a comparison are listed in a table.

    Maps that are not in the table are not checked.

    Args:
        table: name of a file in the folder of the shipped worlds; see
            `frozen_drives`.
        compared: (map, level) -> fingerprints of the compared drives. Levels
            are degrees of difficulty, see `docs/ladder.md`.

    Raises:
        InputError: a fingerprint differs from the table's.
    """
    frozen = frozen_drives(table)
    for (name, level), prints in compared.items():
        wanted = frozen.get((name, level))
        if wanted not in (None, fingerprint({"drives": list(prints)})):
            raise InputError(
                f"{table}: level {level} of {name}: the experiment's drives are"
                " not the frozen ones; leave out `frozen` to measure them"
            )


def _drives_elsewhere(
    query: Scenario, output: Path, cluster: Cluster
) -> Iterator[Scenario]:
    """Yields drives without end, in the order of `_distractors`."""
    maps = {name: MapFolder(path) for name, path in shipped_cities().items()}
    drives = {
        name: [load_scenario(path) for path in folder.recordable_drives()]
        for name, folder in maps.items()
    }
    own = Path(str(query.map)).name
    others = [name for name in maps if name != own]

    def redrawn(name: str, seed: int) -> Iterator[Scenario]:
        city = redrawn_city(maps[name].path.resolve(), seed, output.resolve())
        make_maps([city], city.folder.parent, cluster)
        for one in drives[name]:
            yield _moved(one, str(city.folder), city.stage, f"c{seed}")

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
