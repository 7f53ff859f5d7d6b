"""Running a scenario from its first frame to its last."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import time

from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from cns_drake.base.errors import InputError
from cns_drake.base.files import (
    check_writable,
    complete_part,
    write_part,
)
from cns_drake.base.interrupts import interrupts_wait
from cns_drake.base.version import __version__
from cns_drake.motion.trajectory import Trajectory
from cns_drake.pictures.meshcat_recording import MeshcatRecorder
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.frame_clock import FRAME_PERIOD, START_NS
from cns_drake.recording.mcap_recorder import (
    make_calibration,
    recording_topics,
)
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.recording.resuming import take_over_frames
from cns_drake.recording.rosbag2_metadata import Topic
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.provenance import (
    INPUTS_KEY,
    combined_digest,
    dependency_versions,
    digest_inputs,
)
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import (
    check_files,
    describe_scenario,
    map_folder,
    world_file,
)
from cns_drake.scenarios.sensor_making import sensor_pose
from cns_drake.scene.world import World
from cns_drake.simulation.station import load_stage, make_station

# Reports that so many frames of so many are done.
ProgressCallback = Callable[[int, int], None]
# Takes what a user should know, in words.
NoteCallback = Callable[[str], None]


@dataclass(frozen=True)
class Run:
    """What a simulation did.

    Attributes:
        name: of the sequence.
        folder: the recording.
        num_frames: frames in the recording.
        resumed_frames: how many of them an interrupted run had recorded.
        simulated_s: simulated time from the first frame simulated to the
            last [s].
        wall_s: time that took, without loading [s].
        loading_s: time to load the stage and plan the drive [s].

    Example:
        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), output)
        print(run.folder, run.real_time_factor)
    """

    name: str
    folder: Path
    num_frames: int
    resumed_frames: int
    simulated_s: float
    wall_s: float
    loading_s: float

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second."""
        return self.simulated_s / self.wall_s if self.wall_s > 0 else math.inf


def simulate(
    scenario: Scenario,
    output: Path,
    *,
    page_file: Path | None = None,
    graphviz_file: Path | None = None,
    overwrite: bool = False,
    num_threads: int = 1,
    on_frame: ProgressCallback = lambda done, total: None,
    on_note: NoteCallback = lambda text: None,
) -> Run:
    """Simulates a scenario and records it as `<output>/<name>/`.

    If an interrupted run of the same scenario, world and version has left
    frames there, they are kept and the simulation starts with the next one;
    the result is the same. For a page of the drive all frames are simulated.

    Args:
        scenario: what to run.
        output: the folder of recordings.
        page_file: where to save a web page of the drive, if anywhere.
        graphviz_file: where to save the Diagram as Graphviz text, if
            anywhere.
        overwrite: replace an existing recording of that name.
        num_threads: how many threads cast the rays of a LiDAR; the recording
            does not depend on it.
        on_frame: is told about progress.
        on_note: is told what was found of an interrupted run, and of the
            world's table of structures.

    Raises:
        InputError: the scenario cannot be run or its output not be written.

    Example:
        from pathlib import Path

        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), Path("recordings"))
    """
    start = time.perf_counter()
    files = RecordingFolder(output / scenario.name)
    topics = recording_topics(scenario.lidars)
    # Interrupts come up where `strike` is called, and nowhere else.
    with interrupts_wait() as strike:
        # What can be found wrong at once is found before anything slow.
        for file in (page_file, graphviz_file):
            if file is not None:
                check_writable(file)
        files.check(overwrite)
        drive = _load(scenario)
        for text in drive.world.notes:
            on_note(text)
        strike()
        bag = _make_bag(files.path, topics, drive, overwrite)
        page = None if page_file is None else _make_page(drive)
        resumed_frames = 0
        with bag:
            if page is None and bag.follows_interruption():
                resumed_frames = _resume(bag, topics, drive, on_frame, on_note)
            writer = BackgroundWriter(bag.write)
            diagram = make_station(
                drive.scenario,
                world=drive.world,
                trajectory=drive.trajectory,
                bag=writer,
                page=page,
                num_threads=num_threads,
            )
            if graphviz_file is not None:
                write_part(graphviz_file, diagram.GetGraphvizString())
                complete_part(graphviz_file)
            simulator = Simulator(diagram)
            strike()
            loaded = time.perf_counter()

            def monitor(context: Context) -> None:
                strike()
                done = round(context.get_time() / FRAME_PERIOD) + 1
                on_frame(min(done, drive.num_frames), drive.num_frames)

            simulator.set_monitor(monitor)
            # Frame k is recorded at k periods; ending with the last one's
            # time, no rounding can add or drop a frame.
            end = (drive.num_frames - 1) * FRAME_PERIOD
            begin = min(resumed_frames * FRAME_PERIOD, end)
            if resumed_frames < drive.num_frames:
                simulator.get_mutable_context().SetTime(begin)
                with writer:
                    simulator.AdvanceTo(end)
        finished = time.perf_counter()
        if page is not None and page_file is not None:
            page.save(page_file, title=scenario.name)
    return Run(
        name=scenario.name,
        folder=files.path,
        num_frames=drive.num_frames,
        resumed_frames=resumed_frames,
        simulated_s=end - begin,
        wall_s=finished - loaded,
        loading_s=loaded - start,
    )


@dataclass(frozen=True)
class _Drive:
    """A scenario with what it takes to run it.

    Attributes:
        scenario: with `frames` given.
        inputs: digests of what it was read from.
        trajectory: of the vehicle.
        world: the stage.
        num_frames: how many it takes.
    """

    scenario: Scenario
    inputs: dict[str, str]
    trajectory: Trajectory
    world: World
    num_frames: int


def _load(scenario: Scenario) -> _Drive:
    check_files(scenario)
    inputs = digest_inputs(scenario)
    trajectory = plan_drive(scenario)
    num_frames = count_frames(scenario, trajectory)
    scenario = scenario.model_copy(update={"frames": num_frames})
    world = load_stage(scenario)
    if digest_inputs(scenario) != inputs:
        raise InputError(
            f"{world_file(scenario)}: changed while it was being read"
        )
    return _Drive(scenario, inputs, trajectory, world, num_frames)


def _resume(
    bag: BagWriter,
    topics: Sequence[Topic],
    drive: _Drive,
    on_frame: ProgressCallback,
    on_note: NoteCallback,
) -> int:
    """Keeps what an interrupted run has recorded; returns how many frames."""
    name, num_frames = drive.scenario.name, drive.num_frames
    on_note(f"{name}: found an interrupted run, reading it")
    resumed_frames = take_over_frames(bag, topics)
    on_note(
        f"{name}: {resumed_frames} of {num_frames} frames are there, going on "
        "with the next"
    )
    if resumed_frames > 0:
        on_frame(resumed_frames, num_frames)
    return resumed_frames


def _make_page(drive: _Drive) -> MeshcatRecorder:
    other_stage, other_name = _other_stage(drive.scenario)
    return MeshcatRecorder(
        drive.world,
        X_BSs=_lidar_poses(drive.scenario),
        period=FRAME_PERIOD,
        other_stage=other_stage,
        other_name=other_name,
    )


def _make_bag(
    folder: Path, topics: Sequence[Topic], drive: _Drive, overwrite: bool
) -> BagWriter:
    """Makes the recording of a drive, so far without messages."""
    scenario, inputs = drive.scenario, drive.inputs
    described = describe_scenario(scenario)
    return BagWriter(
        folder,
        topics,
        start_ns=START_NS,
        attachments={
            "scenario.json": described,
            "structures.json": _structure_list(drive.world),
            "calibration.json": make_calibration(
                _lidar_poses(scenario), sensor_pose(scenario.imu)
            ),
            "provenance.json": {
                "versions": dependency_versions(),
                "inputs_sha256": inputs,
            },
        },
        # It can be simulated again, as long as all lies as it does.
        scenario=describe_scenario(scenario, folder),
        custom_data={
            "cns_drake_version": __version__,
            INPUTS_KEY: combined_digest(inputs),
            **{
                key: str(described[key])
                for key in ("map", "stage", "world", "seed")
                if key in described
            },
        },
        overwrite=overwrite,
    )


def _lidar_poses(scenario: Scenario) -> dict[str, RigidTransform]:
    """Returns LiDAR name -> pose X_BS in the vehicle frame."""
    return {name: sensor_pose(one) for name, one in scenario.lidars.items()}


def _structure_list(world: World) -> list[dict]:
    return [
        {
            "instance": entry.instance,
            "name": entry.name,
            "class": entry.semantic_class,
            "label": entry.label,
        }
        for entry in world.structures
    ]


def _other_stage(scenario: Scenario) -> tuple[World | None, str]:
    """Returns the stage to compare with, and what it is called.

    It is the last stage, or else the first. Where structures are left out, it
    is the same stage with them.
    """
    if scenario.without:
        whole = scenario.model_copy(update={"without": ()})
        return load_stage(whole), "the whole city"
    stages = list(map_folder(scenario).stages())
    others = [stage for stage in stages if stage != scenario.stage]
    if scenario.stage is None or not others:
        return None, ""
    stage = others[-1] if stages[-1] in others else others[0]
    other = scenario.model_copy(update={"stage": stage})
    return load_stage(other), f"stage {stage}"
