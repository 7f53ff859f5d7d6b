"""A pair of drives, as tasks measure it under a condition of an experiment."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from evaluation.alignment import WorldVerdict
from evaluation.base import fingerprint
from evaluation.drives import DriveSource
from evaluation.recognition import KEEP_ALL, RetrievalProtocol


@dataclass(frozen=True)
class StudyDrive:
    """A drive that is measured.

    Attributes:
        name: unique name of the drive.
        source: function that opens the drive.
        title: what drive it is, in words; by default its name.
        years: number of years by which its city has aged; None if it does not
            age.
    """

    name: str
    source: DriveSource
    title: str = ""
    years: int | None = None

    @cached_property
    def digest(self) -> str:
        """Digest of what identifies the drive.

        Raises:
            InputError: there is no drive.
        """
        return fingerprint({"drive": self.source.identity()})

    @property
    def words(self) -> str:
        """What drive it is, in words."""
        return self.title or self.name.replace("_", " ")


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
        database: the drives of the database, all in the query's world, from
            older to newer.
        query: the drive of the queries.
        protocol: protocol of place recognition.
        distractors: drives through other cities, of which the first
            `num_distractors` places are added to the database.
        num_distractors: number of these places.
        keep: which places of the database are kept, see
            `evaluation.recognition.place_selection.kept_places`.
        way: the drive on the query's route through the database's city, with
            which the task `change` compares the query; None for the drive of
            the database.
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
    database: tuple[StudyDrive, ...]
    query: StudyDrive
    protocol: RetrievalProtocol
    distractors: tuple[StudyDrive, ...] = ()
    num_distractors: int = 0
    keep: str | int = KEEP_ALL
    way: StudyDrive | None = None
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
    def is_composed(self) -> bool:
        """Whether the database is anything but all places of one drive.

        A composed database has places of several drives, or only some places of
        one drive.
        """
        return len(self.database) > 1 or self.keep != KEEP_ALL

    @property
    def drives(self) -> dict[str, object]:
        """What identifies the database and the query."""
        return {
            "database": [one.digest for one in self.database],
            "keep": self.keep,
            "query": self.query.digest,
        }

    def asked(self, *, with_radius: bool = True) -> dict[str, object]:
        """Returns what identifies the answers to the queries, but the method.

        Args:
            with_radius: whether the radius of a match counts.
        """
        protocol = self.protocol.to_json()
        if not with_radius:
            del protocol["radius"]
        return {
            **self.drives,
            "protocol": protocol,
            "distractors": [one.digest for one in self.distractors],
            "num_distractors": self.num_distractors,
        }


def factors_in_words(name: str, factors: Iterable[tuple[str, Any]]) -> str:
    """Returns a name and the values of factors in words, to show progress."""
    values = (f"{key.rpartition('.')[2]} {v}" for key, v in factors)
    return ", ".join([name.replace("_", " "), *values])
