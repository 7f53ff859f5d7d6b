"""The recording of a drive: its metadata, and how it is resumed."""

from __future__ import annotations

from pathlib import Path

from cns_drake.base.version import __version__
from cns_drake.recording.bag_writer import BagWriter, take_over_frames
from cns_drake.recording.recorded_topics import make_calibration
from cns_drake.recording.schedule import START_NS
from cns_drake.scenarios.imu_making import KALIBR_FILE, describe_kalibr
from cns_drake.scenarios.provenance import (
    INPUTS_KEY,
    combined_digest,
    dependency_versions,
)
from cns_drake.scenarios.recording_schedule import (
    drive_schedule,
    first_points_topic,
    scenario_topics,
)
from cns_drake.scenarios.scenario_files import describe_scenario
from cns_drake.scenarios.sensor_making import sensor_pose
from cns_drake.simulation.loaded_drive import LoadedDrive
from cns_drake.simulation.run_progress import NoteCallback, ProgressCallback
from cns_drake.simulation.structure_list import structure_list


def make_bag(
    drive: LoadedDrive, folder: Path, *, overwrite: bool = False
) -> BagWriter:
    """Makes the recording of a drive, so far without messages.

    Args:
        drive: the drive to record.
        folder: to write.
        overwrite: whether it may replace an existing recording.
    """
    scenario, inputs = drive.scenario, drive.inputs
    described = describe_scenario(scenario)
    kalibr = describe_kalibr(scenario)
    imu_files = {} if kalibr is None else {KALIBR_FILE: kalibr}
    return BagWriter(
        folder,
        scenario_topics(scenario),
        start_ns=START_NS,
        attachments={
            "scenario.json": described,
            "structures.json": structure_list(drive.world),
            "calibration.json": make_calibration(
                drive.X_BSs, sensor_pose(scenario.imu)
            ),
            "provenance.json": {
                "versions": dependency_versions(),
                "inputs_sha256": inputs,
            },
            **imu_files,
        },
        # The drive can be simulated again while its files stay in place.
        scenario=describe_scenario(scenario, folder),
        beside=imu_files,
        custom_data={
            "cns_drake_version": __version__,
            INPUTS_KEY: combined_digest(inputs),
            **{
                key: str(described[key])
                for key in ("map", "stage", "world", "seed")
                if key in described
            },
        },
        fingerprint=drive.fingerprint,
        overwrite=overwrite,
    )


def resume_recording(
    bag: BagWriter,
    drive: LoadedDrive,
    on_frame: ProgressCallback,
    on_note: NoteCallback,
) -> int:
    """Keeps the frames of an interrupted run; returns their number."""
    if not bag.follows_interruption():
        return 0
    name, num_frames = drive.scenario.name, drive.num_frames
    on_note(f"{name}: found an interrupted run, reading it")
    frames = take_over_frames(
        bag,
        scenario_topics(drive.scenario),
        drive_schedule(drive.scenario),
        first_points_topic(drive.scenario),
    )
    on_note(
        f"{name}: {frames} of {num_frames} frames are there; going on with "
        "the next one"
    )
    if frames > 0:
        on_frame(frames, num_frames)
    return frames
