"""Recordings as jobs, side by side, each in a process of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
import sys

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, Tell, run_jobs
from cns_drake.base.yaml_files import read_yaml
from cns_drake.recording.frame_clock import frames_within
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.provenance import (
    INPUTS_KEY,
    combined_digest,
    digest_inputs,
)
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_loading import make_scenario

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
        if _is_done(scenario, output, overwrite, page):
            print(f"{scenario.name}: finished already", file=sys.stderr)
        else:
            waiting.append((scenario, page))
    # What can be found wrong at once is found before anything slow.
    folders = [RecordingFolder(output / s.name) for s, _ in waiting]
    others = [files.path.name for files in folders if files.is_finished()]
    if others and not overwrite:
        raise InputError(
            f"{output}: finished recordings of another scenario, world or "
            f"length: {', '.join(others)} (--overwrite replaces them)"
        )
    for files in folders:
        files.check(overwrite)
    return [
        Job(
            name=scenario.name,
            function=record,
            arguments=(scenario, output, overwrite, page),
            cost=_LOADING + _FRAME * (scenario.frames or _USUAL_FRAMES),
            output=output / scenario.name,
            is_done=_is_done,
        )
        for scenario, page in waiting
    ]


def record(
    scenario: Scenario,
    output: Path,
    overwrite: bool,
    page: Path | None,
    tell: Tell,
) -> None:
    """Records one scenario: a job.

    Args:
        scenario: what to record.
        output: the folder of recordings.
        overwrite: replace another recording of that name.
        page: where to save a web page of the drive, if anywhere.
        tell: is told how far it is.

    Raises:
        InputError: see `simulate`.
    """
    with uninterrupted():
        from cns_drake.simulation.simulation import simulate

    simulate(
        scenario,
        output,
        page_file=page,
        overwrite=overwrite,
        on_frame=tell.progress,
        on_note=tell.note,
    )


def is_recorded(scenario: Scenario, output: Path) -> bool:
    """Tells whether a finished recording of just this scenario exists.

    That is, of this scenario in the world and on the roads as they are now.

    Raises:
        InputError: the scenario's files cannot be read.
    """
    files = RecordingFolder(output / scenario.name)
    if not files.is_finished() or not files.mcap.is_file():
        return False
    try:
        recorded = make_scenario(read_yaml(files.scenario), files.scenario)
        metadata = read_yaml(files.metadata)
        custom_data = metadata["rosbag2_bagfile_information"]["custom_data"]
        inputs = custom_data[INPUTS_KEY]
    except (InputError, LookupError, TypeError):
        return False
    # A recording always says how many frames it has; of what has moved with
    # it, the digest tells whether it is the same.
    update: dict = {"frames": scenario.frames}
    for field in ("map", "world", "waypoints"):
        places = getattr(recorded, field), getattr(scenario, field)
        if None not in places and len({Path(p).name for p in places}) == 1:
            update[field] = places[1]
    if recorded.model_copy(update=update) != scenario:
        return False
    if inputs != combined_digest(digest_inputs(scenario)):
        return False
    frames = scenario.frames or frames_within(plan_drive(scenario).duration)
    return recorded.frames == frames


def _is_done(
    scenario: Scenario, output: Path, overwrite: bool, page: Path | None
) -> bool:
    """Tells whether there is nothing to do; see `record`."""
    del overwrite
    if page is not None and not page.is_file():
        return False
    return is_recorded(scenario, output)
