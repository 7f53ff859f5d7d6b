"""Recordings as jobs, side by side, one process each."""

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

# Expected time to load a stage, and to simulate a frame with the default LiDAR
# [s]; assumed frames of a drive without a number.
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

    A finished recording of the same scenario and world is kept; an interrupted
    one goes on.

    Args:
        scenarios: to record.
        output: the folder of recordings.
        cluster: where the work is done.
        overwrite: replace other recordings of these names.

    Raises:
        InputError: some could not be recorded, all of which are named, or the
            folder cannot be made.
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
    """Returns a job for each unfinished recording; notes the finished ones.

    The job has the recording's name.

    Args:
        scenarios: to record.
        output: the folder of recordings.
        overwrite: replace other recordings of these names.
        pages: name -> web page of the drive. A recording without its page
            counts as not finished.

    Raises:
        InputError: two have one name, or a folder must not be used.
    """
    for name, count in Counter(s.name for s in scenarios).items():
        if count > 1:
            raise InputError(f"{name}: {count} drives have this name")
    output = output.absolute()
    waiting = []
    for scenario in scenarios:
        page = (pages or {}).get(scenario.name)
        if page is not None:
            page = page.absolute()
        step = Record(scenario, output, overwrite, page)
        if step.is_done():
            print(f"{scenario.name}: already finished", file=sys.stderr)
        else:
            waiting.append(step)
    # Quick checks come before all slow work.
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
