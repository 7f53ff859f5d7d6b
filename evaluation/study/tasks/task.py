"""The interface of a study's tasks, and the jobs that tasks share."""

import abc
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
import math
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np

from cns_drake.base.errors import InputError, did_you_mean
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.running import Job
from cns_drake.base.repetitions import repeated
from evaluation.recognition.describing import Role
from evaluation.recognition.kept_places import KEEP_ALL
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.result_number import Number
from evaluation.results.table import FROZEN_REDRAW
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.feature_extraction import (
    FeatureExtraction,
    map_source,
)
from evaluation.study.measurements import DescribedSource
from evaluation.study.parts import MakePart, Part
from evaluation.study.sources import DriveSource
from evaluation.study.study_files import StudyFiles

# Length of a drive through a shipped city, about [m].
USUAL_LENGTH = 1400.0
# Expected time to start a job and to open a drive [s].
OPENING_COST = 8.0
# Expected time to read a scan [s].
SCAN_COST = 0.011
# Expected time to map a drive with each of its scans [s].
_MAP_COST = 60.0
# Expected time of other work [s].
_OTHER_COST = 20.0


# A method, whether geometric verification was used, and answers to Q queries:
# column -> Q values.
Answered: TypeAlias = "tuple[str, bool, Mapping[str, np.ndarray]]"


@dataclass(frozen=True)
class NamedDrive:
    """A drive that is measured.

    Attributes:
        name: unique name of the drive.
        source: function that opens the drive.
        needs: names of the jobs that record the drive; empty if it is recorded
            already, or is simulated while it is read.
        length: about how long the drive is [m], to estimate costs.
        num_scans: number of the drive's scans, if known; at most this number of
            scans is described.
    """

    name: str
    source: DriveSource
    needs: tuple[str, ...] = ()
    length: float = USUAL_LENGTH
    num_scans: float = math.inf

    @property
    def share(self) -> float:
        """Its length as a share of `USUAL_LENGTH`."""
        return self.length / USUAL_LENGTH


class Result(Protocol):
    """The result of a job, such as a `Part`."""

    def read(self) -> Any:
        """Returns the result.

        Raises:
            InputError: it cannot be read.
        """


@dataclass(frozen=True)
class Held:
    """A result that is in memory instead of in a file."""

    value: Any

    def read(self) -> Any:
        """Returns the result."""
        return self.value


@dataclass(frozen=True)
class Pair:
    """Two drives that are measured under a condition of an experiment.

    The first fields are columns of the tables; the others determine what is
    measured.

    Attributes:
        map_name: name of the map.
        names: names of the database drive and of the query drive in tables. All
            conditions of the same two drives have the same names.
        factors: name -> value of each factor of the condition.
        seed: seed of everything that is random.
        is_baseline: whether other conditions are compared with this one.
        stated: protocol that the tables name: the protocol of the experiment,
            before the condition changes its queries.
        key: name of the results. Two pairs have the same key only if they
            measure the same thing; only the radius of a match can differ.
        database, query: the drives.
        way: drive along the query's route through the database's city, if there
            is one; otherwise the database drive. The change of the city
            (TCR_sym) is measured between this drive and the query drive.
        protocol: protocol of place recognition.
        distractors: number of places of other cities that are added to the
            database.
        beside: further drives in the same world, whose places are added to the
            database, from older to newer.
        keep: which places of these drives and of the database drive are kept,
            see `evaluation.recognition.kept_places.kept_places`.
        ages: for an aged city, the years that it has aged by at each drive of
            the database and at the query; empty if the city does not age.
        leaves_out_itself: whether a drive is compared with itself, and each
            scan with all other scans.
        may_repeat: whether the pair can repeat drives of another pair, because
            its condition changes the queries (random yaw, tilt or occluded
            sector) or adds distractors. A task whose results depend only on the
            drives then skips the pair if it has measured these drives before.
        settings: name -> value of settings outside of the protocol that change
            a number, such as the height of a LiDAR that differs from the
            methods' default.
        overlaps: (Q, D) overlap of each query with each place, if the protocol
            says that matches are by overlap; otherwise None.
        parts: task -> its results, as files or in memory, for the tasks that
            measure the pair.
    """

    map_name: str
    names: tuple[str, str]
    factors: Mapping[str, Any]
    seed: int
    is_baseline: bool
    stated: RetrievalProtocol
    key: str
    database: NamedDrive
    query: NamedDrive
    way: NamedDrive
    protocol: RetrievalProtocol
    distractors: int = 0
    beside: tuple[NamedDrive, ...] = ()
    keep: str | int = KEEP_ALL
    ages: tuple[int, ...] = ()
    leaves_out_itself: bool = False
    may_repeat: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    overlaps: np.ndarray | None = None
    parts: dict[str, tuple[Result, ...]] = field(default_factory=dict)

    @property
    def place(self) -> tuple[object, ...]:
        """Key of map, drives and protocol; each key has one baseline."""
        fixed = [
            (name, value)
            for name, value in self.factors.items()
            if name == FROZEN_REDRAW or name.startswith("protocol.")
        ]
        return self.map_name, self.names, *fixed

    @property
    def closes_loops(self) -> bool:
        """Whether a drive is compared with places that it passed before."""
        is_itself = self.database == self.query
        return is_itself and self.protocol.exclude_recent is not None

    @property
    def roles(self) -> tuple[tuple[NamedDrive, Role], ...]:
        """Both drives, each with its role: `places` or `queries`."""
        return (self.database, "places"), (self.query, "queries")

    @property
    def is_composed(self) -> bool:
        """Whether the database is anything but all places of one drive.

        A composed database has places of several drives, or only some places of
        one drive.
        """
        return bool(self.beside) or self.keep != KEEP_ALL

    @property
    def drives(self) -> tuple[object, ...]:
        """Names of the drives of database and query, and the field `keep`."""
        database = [one.name for one in (self.database, *self.beside)]
        return (*database, self.keep, self.query.name)


@dataclass
class Jobs:
    """The jobs of a study, and the data from which they are made.

    If several pairs of drives need the descriptors of the same drive, one job
    writes these descriptors to files.

    Attributes:
        files: paths of the study's files.
        methods: the methods that are run.
        distractors: drives through other cities, whose places are added to
            each database in this order.
        jobs: name -> job.
        notes: note -> None, for each note on what is left out. A dictionary
            keeps the order and omits repetitions.
        radii: key of a pair -> the greatest distances between a query and its
            match that are used for this pair [m].
        processes: number of processes that a task may use by itself.
        shows_overlaps: whether results contain the share of each query's scan
            that its best match shows. Computing this share takes time.
        leaves_out_slow: whether methods that would take more than an hour for a
            pair are left out.
    """

    shows_overlaps: ClassVar[bool] = True
    leaves_out_slow: ClassVar[bool] = True

    files: StudyFiles
    methods: tuple[MethodChoice, ...]
    distractors: Sequence[NamedDrive] = ()
    jobs: dict[str, Job] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    radii: dict[str, set[float]] = field(default_factory=dict)
    processes: int = 1
    # Descriptor -> keys of the pairs that need it.
    _uses: dict[str, set[str]] = field(default_factory=dict)

    def expect(self, pair: Pair) -> None:
        """Registers a pair of drives.

        Register all pairs before you call `described`, which must know how many
        pairs need the descriptors of a drive.
        """
        self.radii.setdefault(pair.key, set()).add(pair.protocol.radius)
        for drive, role in pair.roles:
            name = _description_name(drive, role, pair.protocol)
            self._uses.setdefault(name, set()).add(pair.key)

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        """Returns the source from which a job gets a drive's descriptors.

        If several pairs need the descriptors, this function adds a job that
        writes the descriptors, and returns the files: first the file with the
        scans, then a file for each method. If only one pair needs the
        descriptors, the function returns the source of the drive, and the job
        of this pair computes the descriptors itself.

        Args:
            drive: the drive.
            role: role of its scans, `places` or `queries`.
            protocol: protocol of the pair.
            needs: list to which the name of the added job is appended.
            kept: whether to write the files even if only one pair needs them.
        """
        name = _description_name(drive, role, protocol)
        if not (kept or len(self._uses.get(name, ())) > 1):
            needs += drive.needs
            return drive.source
        files = self.files.features(name)
        step = FeatureExtraction(
            drive.source,
            frozenset({role}),
            self.methods,
            protocol,
            files,
            with_scans=True,
            with_map=False,
        )
        job = f"describe {name}"
        cost = self.description_cost(drive, role, protocol)
        self.jobs[job] = Job(job, step, drive.needs, cost)
        needs.append(job)
        return (
            files.scans,
            *(files.described(one.key) for one in self.methods),
        )

    def description_cost(
        self, drive: NamedDrive, role: Role, protocol: RetrievalProtocol
    ) -> float:
        """Returns the expected time to describe a drive by all methods [s]."""
        made = [one.make() for one in self.methods]
        scans = max(map(protocol.scans, made), default=1)
        each = SCAN_COST * scans + sum(one.describe_time for one in made)
        return OPENING_COST + each * num_described(drive, role, protocol)

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        """Returns the file with a drive's map, and adds the job that makes it.

        Args:
            drive: the drive.
            spacing: distance along the path between two scans in the map [m];
                None for all scans.
            needs: list to which the name of the job is appended.
        """
        name = drive.name if spacing is None else f"{drive.name} {spacing:g}"
        part = self.files.part("mapped", name)
        needs.append(job_name(part))
        cost = _MAP_COST * drive.share if spacing is None else _OTHER_COST
        arguments = (drive.source, spacing)
        return self.add(part, map_source, arguments, drive.needs, cost)

    def beside(self, pair: Pair, needs: list[str]) -> list[tuple[Part, ...]]:
        """Returns the files of a pair's further drives in the same world.

        Args:
            pair: the pair.
            needs: list to which the names of the jobs are appended that write
                the files.

        Returns:
            For each drive, the file with the scans of its places, and one file
            per method with their descriptors.
        """
        found = []
        for drive in pair.beside:
            parts = self.described(
                drive, "places", pair.protocol, needs, kept=True
            )
            assert isinstance(parts, tuple)
            found.append(parts)
        return found

    def distractor_places(
        self, pair: Pair, needs: list[str]
    ) -> tuple[tuple[Part, ...], ...]:
        """Returns descriptors of drives through other cities, for a pair.

        Places of these drives are distractors: they enlarge the database.

        Args:
            pair: the pair; without distractors, the result is empty.
            needs: list to which the names of the jobs are appended that
                describe these drives.

        Returns:
            For each drive through another city, one file per method with the
            descriptors of its places.
        """
        if not pair.distractors:
            return ()
        found = []
        for drive in self.distractors:
            parts = self.described(
                drive, "places", pair.protocol, needs, kept=True
            )
            assert isinstance(parts, tuple)
            found.append(parts[1:])
        return tuple(found)

    def add(
        self,
        part: Part,
        function: Callable[..., object],
        arguments: tuple[object, ...],
        needs: Iterable[str] = (),
        cost: float = _OTHER_COST,
    ) -> Result:
        """Adds a job that writes a file of results; returns the file.

        The job is named by the file's folder and name.

        Args:
            part: the file.
            function: function whose result is written. The first argument of
                this function is a `Reporter`.
            arguments: further arguments of the function.
            needs: names of jobs that must be finished before.
            cost: approximate cost of the job [s].
        """
        name = job_name(part)
        step = MakePart(part, function, arguments)
        self.jobs[name] = Job(name, step, tuple(needs), cost)
        return part


def num_described(
    drive: NamedDrive, role: Role, protocol: RetrievalProtocol
) -> float:
    """Returns about how many places or queries a drive has."""
    spacing = protocol.place_spacing
    if role == "queries":
        spacing = protocol.query_spacing
    return min(drive.num_scans, drive.length / spacing)


def job_name(part: Part) -> str:
    """Returns the name of the job that `Jobs.add` adds for a file."""
    return f"{part.path.parent.name} {part.path.stem}"


def _description_name(
    drive: NamedDrive, role: Role, protocol: RetrievalProtocol
) -> str:
    options = protocol.descriptor_options(queries=role == "queries")
    return f"{drive.name} {role} {fingerprint(options)[:6]}"


class Task(abc.ABC):
    """A kind of measurement on two drives, such as place recognition.

    Attributes:
        name: name of the task in files and on the command line.
        asks: whether the results depend on the protocol of the queries and on
            the places of the database. Otherwise they depend only on the
            drives.
        defaults: name -> default value of each setting of the task.
        settings: name -> value of each setting.
    """

    name: ClassVar[str]
    asks: ClassVar[bool] = False
    defaults: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, settings: Mapping[str, Any], source: str):
        """Takes and checks the settings of the task.

        Args:
            settings: name -> value, for settings that differ from their
                defaults.
            source: file of the experiment, for error messages.

        Raises:
            InputError: a setting is unknown or of another type.
        """
        self.settings = {**self.defaults, **settings}
        for name, value in settings.items():
            where = f"{source}: tasks.{self.name}.{name}"
            if name not in self.defaults:
                known = ", ".join(self.defaults) or "none"
                raise InputError(
                    f"{where}: no such setting (there are: {known})"
                    f"{did_you_mean(name, self.defaults)}"
                )
            if name == "methods":
                value = self.settings[name] = _names(value, where)
            self.check(name, value, where)

    def check(self, name: str, value: Any, where: str) -> None:  # noqa: B027
        """Checks a setting of the task; by default every value is accepted.

        Args:
            name: name of the setting.
            value: its value.
            where: file and field of the setting, for error messages.

        Raises:
            InputError: the value is not usable.
        """

    @property
    def changed_settings(self) -> dict[str, Any]:
        """Name -> value of the settings that change a number.

        Settings that have their defaults are left out. The setting `methods`
        does not count, because each number belongs to one method.
        """
        return {
            f"{self.name}.{name}": value
            for name, value in self.settings.items()
            if name != "methods" and value != self.defaults[name]
        }

    @abc.abstractmethod
    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        """Adds the jobs that measure a pair of drives to `jobs`.

        Returns:
            The results: files that the jobs write, or objects in memory. There
            are none if the task does not apply to the pair.
        """

    def found(self, pair: Pair) -> Any:
        """Returns the task's result for a pair of drives that has one."""
        (part,) = pair.parts[self.name]
        return part.read()

    @abc.abstractmethod
    def numbers(self, found: Any, before: Any | None) -> Iterable[Number]:
        """Yields the results of a pair of drives, a `Number` for each metric.

        Args:
            found: the task's result for the pair.
            before: the task's result for the same drives in the baseline
                condition; None for the baseline itself, or if there is none.
        """

    def answers(self, found: Any) -> Iterable[Answered]:
        """Yields the answers of each method to all queries; by default none.

        Each item has three parts: the method; whether geometric verification
        was used (see `evaluation.recognition.geometric_verification`); and a
        mapping from columns of `queries.csv` to values (Q,).

        Args:
            found: the task's result for a pair of drives.
        """
        return ()


def _names(value: Any, where: str) -> list[str]:
    """Returns one or several names of methods as a list.

    Raises:
        InputError: there is no name, or two results would have the same name.
    """
    found = [value] if isinstance(value, str) else value
    if not (found and isinstance(found, list)):
        raise InputError(f"{where}: {value!r} is no list of names")
    for stem in repeated(Path(str(one)).stem for one in found):
        raise InputError(f"{where}: {stem!r} is there twice")
    return found


def positive(value: Any, where: str) -> None:
    """Checks that a setting is a positive number.

    Args:
        value: value of the setting.
        where: file and field of the setting, for error messages.

    Raises:
        InputError: the value is not a positive number.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and 0.0 < value < 1e6):
        raise InputError(f"{where}: {value!r} is not a positive number")
