"""The interface of a study's tasks."""

import abc
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np

from evaluation.base import InputError, no_such, repeated
from evaluation.recognition import Number, numbers_of
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import Pair, Result

# A method, whether geometric verification was used, and answers to Q queries:
# column -> Q values.
Answered: TypeAlias = "tuple[str, bool, Mapping[str, np.ndarray]]"


class Task(abc.ABC):
    """A kind of measurement on two drives, such as place recognition.

    Attributes:
        name: name of the task in files and on the command line.
        version: counts the changes of the task's results for the same inputs.
            Raise it with each such change: results of other versions are
            computed again.
        asks: whether the results depend on the protocol of the queries and on
            the places of the database. Otherwise they depend only on the
            drives.
        defaults: name -> default value of each setting of the task.
        settings: name -> value of each setting.
    """

    name: ClassVar[str]
    version: ClassVar[int] = 1
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
                fault = no_such("setting", name, self.defaults)
                raise InputError(f"{where}: {fault}")
            if name == "methods":
                value = self.settings[name] = _method_names(value, where)
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
        """The settings that change a result: a mapping from name to value.

        Settings that have their defaults are left out. The setting `methods`
        does not count, because each result belongs to one method.
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

    def found(self, pair: Pair, results: Sequence[Result]) -> Any:
        """Returns the task's result for a pair of drives.

        Args:
            pair: the pair.
            results: what `measure` returned for the pair; its jobs are done.

        Raises:
            InputError: a file cannot be read.
        """
        (part,) = results
        return part.read()

    def numbers(self, found: Any, before: Any | None) -> Iterable[Number]:
        """Yields the results of a pair of drives, a `Number` for each metric.

        By default `found` has the values of the metrics of the task.

        Args:
            found: the task's result for the pair.
            before: the task's result for the same drives in the baseline;
                `found` itself if the pair is the baseline, None if there is no
                baseline.
        """
        return numbers_of(self.name, found, before)

    def answers(self, found: Any) -> Iterable[Answered]:
        """Yields the answers of each method to all queries; by default none.

        Each item has three parts: the method; whether geometric verification
        was used (see `evaluation.recognition.geometric_verification`); and a
        mapping from columns of `queries.csv` to values (Q,).

        Args:
            found: the task's result for a pair of drives.
        """
        return ()


def _method_names(value: Any, where: str) -> list[str]:
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


def check_positive(value: Any, where: str) -> None:
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
