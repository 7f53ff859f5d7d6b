"""A pair of drives, as tasks measure it under a condition of an experiment."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any, Protocol

from evaluation.alignment import WorldVerdict
from evaluation.drives import DriveSource
from evaluation.recognition import KEEP_ALL, RetrievalProtocol, Role

# Length of a drive through a shipped city, about [m].
USUAL_LENGTH = 1400.0


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
        title: what drive it is, in words; by default its name.
        years: number of years by which its city has aged; None if it does not
            age.
    """

    name: str
    source: DriveSource
    needs: tuple[str, ...] = ()
    length: float = USUAL_LENGTH
    num_scans: float = math.inf
    title: str = ""
    years: int | None = None

    @property
    def share(self) -> float:
        """Its length as a share of `USUAL_LENGTH`."""
        return self.length / USUAL_LENGTH


class Result(Protocol):
    """The result of a job, such as a `Part`."""

    def read(self) -> Any:
        """Returns the result.

        Raises:
            InputError: the result cannot be read.
        """


@dataclass(frozen=True, eq=False)
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
        baseline: the factors of the condition with which this one is compared,
            which can be this condition itself; None to compare with nothing.
        stated: protocol that the tables name: the protocol of the experiment,
            before the condition changes its queries.
        key: name of the results. Two pairs have the same key only if they
            measure the same thing; only the radius of a match can differ.
        database, query: the drives.
        protocol: protocol of place recognition.
        distractors: number of places of other cities that are added to the
            database.
        beside: further drives in the same world, whose places are added to the
            database, from older to newer.
        keep: which places of these drives and of the database drive are kept,
            see `evaluation.recognition.place_selection.kept_places`.
        may_repeat: whether the pair can repeat drives of another pair, because
            its condition changes the queries (random yaw, tilt or occluded
            sector) or adds distractors. A task whose results depend only on the
            drives then skips the pair if it has measured these drives before.
        methods: names of the methods that are measured; None for all methods
            of the study.
        world: the world of the recordings; None for simulated drives.
    """

    map_name: str
    names: tuple[str, str]
    factors: Mapping[str, Any]
    seed: int
    baseline: Mapping[str, Any] | None
    stated: RetrievalProtocol
    key: str
    database: NamedDrive
    query: NamedDrive
    protocol: RetrievalProtocol
    distractors: int = 0
    beside: tuple[NamedDrive, ...] = ()
    keep: str | int = KEEP_ALL
    may_repeat: bool = False
    methods: Collection[str] | None = None
    world: WorldVerdict | None = None

    def has_method(self, name: str) -> bool:
        """Returns whether a method of the study is measured, by its name."""
        return self.methods is None or name in self.methods

    @property
    def title(self) -> str:
        """Both drives and the condition, in words."""
        drives = " in ".join(dict.fromkeys(reversed(self.names)))
        return factors_in_words(drives, self.factors.items())

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


def factors_in_words(name: str, factors: Iterable[tuple[str, Any]]) -> str:
    """Returns a name and the values of factors in words, to show progress."""
    values = (f"{key.rpartition('.')[2]} {v}" for key, v in factors)
    return ", ".join([name.replace("_", " "), *values])
