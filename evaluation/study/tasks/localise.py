"""The task `localise`: scans are localised in a map of the database."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from evaluation.base import InputError, Key, Reporter, file_digests
from evaluation.drives import JoinedSource
from evaluation.localisation import (
    KISS_MATCHER,
    METHODS,
    Starts,
    localisation_columns,
    localised,
    measure_localisation,
)
from evaluation.recognition import Number, numbers_of
from evaluation.study.pair import Pair
from evaluation.study.tasks.task import Answered, DataOf, Task, check_positive

# The methods that need no optional package.
SHIPPED = tuple(name for name in METHODS if name != KISS_MATCHER)


class LocaliseTask(Task):
    """Measures how well scans are aligned to a map from wrong initial poses.

    With the setting `odometry_drift`, whole drives are tracked; without this
    setting, single scans are aligned. The setting `estimator` contains settings
    of all registration methods.
    """

    name = "localise"
    defaults: ClassVar[Mapping[str, Any]] = {
        "methods": list(SHIPPED),
        "starts": [[2.0, 10.0]],
        "spacing": None,
        "seed": 0,
        "odometry_drift": None,
        "estimator": {},
    }

    def check(self, name: str, value: Any, where: str) -> None:
        if name in ("seed", "odometry_drift", "estimator"):
            _check(name, value, where)
        elif name == "spacing":
            check_positive(value, where)
        elif name == "methods":
            for one in value:
                known = str(one) in METHODS
                if not known and not Path(str(one)).is_file():
                    raise InputError(
                        f"{where}: {one!r} is neither"
                        f" {', '.join(METHODS)} nor a file"
                    )
        else:
            try:
                radii = [one.radius for one in self._starts(value)]
            except (TypeError, ValueError):
                radii = []
            except InputError as error:
                _, _, fault = str(error).partition(": ")
                raise InputError(f"{where}: {fault}") from None
            if not radii:
                raise InputError(
                    f"{where}: {value!r} is no list of [metres, degrees]"
                )
            if len(set(radii)) < len(radii):
                raise InputError(f"{where}: two starts at one distance")

    def _starts(self, values: Any) -> tuple[Starts, ...]:
        seed = self.settings["seed"]
        return tuple(Starts(float(r), float(turn), seed) for r, turn in values)

    def keys(self, pair: Pair) -> list[Key]:
        spacing = self.settings["spacing"] or pair.protocol.query_spacing
        made_of = {
            **pair.drives,
            **self.settings,
            "spacing": spacing,
            # Estimators of the user are identified by name and content.
            "methods": [Path(one).name for one in self.settings["methods"]],
            "files": file_digests(
                [one for one in self.settings["methods"] if _is_file(one)]
            ),
        }
        return [Key(self.name, made_of, self.version)]

    def compute(
        self, pair: Pair, data_of: DataOf, reporter: Reporter
    ) -> list[np.ndarray]:
        database = pair.database[0].source
        if pair.is_composed:
            sources = tuple(one.source for one in pair.database)
            database = JoinedSource(sources, pair.keep)
        return measure_localisation(
            reporter,
            database,
            pair.query.source,
            tuple(
                Path(one).absolute() if _is_file(one) else one
                for one in self.settings["methods"]
            ),
            self._starts(self.settings["starts"]),
            self.settings["spacing"] or pair.protocol.query_spacing,
            tuple(self.settings["estimator"].items()),
            self.settings["odometry_drift"],
        )

    def _named_results(
        self, found: Sequence[np.ndarray]
    ) -> Iterator[tuple[str, Any]]:
        """Yields name and localised queries per method and initial error."""
        starts = self.settings["starts"]
        rows = iter(found)
        if not found:
            return
        for method in self.settings["methods"]:
            stem = Path(method).stem if _is_file(method) else method
            for radius, _ in starts:
                far = f" from {radius:g} m" if len(starts) > 1 else ""
                yield f"{stem}{far}", next(rows)

    def numbers(
        self, found: Any, before: Any | None, compared: Any
    ) -> Iterator[Number]:
        then = dict(self._named_results(before or ()))
        for method, rows in self._named_results(found):
            base = then.get(method)
            yield from numbers_of(
                self.name,
                localised(rows),
                None if base is None else localised(base),
                method=method,
            )

    def answers(self, found: Any) -> Iterator[Answered]:
        for method, rows in self._named_results(found):
            yield method, False, localisation_columns(rows)


def _is_file(method: str) -> bool:
    return method.endswith(".py")


def _check(name: str, value: Any, where: str) -> None:
    """Checks a setting that has no list of values."""
    if name == "estimator":
        fits, wanted = isinstance(value, dict), "a mapping of settings"
    elif name == "seed":
        fits = type(value) is int and value >= 0
        wanted = "a whole number from 0 on"
    else:
        is_number = type(value) in (int, float)
        fits = value is None or (is_number and 0.0 <= value <= 1.0)
        wanted = "a share from 0 to 1"
    if not fits:
        raise InputError(f"{where}: {value!r} is not {wanted}")
