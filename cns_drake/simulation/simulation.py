"""Running a scenario from its first to its last frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path
import time
from typing import TYPE_CHECKING

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram

from cns_drake.recording import (
    START_NS,
    BackgroundWriter,
    BagWriter,
    RecordingFolder,
    frames_within,
    make_calibration,
)
from cns_drake.scenarios import (
    INPUTS_KEY,
    DrivePlan,
    Scenario,
    combined_digest,
    dependency_versions,
    describe_scenario,
    digest_inputs,
    make_city,
    recording_fingerprint,
)
from cns_drake.scene import FileWatch, InSight
from cns_drake.sensors import (
    KALIBR_FILE,
    SpinningPattern,
    check_renderer,
    describe_unit,
    make_pattern,
    optical_pose,
    sensor_pose,
)
from cns_drake.simulation.loaded_drive import LoadedDrive, load_drive
from cns_drake.simulation.stage_loading import load_stage, sight_along
from cns_drake.simulation.station import make_station
from evaluation.base import (
    InputError,
    __version__,
    check_folder_writable,
    check_writable,
    doing,
    interrupts_wait,
    write_text,
)

if TYPE_CHECKING:
    from cns_drake.pictures import MeshcatRecorder

# Reports how many frames of how many are done.
ProgressCallback = Callable[[int, int], None]
# Receives a message for the user.
NoteCallback = Callable[[str], None]


@dataclass(frozen=True)
class FinishedSimulation:
    """The files, counts and times of a finished simulation.

    Attributes:
        name: name of the drive.
        folder: folder of the recording.
        num_frames: number of frames in the recording.
        simulated_s: simulated time from the first to the last frame [s].
        wall_s: wall time of the simulation, without loading [s].

    Example:
        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), output)
        print(run.folder, run.real_time_factor)
    """

    name: str
    folder: Path
    num_frames: int
    simulated_s: float
    wall_s: float

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second of wall time."""
        return self.simulated_s / self.wall_s if self.wall_s > 0 else math.inf


def simulate(
    scenario: Scenario,
    output: Path | str,
    *,
    page_file: Path | str | None = None,
    beside: Path | str | None = None,
    graphviz_file: Path | str | None = None,
    overwrite: bool = False,
    num_threads: int = 1,
    on_frame: ProgressCallback = lambda done, total: None,
    on_note: NoteCallback = lambda text: None,
) -> FinishedSimulation:
    """Simulates a scenario and records it in the folder `<output>/<name>`.

    The recording is whole or not there: an interrupted run leaves nothing, and
    what a killed run leaves is replaced. If the city of the drive must be made
    (`city.years`, `city.redraw`), its map stays in `<output>/cities`.

    Args:
        scenario: the scenario to run.
        output: folder for recordings.
        page_file: file for a web page of the drive, if any.
        beside: page of another drive in the same city; `page_file` then shows
            both drives side by side, at the same place.
        graphviz_file: file for the Diagram as Graphviz text, if any.
        overwrite: whether to replace an existing recording of the same name.
        num_threads: number of threads that cast the rays of a LiDAR. The
            recording does not depend on this number.
        on_frame: called with the number of finished frames and the number of
            all frames.
        on_note: called with notes for the user, for example about the world's
            table of structures.

    Raises:
        InputError: the scenario cannot be run, or its output cannot be written.

    Example:
        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), "recordings")
    """
    folder = Path(output) / scenario.name
    page_file = None if page_file is None else Path(page_file)
    if graphviz_file is not None:
        graphviz_file = Path(graphviz_file)
    # Interrupts are raised only where `strike` is called.
    with interrupts_wait() as strike:
        # Quick checks come before all slow work.
        for file in (page_file, graphviz_file):
            if file is not None:
                check_writable(file)
        other = None
        if beside is not None:
            if page_file is None:
                raise InputError("beside: only with a page")
            from cns_drake.pictures import read_drive_page

            other = read_drive_page(Path(beside), _city(scenario))
        RecordingFolder(folder).check(overwrite)
        check_folder_writable(folder.parent)
        scenario = make_city(scenario, folder.parent / "cities")
        plan = DrivePlan(scenario)
        if scenario.cameras:
            check_renderer()
        doing("reading the files of the drive")
        watch = FileWatch()
        inputs = digest_inputs(scenario, watch)
        in_sight = sight_along(plan, with_page=page_file is not None)
        drive = load_drive(plan, in_sight)
        changed = watch.changed()
        if changed is not None:
            raise InputError(f"{changed}: changed while it was being read")
        for text in drive.world.notes:
            on_note(text)
        strike()
        page = None if page_file is None else _make_page(drive, in_sight)
        with _make_bag(drive, inputs, folder, overwrite=overwrite) as bag:

            def report_frames(done: int) -> None:
                strike()
                doing("simulating", done, drive.num_frames, "frames")
                on_frame(done, drive.num_frames)

            doing("building the diagram")
            writer = BackgroundWriter(bag.write)
            diagram = make_station(
                drive,
                bag=writer,
                page=page,
                num_threads=num_threads,
            )
            if graphviz_file is not None:
                write_text(graphviz_file, diagram.GetGraphvizString())
            strike()
            loaded = time.perf_counter()
            simulated_s = _simulate_frames(
                diagram, writer, drive, report_frames
            )
            doing("closing the recording")
        finished = time.perf_counter()
        if page is not None and page_file is not None:
            doing("writing the page of the drive")
            page.save(page_file, title=scenario.name, beside=other)
    return FinishedSimulation(
        name=scenario.name,
        folder=folder,
        num_frames=drive.num_frames,
        simulated_s=simulated_s,
        wall_s=finished - loaded,
    )


def _make_bag(
    drive: LoadedDrive,
    inputs: dict[str, str],
    folder: Path,
    *,
    overwrite: bool = False,
) -> BagWriter:
    """Makes the recording of a drive, still without messages.

    `inputs` are the digests of the drive's files, see
    `provenance.digest_inputs`.
    """
    scenario = drive.scenario
    described = describe_scenario(scenario)
    kalibr = scenario.imu.describe_kalibr(scenario.fastest_rate)
    imu_files = {} if kalibr is None else {KALIBR_FILE: kalibr}
    units = {
        name: describe_unit(lidar)
        for name, lidar in scenario.lidars.items()
        if lidar.returns == "calibrated"
    }
    return BagWriter(
        folder,
        drive.recording.topics,
        start_ns=START_NS,
        attachments={
            "scenario.json": described,
            "structures.json": drive.structures,
            "calibration.json": make_calibration(
                drive.X_BSs
                | {
                    name: sensor_pose(sensor)
                    for name, sensor in scenario.further_sensors.items()
                }
                | {
                    name: optical_pose(camera)
                    for name, camera in scenario.cameras.items()
                },
                sensor_pose(scenario.imu),
            ),
            "provenance.json": {
                "versions": dependency_versions(),
                "inputs_sha256": inputs,
            },
            **imu_files,
        },
        # The drive can be simulated again while its files stay in place.
        scenario=describe_scenario(scenario, folder),
        beside=imu_files | ({"calibration.yaml": units} if units else {}),
        custom_data={
            "cns_drake_version": __version__,
            INPUTS_KEY: combined_digest(inputs),
            **{
                key: str(described[key])
                for key in ("map", "stage", "world", "seed")
                if key in described
            },
        },
        fingerprint=_fingerprint(drive, inputs),
        overwrite=overwrite,
    )


def _fingerprint(drive: LoadedDrive, inputs: dict[str, str]) -> str:
    """Returns the fingerprints of a recording, for `fingerprint.txt`."""
    whole = drive.num_frames == frames_within(
        drive.trajectory.duration, drive.scenario.frame_period
    )
    # `frames` is set even for the whole drive, so that giving its number
    # explicitly makes no difference.
    return "\n".join(
        recording_fingerprint(drive.scenario.replaced(**update), inputs)
        for update in ({}, {"frames": None})[: 1 + whole]
    )


def _make_page(drive: LoadedDrive, in_sight: InSight | None) -> MeshcatRecorder:
    # Slow to import, and most drives have no page.
    from cns_drake.pictures import MeshcatRecorder, ShownStages, other_stage

    scenario = drive.scenario
    other, other_name, is_earlier = other_stage(scenario)
    stage = scenario.stage
    stages: tuple[str, ...] = ()
    if not (stage is None or scenario.city.is_made):
        stages = tuple(scenario.folder.stages())
    return MeshcatRecorder(
        drive.world,
        X_BSs=drive.X_BSs,
        period=scenario.frame_period,
        num_frames=drive.num_frames,
        shown=ShownStages(
            None
            if other is None
            else load_stage(DrivePlan(other), in_sight=in_sight),
            other_name,
            is_earlier,
            stage,
            stages,
            _city(scenario),
        ),
        sensors=_sensor_texts(scenario),
        cameras={
            name: round(1 / (scenario.frame_period * camera.rate))
            for name, camera in scenario.cameras.items()
        },
    )


def _city(scenario: Scenario) -> str:
    """Returns the name of a scenario's map, or of its world's file."""
    return Path(scenario.map or scenario.world or "").name


def _sensor_texts(scenario: Scenario) -> list[str]:
    """Returns a line for each LiDAR and camera of a drive."""
    texts = []
    for name, lidar in scenario.lidars.items():
        model = lidar.preset or "LiDAR of a data sheet"
        pattern = make_pattern(lidar)
        beams = len(pattern.beams(0).d_Sset)
        if isinstance(pattern, SpinningPattern):
            rings = pattern.num_rings
            beams_text = f"{rings} rings × {beams // rings} columns"
        else:
            beams_text = f"{beams:,} beams a scan"
        texts.append(
            f"{name}: {model}, {beams_text}, {pattern.min_range:g} to "
            f"{pattern.max_range:g} m, {lidar.rate} Hz"
        )
    for name, camera in scenario.cameras.items():
        texts.append(
            f"{name}: {camera.width} × {camera.height} pixels, {camera.rate} Hz"
        )
    return texts


def _simulate_frames(
    diagram: Diagram,
    writer: BackgroundWriter,
    drive: LoadedDrive,
    on_frame: Callable[[int], None],
) -> float:
    """Simulates all frames and writes their messages.

    Returns:
        Simulated time from the first to the last frame [s].
    """
    scenario = drive.scenario
    period = scenario.frame_period
    schedule = drive.recording.schedule

    def monitor(context: Context) -> None:
        done = math.floor(context.get_time() / period + 1e-6) + 1
        on_frame(min(done, drive.num_frames))

    simulator = Simulator(diagram)
    simulator.set_monitor(monitor)
    # Messages come at ticks. The simulation ends between two ticks, so that
    # rounding cannot add or drop a message.
    end = max(schedule.ends.values())
    with writer:
        simulator.AdvanceTo((end + 0.5) * schedule.period)
    return end * schedule.period
