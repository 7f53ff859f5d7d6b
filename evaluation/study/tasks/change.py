"""The task `change`: how much the city changed between two drives."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from evaluation.base import Key, Reporter, Store
from evaluation.change import ChangeReport, DriveMap, change_of_maps
from evaluation.recognition import Asked, Map
from evaluation.study.pair import Pair, StudyDrive
from evaluation.study.tasks.task import DataOf, Task, check_positive


class ChangeTask(Task):
    """Measures the change (TCR_sym) between two drives or their cities.

    The query drive is compared with a drive on the same route through the
    database's city, so that only the city differs. If there is no such drive,
    the query drive is compared with the database drive.
    """

    name = "change"
    defaults: ClassVar[Mapping[str, Any]] = {"spacing": None}

    def check(self, name: str, value: Any, where: str) -> None:
        if value is not None:
            check_positive(value, where)

    def asks(
        self, pair: Pair, store: Store
    ) -> Iterator[tuple[StudyDrive, Asked]]:
        for drive in self._drives(pair):
            yield drive, Map(self.settings["spacing"])

    def keys(self, pair: Pair) -> list[Key]:
        drives = self._drives(pair)
        made_of = {
            "drives": [one.digest for one in drives],
            "spacing": self.settings["spacing"],
        }
        return [Key(self.name, made_of, self.version)] if drives else []

    def compute(
        self, pair: Pair, data_of: DataOf, reporter: Reporter
    ) -> ChangeReport:
        # Without the spread over shifted grids, which would take sixteen times
        # as long as all other computations.
        maps = (
            data_of(drive).take(Map(self.settings["spacing"]))
            for drive in self._drives(pair)
        )
        first, last = (
            DriveMap(one.name, one.voxels, one.X_WS[:, :3, 3]) for one in maps
        )
        return change_of_maps(first, last)

    def _drives(self, pair: Pair) -> tuple[StudyDrive, ...]:
        """Returns the two drives that are compared; none to measure nothing."""
        first = pair.database[0]
        closes_loops = (
            first == pair.query and pair.protocol.exclude_recent is not None
        )
        if closes_loops or pair.is_composed:
            return ()
        return pair.way or first, pair.query
