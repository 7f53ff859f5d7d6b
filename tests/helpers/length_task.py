"""A task of studies, and a drive that cannot be read."""

from dataclasses import dataclass

from evaluation.base import InputError, Key
from evaluation.recognition import Map
from evaluation.study import Task


@dataclass(frozen=True)
class Unreadable:
    """The source of a drive that is there, and cannot be read."""

    def __call__(self):
        raise InputError("FILE: cannot be read")

    def identity(self):
        return "unreadable"


class LengthTask(Task):
    """Counts the frames of both drives."""

    name = "length"

    def asks(self, pair, store):
        for drive in (*pair.database, pair.query):
            yield drive, Map()

    def keys(self, pair):
        return [Key(self.name, pair.drives)]

    def measure(self, pairs, data_of, store, reporter):
        (pair,) = pairs
        found = [
            len(data_of(drive).take(asked).X_WS)
            for drive, asked in self.asks(pair, store)
        ]
        (key,) = self.keys(pair)
        store.write(key, found)
