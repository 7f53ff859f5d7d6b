"""Recordings as jobs, side by side, each in a process of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
import sys

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.scenarios.scenario import Scenario
from cns_drake.studies.recording_step import Record

# Expected time to load a stage, and to simulate a frame with the default
# LiDAR [s]; how many frames a drive has that does not say.
_LOADING = 3.0
_FRAME = 0.014
_USUAL_FRAMES = 3000


def record_all(
    scenarios: Sequence[Scenario],
    output: Path,
    cluster: Cluster,
    *,
    overwrite: bool = True,
) -> None:
    """Records scenarios as `<output>/<name>/`, with progress on stderr.

    A finished recording of the very same scenario and world is left as it
    is, an interrupted one goes on.

    Args:
        scenarios: what to record.
        output: the folder of recordings.
        cluster: where.
        overwrite: replace whatever else has one of the names.

    Raises:
        InputError: some could not be recorded; all are named. Or the folder
            cannot be made.
    """
    jobs = plan_recordings(scenarios, output, overwrite=overwrite)
    make_folder(output)
    run_jobs(jobs, cluster)


def plan_recordings(
    scenarios: Sequence[Scenario],
    output: Path,
    *,
    overwrite: bool = True,
    pages: Mapping[str, Path] | None = None,
) -> list[Job]:
    """Returns a job for each recording that is not finished; says which are.

    The job has the recording's name.

    Args:
        scenarios: what to record.
        output: the folder of recordings.
        overwrite: replace whatever else has one of the names.
        pages: name -> where to save a web page of the drive. Without it
            such a recording counts as not finished.

    Raises:
        InputError: two have one name, or a folder must not be used.
    """
    for name, count in Counter(s.name for s in scenarios).items():
        if count > 1:
            raise InputError(f"{name}: {count} sequences have this name")
    output = output.absolute()
    waiting = []
    for scenario in scenarios:
        page = (pages or {}).get(scenario.name)
        if page is not None:
            page = page.absolute()
        step = Record(scenario, output, overwrite, page)
        if step.is_done():
            print(f"{scenario.name}: finished already", file=sys.stderr)
        else:
            waiting.append(step)
    # What can be found wrong at once is found before anything slow.
    folders = [RecordingFolder(step.output) for step in waiting]
    others = [files.path.name for files in folders if files.is_finished()]
    if others and not overwrite:
        raise InputError(
            f"{output}: finished recordings of another scenario, world, "
            f"length or program: {', '.join(others)} "
            "(--overwrite replaces them)"
        )
    for files in folders:
        files.check(overwrite)
    return [
        Job(
            name=step.scenario.name,
            step=step,
            cost=_LOADING + _FRAME * (step.scenario.frames or _USUAL_FRAMES),
        )
        for step in waiting
    ]
