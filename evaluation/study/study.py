"""A study: an experiment, its methods and tasks, and its tables and page."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import functools
from functools import partial
import os
from pathlib import Path
from typing import Any

from evaluation.base import InputError, Space, Store, doing, errors_at, no_such
from evaluation.methods import SETTINGS, known_methods, optional_methods
from evaluation.recognition import (
    STANDARD,
    MethodChoice,
    RetrievalProtocol,
    choose_methods,
    choose_metrics,
)
from evaluation.results import (
    Answers,
    PageSection,
    PrintStyle,
    QueryRows,
    Results,
    Row,
    as_factor,
    chart_factors,
    check_factors,
    check_metric_names,
    check_output,
    made_by,
    make_output,
    write_page,
    write_tables,
)
from evaluation.study.experiments.experiment import (
    Condition,
    Experiment,
    baseline_values,
    condition_protocol,
    levels_by_case,
)
from evaluation.study.experiments.experiment_run import ExperimentRun
from evaluation.study.experiments.factors import FLEET, SESSIONS
from evaluation.study.experiments.method_variants import method_variants
from evaluation.study.pair import Pair
from evaluation.study.run import DriveAsked, measure_pairs
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.map import MapTask
from evaluation.study.tasks.place import CostTask, PlaceTask
from evaluation.study.tasks.task import Task


@dataclass
class Study(ExperimentRun):
    """An experiment that is run.

    First call `choose`, then `measure` with the pairs of all maps.

    Attributes:
        tasks: name -> task.
        methods: key of a method -> the method, and the columns of its
            settings.
    """

    tasks: dict[str, Task] = field(default_factory=dict)
    methods: dict[str, tuple[MethodChoice, Mapping[str, Any]]] = field(
        default_factory=dict
    )

    @property
    def store(self) -> Store:
        """The store of everything that is read and measured."""
        return Store(self.output / "parts")

    @property
    def figures(self) -> Path:
        """The folder of all figures."""
        return self.output / "figures"

    def choose(
        self,
        known: Mapping[str, type[Task]],
        methods: Sequence[MethodChoice] | None = None,
    ) -> None:
        """Chooses the tasks and methods of the experiment.

        What is quick to check comes before all slow work.

        Args:
            known: name -> class of all tasks.
            methods: the methods, if they are not those that the experiment
                names.

        Raises:
            InputError: a task, method, metric, setting or chart cannot be
                used, or the folder is refused.
        """
        with errors_at(f"{self.source}: metrics"):
            metrics = choose_metrics(self.experiment.metrics)
            check_metric_names(metrics, self.experiment.factor_names)
        wanted = self._wanted_tasks()
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"{self.source}: tasks: {no_such('task', name, known)}"
                )
        if methods is not None:
            self.methods = {one.key: (one, one.columns) for one in methods}
        else:
            with errors_at(f"{self.source}: methods", "--method: "):
                self.methods = _chosen_methods(self.experiment)
        choices = [choice for choice, _ in self.methods.values()]
        self.tasks = {
            name: known[name](settings, self.source, choices)
            for name, settings in wanted.items()
        }
        self._check_charts()
        check_study_output(self.output)
        self._note_lower_levels()

    @property
    def protocols(self) -> list[RetrievalProtocol]:
        """Each protocol once, in the order of the conditions."""
        return list(
            dict.fromkeys(
                condition_protocol(one, self.source)
                for one in self.experiment.conditions
            )
        )

    def _wanted_tasks(self) -> Mapping[str, Mapping[str, Any]]:
        """Returns the experiment's tasks with their settings.

        If a database has several drives, a study of place recognition also
        measures the cost of the methods.
        """
        wanted = self.experiment.tasks
        if not any(map(_has_several, self.experiment.conditions)):
            return wanted
        for name in (MapTask.name, ChangeTask.name):
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

    def _check_charts(self) -> None:
        """Checks the metrics, and the settings of methods, that charts show.

        `load_experiment` has checked all other factors. A setting of a method
        that this run leaves out is known, too.
        """
        chosen = {choice.name for choice, _ in self.methods.values()}
        settings = (n for _, columns in self.methods.values() for n in columns)
        factors = [
            *(
                name
                for name in self.experiment.factor_names
                if not name.startswith(SETTINGS)
            ),
            *dict.fromkeys(settings),
        ]
        left_out = tuple(
            f"{SETTINGS}{method}." for method in {*known_methods()} - chosen
        )
        for chart in self.experiment.charts:
            with errors_at(self.source):
                axes = chart.get("x"), chart.get("y")
                names = [
                    name
                    for name in chart_factors(chart)
                    if name in axes
                    or (
                        name.startswith(SETTINGS)
                        and not name.startswith(left_out)
                    )
                ]
                check_factors(chart, names, factors)
                with errors_at(f"charts: {chart['kind']}"):
                    choose_metrics(
                        [chart[n] for n in ("metric",) if n in chart]
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

    def measure(
        self,
        pairs: Sequence[Pair],
        shown: Sequence[DriveAsked] = (),
        space: Space | None = None,
    ) -> tuple[Results, QueryRows]:
        """Measures all pairs, writes both tables, and returns the tables.

        Args:
            pairs: the pairs of all maps.
            shown: what else is read of the drives, for the page.
            space: space on the disk that is needed, if known.

        Raises:
            InputError: a step failed, nothing could be measured, or a file
                cannot be written.
        """
        for text in dict.fromkeys(
            text for task in self.tasks.values() for text in task.notes()
        ):
            self.on_note(text)
        make_output(self.output, ["page"])
        doing("looking at what is measured already")
        measured = self._measured(pairs)
        measure_pairs(
            measured, shown, self.store, self.cluster, self.on_note, space
        )
        doing("writing the tables")
        tables = self.tables(measured)
        if not tables[0].rows:
            raise InputError(
                f"{self.experiment.name}: nothing could be measured; the notes"
                " say why"
            )
        write_tables(self.output, *tables)
        return tables

    def _measured(self, pairs: Iterable[Pair]) -> dict[Pair, list[Task]]:
        found: dict[Pair, list[Task]] = {one: [] for one in pairs}
        for task in self.tasks.values():
            seen: set[tuple[str, str]] = set()
            for one in found:
                drives = one.map_name, str(one.drives)
                is_new = not one.may_repeat or drives not in seen
                if (task.is_of_queries or is_new) and task.keys(one):
                    found[one].append(task)
                seen.add(drives)
        return found

    def write_page(
        self,
        results: Results,
        queries: QueryRows,
        pairs: Iterable[Pair],
        notes: Sequence[str],
        sections: Sequence[PageSection] = (),
        *,
        about: str | None = None,
        own_methods: Sequence[str] = (),
        printed: PrintStyle | None = None,
    ) -> Path:
        """Writes the page of the study, and returns its path.

        Args:
            results, queries: the tables.
            pairs: the pairs that were measured.
            notes: lines for the end of the page.
            sections: further sections of the page.
            about: the question, if it is not that of the experiment.
            own_methods: methods that are shown beside shipped results.
            printed: style of the charts for print; None for the default.

        Raises:
            InputError: the page cannot be written.
        """
        experiment = self.experiment
        return write_page(
            results,
            queries,
            self.output,
            title=experiment.name,
            about=experiment.about if about is None else about,
            charts=experiment.charts,
            metrics=choose_metrics(experiment.metrics),
            experiment_text=experiment.text,
            notes=[*_worlds(pairs), *notes],
            sections=sections,
            own_methods=own_methods,
            printed=printed,
            on_note=self.on_note,
        )

    def tables(
        self, measured: Mapping[Pair, Sequence[Task]]
    ) -> tuple[Results, QueryRows]:
        """Returns the tables of results and of queries of measured pairs.

        Args:
            measured: the pairs, each with the tasks that measured it.

        Raises:
            InputError: a result is missing in the store.
        """
        store = self.store
        rows: list[Row] = []
        answers: list[Answers] = []
        # The pairs by map, drives and factors, each by its seed.
        by_condition: dict[tuple, dict[int, Pair]] = {}
        for one in measured:
            condition = _condition(one, one.factors)
            by_condition.setdefault(condition, {})[one.seed] = one
        baselines: dict[tuple[Pair, str], Any] = {}
        named = baseline_values(self.experiment)
        baseline = "; ".join(f"{n}={v}" for n, v in named.items())
        compared = _method_baselines(self.methods, named)
        for one, tasks in measured.items():
            alike = {}
            if one.baseline is not None:
                alike = by_condition.get(_condition(one, one.baseline), {})
            base = alike.get(one.seed) or next(iter(alike.values()), None)
            for task in tasks:
                found = task.found(one, store)
                before = found if base is one else None
                if base is not None and base is not one:
                    key = base, task.name
                    if key not in baselines and task in measured[base]:
                        baselines[key] = task.found(base, store)
                    before = baselines.get(key)
                columns = functools.cache(partial(self._columns, one, task))
                world = one.world.state if one.world else ""
                for number in task.numbers(found, before, compared):
                    own = columns(number.method, number.verified)
                    rows.append(
                        Row.of(number, baseline=baseline, world=world, **own)
                    )
                for method, verified, given in task.answers(found):
                    own = columns(method, verified)
                    answers.append(Answers(**own, columns=given))
        return Results.of(rows), QueryRows.of(answers)

    def _columns(
        self, one: Pair, task: Task, method: str, verified: bool
    ) -> dict[str, Any]:
        factors = {name: as_factor(v) for name, v in one.factors.items()}
        settings = dict(task.changed_settings)
        if method in self.methods:
            choice, columns = self.methods[method]
            method = choice.name
            factors |= {name: as_factor(v) for name, v in columns.items()}
            # A text on the command line and a number in a file are the same.
            settings |= {
                name: float(str(value))
                for name, value in choice.settings
                if name == "sensor_height"
            }
        database, query = one.names
        return {
            "experiment": self.experiment.name,
            "map": one.map_name,
            "database": database,
            "query": query,
            "seed": one.seed,
            "factors": factors,
            "task": task.name,
            "method": method,
            "verified": verified,
            **made_by(one.stated, settings),
        }


def _worlds(pairs: Iterable[Pair]) -> list[str]:
    """Returns what the page says of the worlds of recordings."""
    found = (
        f"World of {one.map_name}: {one.world.why}."
        for one in pairs
        if one.world is not None
    )
    return list(dict.fromkeys(found))


def check_study_output(output: Path) -> None:
    """Checks before all work what stands in the way of a study's files.

    Args:
        output: folder of the study.

    Raises:
        InputError: `check_output` refuses the folder, or a file has the name of
            one of its folders.
    """
    check_output(output, ["page"])
    for folder in (output / "parts", output / "figures"):
        if os.path.lexists(folder) and not folder.is_dir():
            raise InputError(f"{folder}: not a folder")


def _condition(one: Pair, factors: Mapping[str, Any]) -> tuple[object, ...]:
    """Returns the key of a pair's drives in the condition of some factors."""
    return one.map_name, one.names, frozenset(factors.items())


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


def _chosen_methods(
    experiment: Experiment,
) -> dict[str, tuple[MethodChoice, Mapping[str, Any]]]:
    """Returns the chosen methods by key, each with columns of its settings."""
    files = [
        Path(one) for one in experiment.methods or () if one.endswith(".py")
    ]
    known = {one.name: one for one in choose_methods([STANDARD, *files])}
    variants = experiment.method_variants
    if experiment.methods is None:
        variants = method_variants({name: {} for name in known})
    known |= {name: MethodChoice(name) for name in optional_methods()}
    found: dict[str, tuple[MethodChoice, Mapping[str, Any]]] = {}
    for name, settings, given in variants:
        place = f"methods.{name}."
        if name.endswith(".py"):
            path = Path(name).absolute()
            name = next(n for n, one in known.items() if one.file == path)
        if name not in known:
            raise InputError(no_such("method", name, known))
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
