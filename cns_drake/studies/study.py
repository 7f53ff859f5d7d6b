"""Makes and measures the pairs of drives of an experiment on maps."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
import itertools
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import (
    Cluster,
    InputError,
    did_you_mean,
    doing,
    errors_at,
    fingerprint,
    read_records,
    whole_number,
)
from cns_drake.scenarios import (
    Scenario,
    combined_digest,
    count_frames,
    digest_inputs,
    load_scenario,
    plan_drive,
    shipped_cities,
    worlds_folder,
)
from cns_drake.scene import MapFolder
from cns_drake.studies.drives.viewpoints import VIEWPOINTS, with_lidars_beside
from cns_drake.studies.maps.experiment_maps import (
    ExperimentRun,
    MapPairs,
    pairs_by_map,
)
from cns_drake.studies.maps.made_maps import ONLY_STAGE
from cns_drake.studies.maps.redrawing import redraw_cities
from cns_drake.studies.pairs.comparisons import ComparedDrives
from cns_drake.studies.pairs.simulated_pairs import (
    ChangedPair,
    SimulatedPairs,
)
from cns_drake.studies.tasks.map_task import DrivenMapTask
from cns_drake.studies.tasks.seen_task import SeenTask
from evaluation.drives import sample_frames
from evaluation.methods import known_methods, optional_methods
from evaluation.recognition import (
    KEEP_ALL,
    RetrievalProtocol,
    checked_keep,
    choose_metrics,
)
from evaluation.results import (
    CAUSE,
    LAST,
    LEVEL,
    OWN,
    SETTINGS,
    STAGE,
    PrintStyle,
    chart_factors,
    check_factors,
    check_metric_names,
    write_page,
)
from evaluation.study import (
    FLEET,
    SESSIONS,
    SIDES,
    STANDARD,
    ChangeTask,
    Condition,
    CostTask,
    Engine,
    Experiment,
    LocaliseTask,
    MapDrives,
    MethodChoice,
    Pair,
    PlaceTask,
    PoseTask,
    RecordedCondition,
    RecordingInfo,
    ShownCity,
    StudyFiles,
    Task,
    add_city,
    baseline_values,
    choose_methods,
    chosen_recordings,
    condition_protocol,
    levels_by_case,
    load_experiment,
    made_tasks,
    method_variants,
    recorded_pairs,
    recorded_sections,
    shipped_experiments,
)

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

    Returns:
        The path of the page.

    Raises:
        InputError: a field of the experiment, a map or the folder cannot be
            used, or a step failed.
    """
    run = ExperimentRun(
        experiment,
        output.absolute(),
        source or experiment.name,
        cluster,
        on_note,
    )
    with errors_at(f"{run.source}: metrics"):
        metrics = choose_metrics(experiment.metrics)
        check_metric_names(metrics, experiment.factor_names)
    engine, cities = plan_study(run, maps)
    results, queries = engine.run(cluster)
    own = [one.name for one, _ in engine.methods.values() if one.file]
    notes = [one.to_text() for one in _protocols(run)]
    if own and (changed := _unlike_shipped(run, maps)):
        notes.append(f"Shipped results are not shown: {changed}.")
        own = []
    return write_page(
        results,
        queries,
        run.output,
        title=experiment.name,
        about=experiment.about,
        charts=experiment.charts,
        metrics=metrics,
        experiment_text=experiment.text,
        notes=notes,
        sections=recorded_sections(cities, results, queries, run.output, {})
        if cities
        else [],
        own_methods=own,
        printed=printed,
        on_note=on_note,
    )


# Fields of an experiment that change no result of a condition.
_ONLY_SHOWN = frozenset(
    ("name", "about", "maps", "tasks", "methods", "metrics", "charts", "quick")
)


def _unlike_shipped(run: ExperimentRun, maps: Sequence[str]) -> str:
    """Returns why a study's conditions are no shipped ones; "" if they are.

    The tables have no column for a field without several values.
    """
    experiment = run.experiment
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
    run: ExperimentRun, maps: Sequence[str] = ()
) -> tuple[Engine, list[ShownCity]]:
    """Plans how all pairs of drives in all conditions are measured.

    Args:
        run: the experiment.
        maps: names or folders of maps that replace the experiment's maps.

    Returns:
        The engine that measures the pairs, and what the page shows of recorded
        cities.

    Raises:
        InputError: a field of the experiment, a map or the folder cannot be
            used, there is nothing to measure, or a drive differs from the
            frozen drive.
    """
    experiment = run.experiment
    # What is quick to check comes before all slow work.
    tasks = made_tasks(_wanted_tasks(run), TASKS, run.source)
    with errors_at(f"{run.source}: methods", "--method: "):
        methods = _choose_variants(experiment)
    _check_charts(run, methods)
    if experiment.frozen is not None:
        with errors_at(f"{run.source}: frozen"):
            frozen_drives(experiment.frozen)
    StudyFiles(run.output).check()
    _note_lower_levels(run)
    found = list(pairs_by_map(run, maps))
    doing("looking at all conditions")
    simulated = SimulatedPairs(run)
    changed = simulated.changed(found)
    baseline = baseline_values(experiment)
    engine = Engine(
        experiment.name,
        tasks,
        dict(methods),
        run.output,
        run.on_note,
        "; ".join(f"{name}={value}" for name, value in baseline.items()),
    )
    for task in tasks.values():
        if isinstance(task, PoseTask):
            task.baselines = _method_baselines(methods, baseline)
    cities: list[ShownCity] = []
    for some, simulations in zip(found, changed, strict=True):
        if some.city is None:
            pairs = [simulated.named(some, one) for one in simulations]
        else:
            pairs = list(_recorded_pairs(run, some.city))
        if not pairs:
            run.on_note(f"{some.map_name}: no two drives to compare")
        others = [
            simulated.named_drive(one) for one in _distractors(run, some, pairs)
        ]
        if some.city is None:
            engine.add(pairs, others)
        elif shown := add_city(engine, some.city, pairs, others):
            cities.append(shown)
    if not engine.jobs:
        raise InputError(f"{run.source}: no condition that can be measured")
    engine.jobs = {**simulated.upkeep, **engine.jobs}
    if experiment.frozen is not None:
        _check_drives_are_frozen(experiment.frozen, found, changed)
    return engine, cities


def study_drives(
    run: ExperimentRun, maps: Sequence[str] = ()
) -> list[Scenario]:
    """Returns all drives that a study compares, after making their maps.

    Args:
        run: the experiment.
        maps: names or folders of maps that replace the experiment's maps.

    Raises:
        InputError: a map cannot be used, or its drives are recordings.
    """
    found = list(pairs_by_map(run, maps))
    for some in found:
        if some.city is not None:
            raise InputError(
                f"{run.source}: {some.map_name}: its drives are recorded"
            )
    drives: dict[str, Scenario] = {}
    for changed in SimulatedPairs(run).changed(found):
        for one in changed:
            for drive in one.compared.drives:
                if drives.setdefault(drive.name, drive) != drive:
                    raise InputError(
                        f"{run.source}: two drives are named {drive.name}"
                    )
    return list(drives.values())


def _protocols(run: ExperimentRun) -> list[RetrievalProtocol]:
    """Returns each protocol once, in the order of the conditions."""
    return list(
        dict.fromkeys(
            condition_protocol(one, run.source)
            for one in run.experiment.conditions
        )
    )


def _wanted_tasks(run: ExperimentRun) -> Mapping[str, Mapping[str, Any]]:
    """Returns the experiment's tasks with their settings.

    If a database has several drives, a study of place recognition also measures
    the cost of the methods.

    Raises:
        InputError: a task compares exactly two drives, but the database has
            several.
    """
    wanted = run.experiment.tasks
    if not any(map(_has_several, run.experiment.conditions)):
        return wanted
    for name in (DrivenMapTask.name, ChangeTask.name):
        if name in wanted:
            raise InputError(
                f"{run.source}: tasks: {name}: it compares two drives, and"
                f" the database has several (database.{SESSIONS})"
            )
    if PlaceTask.name in wanted and CostTask.name not in wanted:
        run.on_note(
            f"{CostTask.name} is measured, too: what a database of several"
            " drives costs"
        )
        return {**wanted, CostTask.name: {}}
    return wanted


def _check_charts(
    run: ExperimentRun,
    methods: Mapping[str, tuple[MethodChoice, Mapping[str, Any]]],
) -> None:
    """Checks the metrics, and the settings of methods, that charts show.

    `load_experiment` has checked all other factors. A setting of a method that
    this run leaves out is known, too.

    Raises:
        InputError: there is no such metric, or no such factor.
    """
    experiment = run.experiment
    chosen = {choice.name for choice, _ in methods.values()}
    factors = [
        *(n for n in experiment.factor_names if not n.startswith(SETTINGS)),
        *dict.fromkeys(n for _, columns in methods.values() for n in columns),
    ]
    for chart in experiment.charts:
        with errors_at(run.source):
            names = [
                name
                for name in chart_factors(chart)
                if name in (chart.get("x"), chart.get("y"))
                or (
                    name.startswith(SETTINGS)
                    and not any(
                        name.startswith(f"{SETTINGS}{method}.")
                        for method in {*known_methods()} - chosen
                    )
                )
            ]
            check_factors(chart, names, factors)
            with errors_at(f"charts: {chart['kind']}"):
                choose_metrics([chart[n] for n in ("metric",) if n in chart])


def _note_lower_levels(run: ExperimentRun) -> None:
    """Notes the cases that lack the highest level of the experiment."""
    wanted = max(run.experiment.levels or (0,))
    fewer = [
        f"{name} ({number})"
        for name, number in levels_by_case(run.experiment).items()
        if number < wanted
    ]
    if fewer:
        run.on_note(f"measured at their last level: {', '.join(fewer)}")


def _recorded_pairs(run: ExperimentRun, city: MapDrives) -> Iterator[Pair]:
    """Returns the pairs of recordings in all conditions."""
    experiment = run.experiment
    return recorded_pairs(
        city,
        _recorded_conditions(city, experiment.conditions, run.source),
        experiment.seeds[0],
        run.on_note,
        both_ways=experiment.drives == "both-ways",
    )


def _distractors(
    run: ExperimentRun, some: MapPairs, found: Iterable[Pair]
) -> list[Scenario]:
    """Returns the drives whose places are added to databases."""
    most = max((one.distractors for one in found), default=0)
    if not most:
        return []
    # The same LiDARs see all places.
    database, _ = some.pairs[0]
    if run.experiment.drives == "same-route":
        database = with_lidars_beside(database, *VIEWPOINTS["near"])
    return distracting_drives(
        database,
        most,
        _protocols(run)[0].place_spacing,
        run.output / "cities",
        run.cluster,
        run.on_note,
    )


def _check_drives_are_frozen(
    table: str,
    maps: Iterable[MapPairs],
    changed: Iterable[Iterable[ChangedPair]],
) -> None:
    """Checks that the drives of each map and level are those of a table."""
    prints: dict[tuple[str, int], list[str]] = {}
    worlds: dict[tuple, str] = {}
    for some, pairs in zip(maps, changed, strict=True):
        for one in pairs:
            factors = {**some.factors, **one.condition.factors}
            place = some.map_name, factors.get(LEVEL, 0)
            drawn = drives_fingerprint(one.compared, worlds)
            prints.setdefault(place, []).append(drawn)
    check_frozen(table, prints)


def _has_several(condition: Condition) -> bool:
    """Returns whether a condition's database can have several drives."""
    levels = [one for cause in condition.causes for one in cause]
    for changes in (condition.changes, *levels):
        database = changes.get("database", {})
        given = database.get(SESSIONS)
        if FLEET in database or (
            isinstance(given, list | dict) and len(given) > 1
        ):
            return True
    return False


def _choose_variants(
    experiment: Experiment,
) -> Mapping[str, tuple[MethodChoice, Mapping[str, Any]]]:
    """Returns the chosen methods by key, each with columns of its settings.

    Raises:
        InputError: a method is unknown, or a setting is wrong.
    """
    files = [
        Path(one) for one in experiment.methods or () if one.endswith(".py")
    ]
    known = {one.name: one for one in choose_methods([STANDARD, *files])}
    variants = experiment.method_variants
    if experiment.methods is None:
        variants = method_variants({name: {} for name in known})
    known |= {name: MethodChoice(name) for name in optional_methods()}
    found = {}
    for name, settings, given in variants:
        place = f"methods.{name}."
        if name.endswith(".py"):
            path = Path(name).absolute()
            name = next(n for n, one in known.items() if one.file == path)
        if name not in known:
            raise InputError(
                f"no method {name!r} (known: {', '.join(known)})"
                f"{did_you_mean(name, known)}"
            )
        choice = replace(known[name], settings=settings)
        choice.make()  # A wrong setting is found before anything slow.
        columns = {
            f"methods.{name}.{column.removeprefix(place)}": one
            for column, one in given.items()
        }
        found[choice.key] = choice, columns
    return found


def _method_baselines(
    methods: Mapping[str, tuple[MethodChoice, Mapping[str, Any]]],
    baseline: Mapping[str, Any],
) -> dict[str, str]:
    """Returns the key of each method -> that of the method to compare with.

    This is the same method with the settings that the baseline names, and its
    own values of all other settings.
    """
    found = {}
    for key, (choice, columns) in methods.items():
        wanted = {name: baseline.get(name, columns[name]) for name in columns}
        for other, (known, settings) in methods.items():
            if known.name == choice.name and settings == wanted:
                found[key] = other
    return found


# Fields of a database of several recordings.
_OF_RECORDINGS = (f"database.{SESSIONS}", "database.keep")


def _recorded_conditions(
    city: MapDrives, conditions: Sequence[Condition], source: str
) -> list[RecordedCondition]:
    """Returns the conditions of an experiment on recordings.

    Args:
        city: the recordings of a map.
        conditions: the conditions.
        source: file of the experiment, for errors.

    Raises:
        InputError: a condition varies what recordings do not allow, or names a
            recording that is missing.
    """
    for one in conditions:
        _check_recordable(city, one, source)
    return [
        RecordedCondition(
            one.factors,
            one.changes.get("both", {}).get("stage", OWN),
            one.baseline,
            condition_protocol(one, source),
            _recorded_database(city, one, source),
            checked_keep(
                one.changes.get("database", {}).get("keep", KEEP_ALL),
                f"{source}: database.keep",
            ),
        )
        for one in conditions
    ]


def _recorded_database(
    city: MapDrives, condition: Condition, source: str
) -> tuple[RecordingInfo, ...]:
    """Returns the recordings of a database of several recordings."""
    names = condition.changes.get("database", {}).get(SESSIONS)
    if names is None:
        return ()
    where = f"{source}: database.{SESSIONS}"
    is_list = isinstance(names, list) and bool(names)
    if not (is_list and all(isinstance(one, str) for one in names)):
        raise InputError(f"{where}: not a list of names of recordings")
    return chosen_recordings(city, names, where)


def _check_recordable(
    city: MapDrives, condition: Condition, source: str
) -> None:
    """Checks that a condition varies only the stage, as recordings require."""
    sides = {n: condition.changes.get(n, {}) for n in SIDES}
    given = [f"{side}.{name}" for side in sides for name in sides[side]]
    if SESSIONS in sides["database"]:
        given = [one for one in given if one not in _OF_RECORDINGS]
        if sides["both"]:
            raise InputError(
                f"{source}: {STAGE}: databases of several"
                " recordings have no control"
            )
    elif "keep" in sides["database"]:
        raise InputError(
            f"{source}: database.keep: of recordings, it selects places of"
            f" database.{SESSIONS}; name them, too"
        )
    given += [CAUSE] if condition.causes else []
    for name in given:
        if name != STAGE:
            name = next(
                (n for n in condition.factors if n.startswith(name)),
                name,
            )
            raise InputError(
                f"{source}: {name}: the recordings of {city.name}"
                " are as they are; simulated drives alone can vary it"
            )
    stage = sides["both"].get("stage", OWN)
    if stage not in (OWN, LAST):
        raise InputError(
            f"{source}: {STAGE}: {stage!r}: recordings have {OWN} and {LAST}"
        )


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


def drives_fingerprint(
    compared: ComparedDrives, worlds: dict[tuple, str]
) -> str:
    """Returns a hash of all drives and of the cities along these drives.

    Args:
        compared: the drives.
        worlds: cache: world file, folders of models and traffic -> digest of
            these files. This function adds the digests of these drives.

    Raises:
        InputError: a file of a world cannot be read.
    """
    keys = [
        (drive.world_file, drive.model_paths, drive.traffic)
        for drive in compared.drives
    ]
    for drive, key in zip(compared.drives, keys, strict=True):
        if key not in worlds:
            worlds[key] = combined_digest(digest_inputs(drive))
    return fingerprint(
        {
            "drives": compared.fingerprint(),
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
    maps = {name: MapFolder(path) for name, path in shipped_cities().items()}
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
