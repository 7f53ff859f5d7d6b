"""Makes and measures the pairs of drives of an experiment on maps."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from cns_drake.base.errors import InputError, did_you_mean, errors_at
from cns_drake.base.files import is_there
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.running import Job
from cns_drake.base.listing import listed, natural_key
from cns_drake.base.progress import doing
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import (
    recordable_map,
    recordable_maps,
    shipped_maps,
)
from cns_drake.scene.map_folder import MapFolder
from cns_drake.simulation.simulated_drive import SimulationSource
from cns_drake.studies.comparisons import Compared, PairMaker
from cns_drake.studies.conditions import Condition, conditions, num_levels
from cns_drake.studies.experiment import (
    FLEET,
    SESSIONS,
    SIDES,
    Experiment,
    MadeMap,
)
from cns_drake.studies.frozen_drives import (
    check_frozen,
    frozen_drives,
    frozen_print,
)
from cns_drake.studies.made_maps import (
    MadeMaps,
    distracting_drives,
    made_map_step,
)
from cns_drake.studies.map_step import make_maps
from cns_drake.studies.map_task import DrivenMapTask
from cns_drake.studies.map_upkeep import UpkeptSource, update_maps
from cns_drake.studies.method_variants import method_variants
from cns_drake.studies.named_stages import MissingError
from cns_drake.studies.protocol_fields import protocol_from_fields
from cns_drake.studies.recording import is_recorded
from cns_drake.studies.redrawing import redraw_frozen
from cns_drake.studies.seen_task import SeenTask
from cns_drake.studies.viewpoints import VIEWPOINTS, with_lidars_beside
from evaluation.map_update.upkeep import NOT_MAINTAINED
from evaluation.methods import optional_methods
from evaluation.recognition.keeping import KEEP_ALL, checked_keep
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.charts import check
from evaluation.results.page import write_page
from evaluation.results.table import (
    CAUSE,
    FROZEN_REDRAW,
    LAST,
    LEVEL,
    OWN,
    QUERIES,
    RESULTS,
    STAGE,
)
from evaluation.study.chosen_methods import (
    STANDARD,
    MethodChoice,
    choose_methods,
)
from evaluation.study.collection import (
    MapDrives,
    RecordingInfo,
    drives_by_map,
    find_recordings,
)
from evaluation.study.engine import Engine, made_tasks
from evaluation.study.parts import MakePart
from evaluation.study.recorded import (
    ExtractionJobs,
    RecordedCondition,
    chosen_sessions,
    recorded_comparisons,
)
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.localise import LocaliseTask
from evaluation.study.tasks.place import CostTask, PlaceTask, PoseTask
from evaluation.study.tasks.task import (
    OPENING_COST,
    Jobs,
    NamedDrive,
    Pair,
    Task,
    job_name,
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
# Expected time to update a map by a usual drive, once it is open [s].
_UPKEEP_COST = 60.0
# Fields of a database of several recordings.
_OF_RECORDINGS = (f"database.{SESSIONS}", "database.keep")
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


@dataclass(frozen=True)
class _MapPairs:
    """The pairs of drives of one map, before a condition changes them."""

    map_name: str
    factors: Mapping[str, Any]
    pairs: Sequence[tuple[Scenario, Scenario]] = ()
    city: MapDrives | None = None

    @property
    def drive_names(self) -> set[str]:
        """The names of all drives."""
        recordings = (
            (*self.city.stages.values(), *self.city.others)
            if self.city is not None
            else ()
        )
        names = {one.name for one in recordings}
        return names | {one.name for pair in self.pairs for one in pair}


class _ChangedPair(NamedTuple):
    """A pair of drives as a condition changes it.

    Attributes:
        names: names of the database and of the query drive, unchanged.
        query: the query drive, unchanged.
        compared: the changed drives.
        condition: the condition.
        seed: seed of the condition's random choices.
    """

    names: tuple[str, str]
    query: Scenario
    compared: Compared
    condition: Condition
    seed: int


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
        maps: maps that replace those of the experiment.
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
            self._variants = self._choose_methods()
        if self.experiment.frozen is not None:
            with errors_at(f"{self.source}: frozen"):
                frozen_drives(self.experiment.frozen)
        for chart in self.experiment.charts:
            with errors_at(self.source):
                check(chart)
        self._protocol = self._protocol_of(self._conditions[0])
        self._made = MadeMaps(self.output / "cities")
        self._upkeep: dict[str, Job] = {}

    def run(self, maps: Sequence[str] = ()) -> Path:
        """Measures all conditions; returns the path of the study's page.

        Args:
            maps: names or folders of maps that replace those of the experiment.

        Raises:
            InputError: a map or the folder cannot be used, or a step failed.
        """
        for name in _FORMER:
            if (self.output / name).exists():
                raise InputError(
                    f"{self.output / name}: results of an older version; give"
                    " another folder"
                )
        wanted = max(self.experiment.levels or (0,))
        fewer = [
            f"{name} ({number})"
            for name, number in num_levels(self.experiment).items()
            if number < wanted
        ]
        if fewer:
            self.on_note(f"measured at their last level: {', '.join(fewer)}")
        drives = list(self._map_drives(maps))
        doing("looking at all conditions")
        # Errors in the file are found before all slow work.
        for some in drives:
            self._request_maps(some)
        for name in (RESULTS, QUERIES, "index.html"):
            is_there(self.output / name)  # Nothing else may have its name.
        self._made.make(self.cluster)
        engine = self._plan(drives)
        results, queries = engine.run(self.cluster)
        return write_page(
            results,
            queries,
            self.output,
            title=self.experiment.name,
            about=self.experiment.about,
            charts=self.experiment.charts,
            experiment_text=self.experiment.text,
            notes=[self._protocol.to_text()],
            on_note=self.on_note,
        )

    def drives(self, maps: Sequence[str] = ()) -> list[Scenario]:
        """Returns all drives that the study compares, after making their maps.

        Args:
            maps: names or folders of maps that replace those of the experiment.

        Raises:
            InputError: a map cannot be used, or its drives are recordings.
        """
        found = list(self._map_drives(maps))
        for some in found:
            if some.city is not None:
                raise InputError(
                    f"{self.source}: {some.map_name}: its drives are recorded"
                )
            self._request_maps(some)
        self._made.make(self.cluster)
        drives: dict[str, Scenario] = {}
        for some in found:
            for one in self._changed_pairs(some, made=True):
                for drive in one.compared.drives:
                    if drives.setdefault(drive.name, drive) != drive:
                        raise InputError(
                            f"{self.source}: two drives are named {drive.name}"
                        )
        return list(drives.values())

    def _wanted_tasks(self) -> Mapping[str, Mapping[str, Any]]:
        """Returns the experiment's tasks with their settings.

        If a database has several drives, what it costs belongs to the answer.

        Raises:
            InputError: a task compares two drives, but the database has more.
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

    def _choose_methods(
        self,
    ) -> Mapping[str, tuple[MethodChoice, Mapping[str, Any]]]:
        """Returns key -> method, with columns of its settings."""
        wanted = self.experiment.methods
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

    def _map_drives(self, maps: Sequence[str]) -> Iterator[_MapPairs]:
        """Yields the drives of all maps; makes aged and imported maps."""
        made = {
            one.name: one
            for one in self.experiment.maps or ()
            if isinstance(one, MadeMap)
        }
        wanted: Sequence[str | MadeMap] = [made.get(one, one) for one in maps]
        if not maps:
            wanted = self.experiment.maps or recordable_maps()
        known: set[str] = set()
        for one in wanted:
            # A wrong name is found before any map is made.
            if self.experiment.frozen_redraws and (
                isinstance(one, MadeMap) or one not in shipped_maps()
            ):
                raise InputError(
                    f"{self.source}: {FROZEN_REDRAW}:"
                    f" {getattr(one, 'name', one)}: no shipped map"
                )
            if isinstance(one, str) and not Path(one).is_dir():
                try:
                    recordable_map(one)
                except InputError as error:
                    place = "" if maps else f"{self.source}: maps: "
                    raise InputError(f"{place}{error}") from None
        for one in wanted:
            for some in self._drives_of(one):
                names = {some.map_name, *some.drive_names}
                if some.factors:
                    names.remove(some.map_name)
                for name in sorted(names & known):
                    raise InputError(
                        f"{getattr(one, 'name', one)}: another map, or a drive"
                        f" of one, has the name {name}, too"
                    )
                known |= names
                yield some

    def _drives_of(self, one: str | MadeMap) -> Iterator[_MapPairs]:
        if isinstance(one, MadeMap):
            folder = self.output / "cities" / one.name
            step = made_map_step(one, self.experiment, folder, shipped_maps())
            make_maps([step], folder.parent, self.cluster)
            yield _MapPairs(one.name, {}, self._pairs(folder))
            return
        path = shipped_maps().get(one, Path(one))
        versions = self.experiment.frozen_redraws
        if versions:
            cities = redraw_frozen(
                [one],
                versions,
                self.output / "cities",
                self.cluster,
                self.source,
            )
            for number, folder in zip(sorted(versions), cities, strict=True):
                yield _MapPairs(
                    one, {FROZEN_REDRAW: number}, self._pairs(folder)
                )
            return
        if path.is_dir() and not MapFolder(path).drives():
            for city in drives_by_map(find_recordings(path, self.on_note)):
                yield _MapPairs(city.name, {}, city=city)
            return
        yield _MapPairs(path.name, {}, self._pairs(recordable_map(one)))

    def _pairs(self, folder: Path) -> list[tuple[Scenario, Scenario]]:
        """Returns the pairs of drives of a map: database and query."""
        files = MapFolder(folder).recordable_drives()
        kind = self.experiment.drives
        if kind == "first-and-last":
            stages = list(MapFolder(folder).stages())
            # In an imported city, the drives of the stages have different
            # routes.
            last = (listed(folder, "other_*.yaml") or files)[-1]
            return [
                (
                    load_scenario(files[0]).replaced(stage=stages[0]),
                    load_scenario(last).replaced(stage=stages[-1]),
                )
            ]
        drives = [load_scenario(path) for path in files]
        if kind == "same-route":
            query = drives[-1]
            return [(query.replaced(name=f"{query.name}_database"), query)]
        query = max(drives, key=lambda drive: natural_key(drive.stage or ""))
        pairs = [(one, query) for one in drives if one is not query]
        if kind == "both-ways" and len(drives) == 2:
            pairs += [(query, one) for one, _ in pairs]
        return pairs

    def _plan(self, drives: Iterable[_MapPairs]) -> Engine:
        """Returns the engine with all pairs in all conditions.

        Raises:
            InputError: there is nothing to measure, or a drive is not the one
                that is frozen.
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
        for some in drives:
            found: list[Pair] = []
            if some.city is not None:
                found += self._recorded_pairs(some.city)
            else:
                for one, compared in self._simulated_pairs(some):
                    found.append(one)
                    if self.experiment.frozen is not None:
                        place = one.map_name, one.factors.get(LEVEL, 0)
                        drawn = prints.setdefault(place, [])
                        drawn.append(frozen_print(compared, worlds))
            if not found:
                self.on_note(f"{some.map_name}: no two drives to compare")
            jobs: Callable[..., Jobs] = Jobs
            if some.city is not None:
                with_map = ChangeTask.name in self._tasks
                jobs = partial(ExtractionJobs, with_map=with_map)
            engine.add(found, self._distractors(some, found), jobs)
        if not engine.jobs:
            raise InputError(
                f"{self.source}: no condition that can be measured"
            )
        engine.jobs = {**self._upkeep, **engine.jobs}
        if self.experiment.frozen is not None:
            check_frozen(self.experiment.frozen, prints)
        return engine

    def _distractors(
        self, some: _MapPairs, found: Iterable[Pair]
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
            self._named_drive(one)
            for one in distracting_drives(
                database,
                most,
                self._protocol.place_spacing,
                self.output / "cities",
                self.cluster,
                self.on_note,
            )
        ]

    def _named_drive(self, drive: Scenario) -> NamedDrive:
        """Returns a drive that is simulated, or read if it is recorded."""
        if is_recorded(drive, self.output):
            from evaluation.study.sources import RecordingSource

            return NamedDrive(
                drive.name, RecordingSource(self.output / drive.name)
            )
        return NamedDrive(drive.name, SimulationSource(drive))

    def _request_maps(self, some: _MapPairs) -> None:
        """Requests the maps that conditions need, which `MadeMaps.make` makes.

        Raises:
            InputError: a field of a condition cannot be used.
        """
        for one in self._changed_pairs(some, made=False):
            self._protocol_of(one.condition)

    def _simulated_pairs(
        self, some: _MapPairs
    ) -> Iterator[tuple[Pair, Compared]]:
        """Yields the pairs of a map in all conditions that it allows.

        Each item is a pair and its changed drives.
        """
        for one in self._changed_pairs(some, made=True):
            yield (
                self._pair(
                    one.compared,
                    one.query,
                    map_name=some.map_name,
                    names=one.names,
                    factors={**some.factors, **one.condition.factors},
                    seed=one.seed,
                    is_baseline=one.condition.is_baseline,
                    stated=self._protocol_of(one.condition),
                ),
                one.compared,
            )

    def _changed_pairs(
        self, some: _MapPairs, *, made: bool
    ) -> Iterator[_ChangedPair]:
        """Yields the pairs of a map in all conditions that it allows.

        Args:
            some: the pairs of the map.
            made: whether the maps that conditions need exist; if not, they are
                requested.
        """
        noted: dict[str, None] = {}
        age, redraw = self._made.want_age, self._made.want_redrawn
        if made:
            age, redraw = self._made.aged, self._made.redrawn
        for database, query in some.pairs:
            pair = PairMaker(
                database,
                query,
                self.experiment.drives == "same-route",
                self.source,
                age,
                redraw,
                noted.setdefault,
            )
            names = _base_name(database), query.name
            known: set[str] = set()
            for condition in self._conditions:
                for seed in self.experiment.seeds:
                    try:
                        compared = pair.build(condition, seed)
                    except MissingError as error:
                        label = condition.factors.get(CAUSE, "a condition")
                        noted.setdefault(f"{label} left out: {error}")
                        break
                    # A condition without random numbers is measured once.
                    key = f"{condition.factors} {compared.fingerprint()}"
                    if key not in known:
                        known.add(key)
                        yield _ChangedPair(
                            names, query, compared, condition, seed
                        )
        for text in noted if made else ():
            self.on_note(f"{some.map_name}: {text}")

    def _pair(self, compared: Compared, query: Scenario, **shown: Any) -> Pair:
        """Returns a pair of drives, which tables show with given fields."""
        *drives, asked = (
            replace(self._named_drive(drive), length=length)
            for drive, length in zip(
                compared.drives, compared.lengths, strict=True
            )
        )
        database, *beside = self._with_upkept_maps(drives, compared.maintain)
        way = database
        if self.experiment.drives == "same-route":
            city = {
                name: getattr(compared.database, name)
                for name in ("map", "stage", "without", "transient")
            }
            drive = compared.query.replaced(**city, name=query.name)
            if drive.replaced(name=asked.name) == compared.query:
                drive = compared.query
            elif drive != query:
                content = fingerprint(drive.model_dump(mode="json"))[:8]
                drive = drive.replaced(name=f"{query.name}_way_{content}")
            way = replace(self._named_drive(drive), length=asked.length)
        asked_how = {
            "compared": compared.fingerprint(),
            **compared.protocol.to_json(),
            "radius": None,  # Queries are scored once for all radii.
        }
        digest = fingerprint(asked_how)[:8]
        return Pair(
            **shown,
            key=f"{database.name} {asked.name} {digest}",
            database=database,
            query=asked,
            way=way,
            protocol=compared.protocol,
            distractors=compared.distractors,
            beside=tuple(beside),
            keep=compared.keep,
            ages=compared.ages,
            may_repeat=bool(compared.asked or compared.distractors),
        )

    def _with_upkept_maps(
        self, drives: Sequence[NamedDrive], maintain: str
    ) -> Sequence[NamedDrive]:
        """Returns drives whose maps are updated by later ones, with its job."""
        if maintain == NOT_MAINTAINED:
            return drives
        sources = tuple(one.source for one in drives)
        content = fingerprint({"drives": [one.name for one in drives]})[:8]
        part = StudyFiles(self.output).part(
            "upkeep", drives[0].name, f"{content} {maintain}"
        )
        job = Job(
            job_name(part),
            MakePart(part, update_maps, (sources, maintain)),
            tuple(need for one in drives for need in one.needs),
            sum(OPENING_COST + _UPKEEP_COST * one.share for one in drives),
        )
        self._upkeep[job.name] = job
        return [
            NamedDrive(
                f"{one.name}_{maintain}_{content}",
                UpkeptSource(sources, number, maintain, part),
                (job.name,),
                one.length,
            )
            for number, one in enumerate(drives)
        ]

    def _recorded_pairs(self, city: MapDrives) -> Iterator[Pair]:
        """Yields the pairs of recordings; only their stage can vary."""
        self._check_recordable(city)
        return recorded_comparisons(
            city,
            [
                RecordedCondition(
                    one.factors,
                    one.changes.get("both", {}).get("stage", OWN),
                    one.is_baseline,
                    self._protocol_of(one),
                    self._recorded_sessions(city, one),
                    checked_keep(
                        one.changes.get("database", {}).get("keep", KEEP_ALL),
                        f"{self.source}: database.keep",
                    ),
                )
                for one in self._conditions
            ],
            self.experiment.seeds[0],
            self.on_note,
            both_ways=self.experiment.drives == "both-ways",
        )

    def _recorded_sessions(
        self, city: MapDrives, condition: Condition
    ) -> tuple[RecordingInfo, ...]:
        """Returns the recordings of a database of several."""
        names = condition.changes.get("database", {}).get(SESSIONS)
        if names is None:
            return ()
        where = f"{self.source}: database.{SESSIONS}"
        is_list = isinstance(names, list) and bool(names)
        if not (is_list and all(isinstance(one, str) for one in names)):
            raise InputError(f"{where}: not a list of names of recordings")
        return chosen_sessions(city, names, where)

    def _check_recordable(self, city: MapDrives) -> None:
        """Checks that conditions vary only the stage, as recordings require."""
        for condition in self._conditions:
            sides = {n: condition.changes.get(n, {}) for n in SIDES}
            given = [f"{side}.{name}" for side in sides for name in sides[side]]
            if SESSIONS in sides["database"]:
                given = [one for one in given if one not in _OF_RECORDINGS]
                if sides["both"]:
                    raise InputError(
                        f"{self.source}: {STAGE}: databases of several"
                        " recordings have no control"
                    )
            given += [CAUSE] if condition.causes else []
            for name in given:
                if name != STAGE:
                    name = next(
                        (n for n in condition.factors if n.startswith(name)),
                        name,
                    )
                    raise InputError(
                        f"{self.source}: {name}: the recordings of {city.name}"
                        " are as they are; simulated drives alone can vary it"
                    )
            stage = sides["both"].get("stage", OWN)
            if stage not in (OWN, LAST):
                raise InputError(
                    f"{self.source}: {STAGE}: {stage!r}: recordings have"
                    f" {OWN} and {LAST}"
                )

    def _protocol_of(self, condition: Condition) -> RetrievalProtocol:
        fields = condition.changes.get("protocol", {})
        return protocol_from_fields(fields, self.source)


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


def _base_name(database: Scenario) -> str:
    return database.name.removesuffix("_database")
