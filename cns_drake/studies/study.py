"""Makes and measures the pairs of drives of an experiment on maps."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cns_drake.base.errors import InputError, did_you_mean, errors_at
from cns_drake.base.files import is_there
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.progress import doing
from cns_drake.scenarios.scenario import Scenario
from cns_drake.studies.drives.viewpoints import VIEWPOINTS, with_lidars_beside
from cns_drake.studies.experiments.conditions import (
    Condition,
    conditions,
    levels_by_case,
)
from cns_drake.studies.experiments.experiment import FLEET, SESSIONS, Experiment
from cns_drake.studies.experiments.method_variants import method_variants
from cns_drake.studies.experiments.protocol_fields import condition_protocol
from cns_drake.studies.maps.experiment_maps import ExperimentMaps, MapPairs
from cns_drake.studies.maps.made_maps import MadeMaps
from cns_drake.studies.pairs.distractors import distracting_drives
from cns_drake.studies.pairs.frozen_drives import (
    check_frozen,
    drives_fingerprint,
    frozen_drives,
)
from cns_drake.studies.pairs.recorded_conditions import recorded_conditions
from cns_drake.studies.pairs.simulated_pairs import SimulatedPairs
from cns_drake.studies.tasks.map_task import DrivenMapTask
from cns_drake.studies.tasks.seen_task import SeenTask
from evaluation.methods import optional_methods
from evaluation.results.charts.kinds import check_chart
from evaluation.results.keys import LEVEL
from evaluation.results.page import write_page
from evaluation.results.table import QUERIES, RESULTS
from evaluation.study.chosen_methods import (
    STANDARD,
    MethodChoice,
    choose_methods,
)
from evaluation.study.engine import Engine, made_tasks
from evaluation.study.recorded_city import ShownCity, add_city
from evaluation.study.recorded_study import recorded_sections
from evaluation.study.recordings.map_drives import MapDrives
from evaluation.study.recordings.recorded_pairs import recorded_pairs
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.localise import LocaliseTask
from evaluation.study.tasks.pair import NamedDrive, Pair
from evaluation.study.tasks.place import CostTask, PlaceTask, PoseTask
from evaluation.study.tasks.task import Task

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
# Tables that earlier versions wrote.
_FORMER = (
    "ladder.csv",
    "years.csv",
    "lifetimes.csv",
    "size.csv",
    "trend.csv",
    "map_pairs.csv",
    "map_update.csv",
    "localisation.csv",
)


def run_study(
    experiment: Experiment,
    output: Path,
    cluster: Cluster,
    maps: Sequence[str] = (),
    *,
    source: str = "",
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
        on_note: is called with notes on what is left out, and on how long the
            study takes.

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
    return study.run(maps)


@dataclass
class Study:
    """Measures an experiment on maps, and writes its results.

    Attributes:
        experiment: description of the experiment.
        output: folder of the results.
        source: file of the experiment, for error messages.
        cluster: runs the jobs.
        on_note: is called with notes on what is left out.
    """

    experiment: Experiment
    output: Path
    source: str
    cluster: Cluster
    on_note: Callable[[str], None] = lambda text: None

    def __post_init__(self) -> None:
        self._conditions = conditions(self.experiment)
        self._tasks = made_tasks(self._wanted_tasks(), TASKS, self.source)
        with errors_at(f"{self.source}: methods", "--method: "):
            self._variants = _choose_variants(self.experiment.methods)
        if self.experiment.frozen is not None:
            with errors_at(f"{self.source}: frozen"):
                frozen_drives(self.experiment.frozen)
        for chart in self.experiment.charts:
            with errors_at(self.source):
                check_chart(chart)
        # Each protocol once, in the order of the conditions.
        self._protocols = list(
            dict.fromkeys(
                condition_protocol(one, self.source) for one in self._conditions
            )
        )
        self._shown: list[ShownCity] = []
        self._made = MadeMaps(self.output / "cities")
        self._maps = ExperimentMaps(
            self.experiment,
            self.output,
            self.source,
            self.cluster,
            self.on_note,
        )
        self._simulated = SimulatedPairs(
            self.experiment,
            self._conditions,
            self.output,
            self.source,
            self._made,
            self.on_note,
        )

    def run(self, maps: Sequence[str] = ()) -> Path:
        """Measures all conditions; returns the path of the study's page.

        Args:
            maps: names or folders of maps that replace the experiment's maps.

        Raises:
            InputError: a map or the folder cannot be used, or a step failed.
        """
        for name in _FORMER:
            if (self.output / name).exists():
                raise InputError(
                    f"{self.output / name}: results of an older version; give"
                    " another folder"
                )
        self._note_lower_levels()
        found = list(self._maps.pairs(maps))
        doing("looking at all conditions")
        # Errors in the file are found before all slow work.
        for some in found:
            self._simulated.request_maps(some)
        for name in (RESULTS, QUERIES, "index.html"):
            is_there(self.output / name)  # Nothing else may have its name.
        self._made.make(self.cluster)
        engine = self._plan(found)
        results, queries = engine.run(self.cluster)
        further = []
        if self._shown:
            further = recorded_sections(
                self._shown, results, queries, self.output, {}
            )
        return write_page(
            results,
            queries,
            self.output,
            title=self.experiment.name,
            about=self.experiment.about,
            charts=self.experiment.charts,
            experiment_text=self.experiment.text,
            notes=[one.to_text() for one in self._protocols],
            sections=further,
            on_note=self.on_note,
        )

    def _note_lower_levels(self) -> None:
        """Notes the cases that lack the highest level of the experiment."""
        wanted = max(self.experiment.levels or (0,))
        fewer = [
            f"{name} ({number})"
            for name, number in levels_by_case(self.experiment).items()
            if number < wanted
        ]
        if fewer:
            self.on_note(f"measured at their last level: {', '.join(fewer)}")

    def drives(self, maps: Sequence[str] = ()) -> list[Scenario]:
        """Returns all drives that the study compares, after making their maps.

        Args:
            maps: names or folders of maps that replace the experiment's maps.

        Raises:
            InputError: a map cannot be used, or its drives are recordings.
        """
        found = list(self._maps.pairs(maps))
        for some in found:
            if some.city is not None:
                raise InputError(
                    f"{self.source}: {some.map_name}: its drives are recorded"
                )
            self._simulated.request_maps(some)
        self._made.make(self.cluster)
        drives: dict[str, Scenario] = {}
        for some in found:
            for one in self._simulated.changed(some, made=True):
                for drive in one.compared.drives:
                    if drives.setdefault(drive.name, drive) != drive:
                        raise InputError(
                            f"{self.source}: two drives are named {drive.name}"
                        )
        return list(drives.values())

    def _wanted_tasks(self) -> Mapping[str, Mapping[str, Any]]:
        """Returns the experiment's tasks with their settings.

        If a database has several drives, a study of place recognition also
        measures the cost of the methods.

        Raises:
            InputError: a task compares exactly two drives, but the database has
                several.
        """
        wanted = self.experiment.tasks
        if not any(map(_has_several, self._conditions)):
            return wanted
        for name in (DrivenMapTask.name, ChangeTask.name):
            if name in wanted:
                raise InputError(
                    f"{self.source}: tasks: {name}: it compares two drives, and"
                    f" the database has several (database.{SESSIONS})"
                )
        if PlaceTask.name in wanted and CostTask.name not in wanted:
            self.on_note(
                f"{CostTask.name} is measured, too: what a database of several"
                " drives costs"
            )
            return {**wanted, CostTask.name: {}}
        return wanted

    def _plan(self, maps: Iterable[MapPairs]) -> Engine:
        """Returns the engine that measures all pairs in all conditions.

        Raises:
            InputError: there is nothing to measure, or a drive differs from the
                frozen drive.
        """
        engine = Engine(
            self.experiment.name,
            self._tasks,
            dict(self._variants),
            self.output,
            self.on_note,
        )
        prints: dict[tuple[str, int], list[str]] = {}
        worlds: dict[Path, str] = {}
        for some in maps:
            found: list[Pair] = []
            if some.city is not None:
                found += self._recorded_pairs(some.city)
            else:
                for one, compared in self._simulated.pairs(some):
                    found.append(one)
                    if self.experiment.frozen is not None:
                        place = one.map_name, one.factors.get(LEVEL, 0)
                        drawn = prints.setdefault(place, [])
                        drawn.append(drives_fingerprint(compared, worlds))
            if not found:
                self.on_note(f"{some.map_name}: no two drives to compare")
            distractors = self._distractors(some, found)
            if some.city is None:
                engine.add(found, distractors)
            elif shown := add_city(engine, some.city, found, distractors):
                self._shown.append(shown)
        if not engine.jobs:
            raise InputError(
                f"{self.source}: no condition that can be measured"
            )
        engine.jobs = {**self._simulated.upkeep, **engine.jobs}
        if self.experiment.frozen is not None:
            check_frozen(self.experiment.frozen, prints)
        return engine

    def _recorded_pairs(self, city: MapDrives) -> Iterator[Pair]:
        """Returns the pairs of recordings in all conditions."""
        return recorded_pairs(
            city,
            recorded_conditions(city, self._conditions, self.source),
            self.experiment.seeds[0],
            self.on_note,
            both_ways=self.experiment.drives == "both-ways",
        )

    def _distractors(
        self, some: MapPairs, found: Iterable[Pair]
    ) -> list[NamedDrive]:
        """Returns the drives whose places are added to databases."""
        most = max((one.distractors for one in found), default=0)
        if not most:
            return []
        # The same LiDARs see all places.
        database, _ = some.pairs[0]
        if self.experiment.drives == "same-route":
            database = with_lidars_beside(database, *VIEWPOINTS["near"])
        return [
            self._simulated.named_drive(one)
            for one in distracting_drives(
                database,
                most,
                self._protocols[0].place_spacing,
                self.output / "cities",
                self.cluster,
                self.on_note,
            )
        ]


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
    wanted: Mapping[str, Mapping[str, Any]] | None,
) -> Mapping[str, tuple[MethodChoice, Mapping[str, Any]]]:
    """Returns the chosen methods by key, each with columns of its settings.

    Args:
        wanted: maps a method's name or Python file to the method's settings;
            None for all standard methods.

    Raises:
        InputError: a method is unknown, or a setting is wrong.
    """
    files = [Path(one) for one in wanted or () if one.endswith(".py")]
    known = {one.name: one for one in choose_methods([STANDARD, *files])}
    if wanted is None:
        wanted = {name: {} for name in known}
    known |= {name: MethodChoice(name) for name in optional_methods()}
    found = {}
    for name, settings, given in method_variants(wanted):
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
