"""Measures pairs of drives: first the drives are read, then all pairs measured.

A drive that several pairs need is read once, for all that they ask of it. Each
pair is measured in a process of its own. All that is found is in the store,
from which the tables are made.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

from evaluation.base import (
    Cluster,
    FailedJobsError,
    Job,
    Key,
    Reporter,
    Space,
    Step,
    Store,
    forecast,
    run_jobs,
)
from evaluation.recognition import Asked, DriveData
from evaluation.study.pair import Pair, StudyDrive
from evaluation.study.tasks.task import Task

# A drive, and what is asked of it.
DriveAsked: TypeAlias = tuple[StudyDrive, Asked]


def measure_pairs(
    pairs: Mapping[Pair, Sequence[Task]],
    shown: Iterable[DriveAsked],
    store: Store,
    cluster: Cluster,
    on_note: Callable[[str], None],
    space: Space | None = None,
) -> None:
    """Adds to a store what tasks find about pairs, as far as it is missing.

    Args:
        pairs: the pairs, each with the tasks that measure it.
        shown: what else is read of drives, for a page.
        store: the store.
        cluster: runs the jobs.
        on_note: is called with a note on many jobs.
        space: space on the disk that is needed, if known.

    Raises:
        InputError: drives could not be read, or pairs not be measured; the
            error names all of them.
    """
    left = [one for one in _alike(pairs, store) if not one.is_done()]
    asked = {one: tuple(one.asks()) for one in left}
    drives = _drives_of(asked, shown, store)
    readings = _jobs(
        (one.words, ReadDrive(one, data))
        for one, data in drives.values()
        if data.store is not None
    )
    steps = [
        replace(
            one,
            drives={drive.digest: drives[drive.digest][1] for drive, _ in some},
        )
        for one, some in asked.items()
    ]
    told = forecast([*readings, *_measurements(steps)], cluster, space)
    if told is not None:
        on_note(f"{told}; after an interruption, run the same command again")
    faults = []
    try:
        run_jobs(readings, cluster, "drives")
    except FailedJobsError as error:
        # All other pairs are measured nevertheless.
        faults.append(str(error))
        steps = [one for one in steps if not one.lacks_drives()]
    try:
        run_jobs(_measurements(steps), cluster, "pairs")
    except FailedJobsError as error:
        faults.append(str(error))
    if faults:
        raise FailedJobsError("; ".join(faults))


@dataclass(frozen=True, eq=False)
class ReadDrive(Step):
    """A job step that reads a drive for several pairs.

    Attributes:
        drive: the drive.
        data: what is asked of the drive, and the store.
    """

    drive: StudyDrive
    data: DriveData

    @property
    def words(self) -> str:
        return self.drive.words

    @property
    def output(self) -> Path:
        store, asked = self.data.store, self.data.asked
        assert store is not None
        return store.part(self.data.key(asked[0])).path

    def is_done(self) -> bool:
        return not self.data.missing()

    def run(self, reporter: Reporter) -> None:
        self.data.fill()


@dataclass(frozen=True, eq=False)
class MeasurePair(Step):
    """A job step that measures a pair of drives by all tasks.

    Attributes:
        pairs: the pair; several if they differ only in the radius of a match.
        tasks: the tasks.
        store: gets the results.
        drives: digest of a drive -> what is asked of it.
    """

    pairs: tuple[Pair, ...]
    tasks: tuple[Task, ...]
    store: Store
    drives: Mapping[str, DriveData] = field(default_factory=dict)

    @property
    def words(self) -> str:
        return self.pairs[0].title

    @property
    def output(self) -> Path:
        # Tasks lock the files of results that several pairs share.
        return (
            self.store.folder / "pairs" / next(self._keys(self.tasks[0])).digest
        )

    def is_done(self) -> bool:
        return not any(self._left())

    def run(self, reporter: Reporter) -> None:
        for task in self._left():
            task.measure(
                self.pairs,
                lambda drive: self.drives[drive.digest],
                self.store,
                reporter,
            )

    def asks(self) -> Iterator[DriveAsked]:
        """Yields what the tasks that are left ask of drives."""
        for task in self._left():
            for pair in self.pairs:
                yield from task.asks(pair, self.store)

    def lacks_drives(self) -> bool:
        """Returns whether a drive was to be read for it, and was not."""
        return any(
            one.store is not None and bool(one.missing())
            for one in self.drives.values()
        )

    def _left(self) -> Iterator[Task]:
        """Yields the tasks of which a result is not in the store."""
        for task in self.tasks:
            if not all(map(self.store.has, self._keys(task))):
                yield task

    def _keys(self, task: Task) -> Iterator[Key]:
        for pair in self.pairs:
            yield from task.keys(pair)


def _alike(
    measured: Mapping[Pair, Sequence[Task]], store: Store
) -> list[MeasurePair]:
    """Returns a step for all pairs that differ only in the radius of a match.

    Queries are scored once for all radii.
    """
    groups: dict[str, tuple[dict[Pair, None], dict[Task, None]]] = {}
    for one, tasks in measured.items():
        asked = f"{one.asked(with_radius=False)} {one.methods}"
        pairs, known = groups.setdefault(asked, ({}, {}))
        if tasks:
            pairs[one] = None
            known |= dict.fromkeys(tasks)
    return [
        MeasurePair(tuple(pairs), tuple(tasks), store)
        for pairs, tasks in groups.values()
        if tasks
    ]


def _drives_of(
    groups: Mapping[MeasurePair, Iterable[DriveAsked]],
    shown: Iterable[DriveAsked],
    store: Store,
) -> dict[str, tuple[StudyDrive, DriveData]]:
    """Returns the drives to read, by digest, with what is asked of them.

    What several pairs need, or what may not fit into memory, is in the store.

    Args:
        groups: the pairs, with what each asks of drives.
        shown: see `measure_pairs`.
    """
    asked: dict[str, tuple[StudyDrive, dict[Asked, None]]] = {}
    stored: set[str] = set()

    def ask(drive: StudyDrive, one: Asked) -> None:
        asked.setdefault(drive.digest, (drive, {}))[1][one] = None

    for group, some in groups.items():
        before = {*asked}
        for drive, one in some:
            if drive.digest in before:
                stored.add(drive.digest)
            ask(drive, one)
        pair = group.pairs[0]
        stored |= {one.digest for one in pair.distractors}
        if pair.is_composed:
            stored |= {one.digest for one in pair.database}
    for drive, one in shown:
        stored.add(drive.digest)
        ask(drive, one)
    found = {}
    for digest, (drive, every) in asked.items():
        data = DriveData(drive.source, tuple(every), digest, store)
        if digest not in stored and data.missing():
            data = replace(data, store=None)
        found[digest] = drive, data
    return found


def _measurements(steps: Iterable[MeasurePair]) -> list[Job]:
    return _jobs((one.words, one) for one in steps)


def _jobs(steps: Iterable[tuple[str, Step]]) -> list[Job]:
    """Returns jobs with the given names, numbered where two are equal."""
    known: Counter[str] = Counter()
    jobs = []
    for name, step in steps:
        known[name] += 1
        number = known[name]
        jobs.append(Job(f"{name} ({number})" if number > 1 else name, step))
    return jobs
