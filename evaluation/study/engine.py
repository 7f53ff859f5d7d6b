"""Measures pairs of drives by tasks and methods, and writes two tables."""

from collections.abc import (
    Callable,
    Collection,
    Mapping,
    MutableMapping,
    Sequence,
)
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cns_drake.base import (
    Cluster,
    InputError,
    Job,
    Space,
    did_you_mean,
    doing,
    forecast,
    run_jobs,
)
from evaluation.results import (
    Answers,
    QueryRows,
    Results,
    Row,
    as_factor,
    made_by,
    make_output,
    write_tables,
)
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import NamedDrive, Pair
from evaluation.study.tasks.task import Task

# What a study takes is told if it takes longer, as costs of jobs say [s].
_LONG = 60.0


@dataclass
class Engine:
    """Measures pairs of drives by tasks and methods.

    Add all pairs of each map with `add`, then call `run`. If you run `jobs`
    together with other jobs, call `write_tables` when all jobs are done.

    Attributes:
        experiment: name of the experiment, a column of the tables.
        tasks: name -> task.
        methods: key of a method -> the method, and the columns of its
            settings.
        output: folder of the results.
        on_note: is called with notes on what is left out, and on how long the
            study takes.
        baseline: the values of factors that the experiment names for its
            baselines, a column of the table of results; "" for the first
            values.
        jobs: name -> job.
        pictures: name -> job that draws from the files of other jobs. They run
            once the tables are written, so that a picture that cannot be drawn
            takes no number along.
        measured: all comparisons.
    """

    experiment: str
    tasks: Mapping[str, Task]
    methods: MutableMapping[str, tuple[MethodChoice, Mapping[str, Any]]]
    output: Path
    on_note: Callable[[str], None] = lambda text: None
    baseline: str = ""
    jobs: dict[str, Job] = field(default_factory=dict)
    pictures: dict[str, Job] = field(default_factory=dict)
    measured: list[Pair] = field(default_factory=list)
    _notes: dict[str, None] = field(default_factory=dict)

    def add(
        self,
        comparisons: Sequence[Pair],
        distractors: Sequence[NamedDrive] = (),
        make_jobs: Callable[..., Jobs] = Jobs,
        tasks: Collection[str] | None = None,
    ) -> Jobs:
        """Adds the jobs of all comparisons on one map, and returns the jobs.

        Args:
            comparisons: the comparisons.
            distractors: drives through other cities, whose places are added to
                databases in this order.
            make_jobs: class of the jobs, which says how drives are read.
            tasks: names of the tasks that measure these comparisons; by default
                all tasks.
        """
        planned = make_jobs(
            StudyFiles(self.output),
            tuple(choice for choice, _ in self.methods.values()),
            distractors,
        )
        if any(task.asks for task in self.tasks.values()):
            for one in comparisons:
                planned.expect(one)
        for name, task in self.tasks.items():
            if tasks is not None and name not in tasks:
                continue
            seen: set[tuple[object, ...]] = set()
            for one in comparisons:
                is_new = not one.may_repeat or one.drives not in seen
                if (task.asks or is_new) and (
                    parts := task.measure(one, planned)
                ):
                    one.parts[name] = parts
                seen.add(one.drives)
        self.jobs |= planned.jobs
        self._notes |= planned.notes
        self.measured += comparisons
        return planned

    def run(
        self, cluster: Cluster, space: Space | None = None
    ) -> tuple[Results, QueryRows]:
        """Runs all jobs, writes both tables, and returns the tables.

        Args:
            cluster: runs the jobs.
            space: space on the disk that the jobs need, if known.

        Raises:
            InputError: a step failed, or a file cannot be written.
        """
        for text in self._notes:
            self.on_note(text)
        make_output(self.output, ["page"])
        jobs = list(self.jobs.values())
        pictures = list(self.pictures.values())
        told = forecast([*jobs, *pictures], cluster, space, least=_LONG)
        if told is not None:
            self.on_note(
                f"{told}; after an interruption, run the same command again"
            )
        run_jobs(jobs, cluster)
        doing("writing the tables")
        tables = self.tables()
        if not tables[0].rows:
            raise InputError(
                f"{self.experiment}: nothing could be measured; the notes say"
                " why"
            )
        write_tables(self.output, *tables)
        if pictures:
            run_jobs(pictures, cluster)
        doing("writing the page")
        return tables

    def write_tables(self) -> tuple[Results, QueryRows]:
        """Writes both tables of finished jobs, and returns the tables.

        Raises:
            InputError: a job has not been done, or a file cannot be written.
        """
        tables = self.tables()
        write_tables(self.output, *tables)
        return tables

    def tables(self) -> tuple[Results, QueryRows]:
        """Returns the tables of results and of queries of finished jobs.

        Raises:
            InputError: a job has not been done.
        """
        rows: list[Row] = []
        answers: list[Answers] = []
        by_condition = self._pairs_by_condition()
        baselines: dict[tuple[int, str], Any] = {}
        for one in self.measured:
            alike = {}
            if one.baseline is not None:
                alike = by_condition.get(_condition(one, one.baseline), {})
            base = alike.get(one.seed) or next(iter(alike.values()), None)
            for name in one.parts:
                task = self.tasks[name]
                found = self.found(one, name)
                before = found if base is one else None
                if base is not None and base is not one and name in base.parts:
                    of_base = id(base), name
                    if of_base not in baselines:
                        baselines[of_base] = self.found(base, name)
                    before = baselines[of_base]
                for number in task.numbers(found, before):
                    key = self._key(one, name, number.method, number.verified)
                    rows.append(Row.of(number, baseline=self.baseline, **key))
                for method, verified, columns in task.answers(found):
                    key = self._key(one, name, method, verified)
                    answers.append(Answers(**key, columns=columns))
        return Results.of(rows), QueryRows.of(answers)

    def _pairs_by_condition(self) -> dict[tuple, dict[int, Pair]]:
        """Returns the pairs by map, drives and factors, each by its seed."""
        found: dict[tuple, dict[int, Pair]] = {}
        for one in self.measured:
            found.setdefault(_condition(one, one.factors), {})[one.seed] = one
        return found

    def found(self, one: Pair, task: str) -> Any:
        """Returns a task's result for a pair; the pair's jobs must be done.

        Raises:
            InputError: the file of the result cannot be read.
        """
        return self.tasks[task].found(one)

    def _key(
        self, one: Pair, task: str, method: str, verified: bool
    ) -> dict[str, Any]:
        factors = {name: as_factor(v) for name, v in one.factors.items()}
        settings = dict(self.tasks[task].changed_settings)
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
            "experiment": self.experiment,
            "map": one.map_name,
            "database": database,
            "query": query,
            "seed": one.seed,
            "factors": factors,
            "task": task,
            "method": method,
            "verified": verified,
            **made_by(one.stated, settings),
        }


def _condition(one: Pair, factors: Mapping[str, Any]) -> tuple[object, ...]:
    """Returns the key of a pair's drives in the condition of some factors."""
    return one.map_name, one.names, frozenset(factors.items())


def made_tasks(
    wanted: Mapping[str, Mapping[str, Any]],
    known: Mapping[str, type[Task]],
    source: str,
) -> dict[str, Task]:
    """Returns the tasks by name, each with its settings.

    Args:
        wanted: name of a task -> its settings.
        known: name -> class of all tasks.
        source: file of the experiment, for error messages.

    Raises:
        InputError: a task is unknown, or a setting is not usable.
    """
    tasks = {}
    for name, settings in wanted.items():
        if name not in known:
            raise InputError(
                f"{source}: tasks: no task {name!r} (there are:"
                f" {', '.join(known)}){did_you_mean(name, known)}"
            )
        tasks[name] = known[name](settings, source)
    return tasks
