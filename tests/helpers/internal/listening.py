"""A listener that keeps what work says about itself."""

from collections.abc import Iterator
import contextlib

from evaluation.base.progress import Listener, heard_by


class Heard(Listener):
    """Keeps all that it hears, in its order.

    Attributes:
        said: activity, done, total and unit of each message.
        numbers: jobs, jobs done before and unit, of each run of jobs.
    """

    def __init__(self):
        self.said = []
        self.numbers = []

    def jobs(self, num_jobs, num_done, unit):
        self.numbers.append((num_jobs, num_done, unit))
        return super().jobs(num_jobs, num_done, unit)

    def doing(self, activity, done=0, total=0, unit=""):
        self.said.append((activity, done, total, unit))

    @property
    def activities(self):
        """What was done, each activity once in a row."""
        names = [said[0] for said in self.said]
        return [
            name for k, name in enumerate(names) if names[k - 1 : k] != [name]
        ]

    def counts(self, activity):
        """Returns the counts of an activity: done and total."""
        return [said[1:3] for said in self.said if said[0] == activity]


@contextlib.contextmanager
def listening(heard=None) -> Iterator[Heard]:
    heard = heard or Heard()
    with heard_by(heard):
        yield heard
