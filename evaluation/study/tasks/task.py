"""The interface of a study's tasks."""

import abc
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np

from evaluation.base import InputError, Key, Reporter, Store, no_such, repeated
from evaluation.recognition import (
    Asked,
    DriveData,
    MethodChoice,
    Number,
    numbers_of,
)
from evaluation.study.pair import Pair, StudyDrive

# A function that returns what has been asked of a drive.
DataOf: TypeAlias = Callable[[StudyDrive], DriveData]
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
        is_of_queries: whether the results depend on the protocol of the queries
            and on the places of the database. Otherwise they depend only on the
            drives.
        defaults: name -> default value of each setting of the task.
        settings: name -> value of each setting.
        methods: the methods of place recognition that the study runs.
    """

    name: ClassVar[str]
    version: ClassVar[int] = 1
    is_of_queries: ClassVar[bool] = False
    defaults: ClassVar[Mapping[str, Any]] = {}

    def __init__(
        self,
        settings: Mapping[str, Any],
        source: str,
        methods: Sequence[MethodChoice] = (),
    ):
        """Takes and checks the settings of the task.

        Args:
            settings: name -> value, for settings that differ from their
                defaults.
            source: file of the experiment, for error messages.
            methods: the methods of place recognition that the study runs.

        Raises:
            InputError: a setting is unknown or of another type.
        """
        self.settings = {**self.defaults, **settings}
        self.methods = tuple(methods)
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

    def notes(self) -> Iterable[str]:
        """Yields notes for the user on what the task leaves out."""
        return ()

    def asks(
        self, pair: Pair, store: Store
    ) -> Iterable[tuple[StudyDrive, Asked]]:
        """Yields drives, and what is asked of them for results not in a store.

        By default a task opens its drives by itself.
        """
        return ()

    @abc.abstractmethod
    def keys(self, pair: Pair) -> Sequence[Key]:
        """Returns the keys of the task's results for a pair of drives.

        There are none if the task does not apply to the pair.
        """

    def measure(
        self,
        pairs: Sequence[Pair],
        data_of: DataOf,
        store: Store,
        reporter: Reporter,
    ) -> None:
        """Adds the results that are missing to the store.

        It is called only if some are missing. By default a task has one result,
        which `compute` returns.

        Args:
            pairs: pairs that differ only in the radius of a match.
            data_of: returns what `asks` has asked of a drive.
            store: the store.
            reporter: reports progress and notes.

        Raises:
            InputError: a drive cannot be read, or a method fails.
        """
        (key,) = self.keys(pairs[0])
        store.write(key, self.compute(pairs[0], data_of, reporter))

    def compute(
        self, pair: Pair, data_of: DataOf, reporter: Reporter
    ) -> object:
        """Returns the only result; a task with several defines `measure`."""
        raise NotImplementedError

    def found(self, pair: Pair, store: Store) -> Any:
        """Returns the task's result for a pair of drives, once it is measured.

        Raises:
            InputError: a file cannot be read.
        """
        (key,) = self.keys(pair)
        return store.read(key)

    def numbers(
        self, found: Any, before: Any | None, compared: Mapping[str, str]
    ) -> Iterable[Number]:
        """Yields the results of a pair of drives, a `Number` for each metric.

        By default `found` has the values of the metrics of the task.

        Args:
            found: the task's result for the pair.
            before: the task's result for the same drives in the baseline;
                `found` itself if the pair is the baseline, None if there is no
                baseline.
            compared: key of a method of place recognition -> key of the method
                with which the baseline compares it.
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
    """Returns one or several names of methods as a list."""
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
