"""The drives of an experiment, which the option `--vary` adds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cns_drake.base import note

if TYPE_CHECKING:
    from cns_drake.base import Cluster
    from cns_drake.scenarios import Scenario


def varied_drives(vary: str, output: Path, cluster: Cluster) -> list[Scenario]:
    """Returns the drives of an experiment, and writes their scenario files.

    The scenario files are written to `<output>/scenarios`, and cities that the
    experiment makes to `<output>/cities`.

    Args:
        vary: name of a shipped experiment, or an experiment file.
        output: folder of the recordings.
        cluster: runs the jobs that make cities.

    Raises:
        InputError: the experiment cannot be used, or a file is in the way.
    """
    from cns_drake.scenarios import check_written_scenarios, write_scenarios
    from cns_drake.studies import study_drives
    from evaluation.study import Study, load_experiment

    # Nothing is measured, and no program of the experiment runs.
    unused = {"tasks": {"place": {}}, "methods": {"solid": {}}, "charts": []}
    experiment = load_experiment(vary, list(unused.items()))
    check_written_scenarios(output / "scenarios")
    study = Study(experiment, output.absolute(), vary, cluster, note)
    members = study_drives(study)
    write_scenarios(members, output / "scenarios")
    return members
