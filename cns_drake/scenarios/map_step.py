"""Makes map folders as jobs, and keeps those that are current."""

import abc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import os
from pathlib import Path

from evaluation.base import (
    Cluster,
    InputError,
    Job,
    Part,
    Reporter,
    Step,
    make_folder,
    remove_folder,
    run_jobs,
    user_errors,
)

# The file in its folder with the fingerprint of a map.
_PART = "drawn.data"


@dataclass(frozen=True)
class MakeMap(Step):
    """A job step that makes the folder of a map.

    If the folder contains a map that an earlier run of this step made from
    other inputs, the map is replaced.

    Attributes:
        folder: the folder of the map.
    """

    folder: Path

    @property
    def output(self) -> Path:
        return self.folder

    def is_done(self) -> bool:
        # A folder that has its final name is complete.
        return Part(self.folder / _PART).is_current(
            self.made_of(self.sources())
        )

    def run(self, reporter: Reporter) -> None:
        made_of = self.made_of(self.sources())
        if is_older := self.check():
            remove_folder(self.folder)
        self.make(
            lambda draft: Part(draft / _PART).write(made_of, None), reporter
        )
        if is_older:
            reporter.note(
                f"{self.folder}: replaced, since its inputs have changed"
            )

    def check(self) -> bool:
        """Returns whether a job step has made a map in this folder before.

        Raises:
            InputError: the folder, or a file of its name, exists but is not a
                map that a job step made.
        """
        with user_errors(self.folder):
            is_there = os.path.lexists(self.folder)
            if is_there and not (self.folder / _PART).is_file():
                raise InputError(
                    f"{self.folder}: this folder is there already and is not a"
                    " map that a study made; remove it or give another output"
                )
        return is_there

    @abc.abstractmethod
    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        """Makes the map's folder.

        Args:
            finish: function that must be called with the complete folder before
                it gets its final name.
            reporter: reports progress.
        """

    @abc.abstractmethod
    def sources(self) -> dict[str, object]:
        """Returns all inputs of the map, ready for JSON."""


def make_maps(steps: Sequence[MakeMap], output: Path, cluster: Cluster) -> None:
    """Makes maps; finished maps are kept.

    Args:
        steps: a step for each map.
        output: folder of the maps, which is created if needed.
        cluster: runs the steps as jobs.

    Raises:
        InputError: another file or folder has the name of a map, or maps could
            not be made; the error names all of these maps.
    """
    # Quick checks come before all slow work.
    for step in steps:
        step.check()
    if steps:
        make_folder(output)
    jobs = [Job(f"city {one.folder.name}", one) for one in steps]
    run_jobs(jobs, cluster, "cities")
