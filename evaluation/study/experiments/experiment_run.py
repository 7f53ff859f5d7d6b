"""An experiment, and where it runs: what its drives need, and its study."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from evaluation.base import Cluster
from evaluation.study.experiments.experiment import Experiment


@dataclass
class ExperimentRun:
    """An experiment, and where it runs.

    Attributes:
        experiment: the experiment.
        output: folder of the results.
        source: file of the experiment, for errors.
        cluster: runs the jobs.
        on_note: is called with notes on what is left out, and on how long the
            study takes.
    """

    experiment: Experiment
    output: Path
    source: str
    cluster: Cluster
    on_note: Callable[[str], None] = lambda text: None
