"""The task `change`: how much the city changed between two drives."""

from collections.abc import Mapping
from typing import Any, ClassVar

from evaluation.base import Reporter
from evaluation.change import ChangeReport, DriveMap, change_of_maps
from evaluation.recognition import DriveSummary
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import NamedDrive, Pair, Result
from evaluation.study.tasks.task import Task, check_positive

# Expected time to compare two maps [s].
_COST = 0.5


class ChangeTask(Task):
    """Measures the change (TCR_sym) between two drives or their cities.

    The query drive is compared with a drive on the same route through the
    database's city, so that only the city differs. If there is no such drive,
    the query drive is compared with the database drive.

    Attributes:
        ways: pair -> the drive on the query's route through the database's
            city, if it is another than the database drive.
    """

    ways: Mapping[Pair, NamedDrive] = {}
    name = "change"
    defaults: ClassVar[Mapping[str, Any]] = {"spacing": None}

    def check(self, name: str, value: Any, where: str) -> None:
        if value is not None:
            check_positive(value, where)

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        closes_loops = (
            pair.database == pair.query
            and pair.protocol.exclude_recent is not None
        )
        if closes_loops or pair.is_composed:
            return ()
        way = self.ways.get(pair, pair.database)
        needs: list[str] = []
        maps = tuple(
            jobs.mapped(drive, self.settings["spacing"], needs)
            for drive in (way, pair.query)
        )
        # The change does not depend on the protocol.
        part = jobs.files.part("change", way.name, pair.query.name)
        found = jobs.add(
            part, measure_change, maps, needs, _COST, self.version, pair.title
        )
        return (found,)


def measure_change(
    reporter: Reporter, first: Result, second: Result
) -> ChangeReport:
    """Returns how much changed between two drives.

    The result does not contain the spread over shifted grids, which would take
    sixteen times as long as all other computations.

    Args:
        reporter: reports progress.
        first, second: files with the maps of the two drives: a `DriveMap`, or a
            `DriveSummary`.
    """
    maps = (part.read() for part in (first, second))
    a, b = (
        DriveMap(one.name, one.coarse, one.X_WS[:, :3, 3])
        if isinstance(one, DriveSummary)
        else one
        for one in maps
    )
    return change_of_maps(a, b)
