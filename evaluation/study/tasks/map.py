"""The task `map`, without the simulation of its drives: scores of labels."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from evaluation.base import InputError, no_such
from evaluation.map_update import BASELINES, TRUTH, MapScores
from evaluation.recognition import Number, numbers_of
from evaluation.study.tasks.task import Task, check_positive


class MapTask(Task):
    """Scores change detectors, which label points as kept, gone or new."""

    name = "map"
    defaults: ClassVar[Mapping[str, Any]] = {"methods": None, "spacing": 5.0}

    def check(self, name: str, value: Any, where: str) -> None:
        if name == "spacing":
            check_positive(value, where)
            return
        known = (TRUTH, *BASELINES)
        for one in value:
            if one not in known:
                raise InputError(f"{where}: {no_such('method', one, known)}")

    def numbers(
        self, found: Mapping[str, MapScores], before: Any, compared: Any
    ) -> Iterator[Number]:
        for method, one in found.items():
            yield from numbers_of(self.name, one, method=method)
