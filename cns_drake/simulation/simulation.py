"""Running a scenario from its first frame to its last."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import time

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram

from cns_drake.base.drives.drive import Drive
from cns_drake.base.files import (
    check_writable,
    complete_part,
    write_part,
)
from cns_drake.base.interrupts import interrupts_wait
from cns_drake.pictures.meshcat_recording import MeshcatRecorder
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.scenarios.planning import shown_beside
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.recording_schedule import (
    drive_schedule,
    first_points_topic,
)
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.simulation.drive_in_progress import DriveInProgress
from cns_drake.simulation.drive_recording import make_bag, resume_recording
from cns_drake.simulation.loaded_drive import (
    LoadedDrive,
    load_drive,
)
from cns_drake.simulation.run_progress import (
    NoteCallback,
    ProgressCallback,
    Run,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.simulation.station import make_station


def simulate(
    scenario: Scenario,
    output: Path,
    *,
    page_file: Path | None = None,
    graphviz_file: Path | None = None,
    overwrite: bool = False,
    num_threads: int = 1,
    reader: Callable[[Drive], None] | None = None,
    on_frame: ProgressCallback = lambda done, total: None,
    on_note: NoteCallback = lambda text: None,
) -> Run:
    """Simulates a scenario and records it as `<output>/<name>/`.

    If an interrupted run of the same scenario, world and version has left
    frames there, they are kept and the simulation starts with the next one;
    the result is the same. For a page of the drive all frames are simulated.

    Args:
        scenario: the scenario to run.
        output: the folder of recordings.
        page_file: where to save a web page of the drive, if anywhere.
        graphviz_file: where to save the Diagram as Graphviz text, if
            anywhere.
        overwrite: replace an existing recording of that name.
        num_threads: number of threads that cast the rays of a LiDAR; the
            recording does not depend on it.
        reader: reads the drive while it is recorded, each scan of the first
            LiDAR once and in order, and must not raise. Scans that it does not
            read are simulated all the same. It is called only for a recording
            that begins with the first frame.
        on_frame: receives the progress.
        on_note: receives notes on an interrupted run, and on the world's table
            of structures.

    Raises:
        InputError: the scenario cannot be run, or its output cannot be written.

    Example:
        from pathlib import Path

        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), Path("recordings"))
    """
    start = time.perf_counter()
    folder = output / scenario.name
    # Interrupts are raised only where `strike` is called.
    with interrupts_wait() as strike:
        # Quick checks come before all slow work.
        _check_output(folder, (page_file, graphviz_file), overwrite)
        if not scenario.traffic.is_off:
            on_note(f"{scenario.name}: planning the traffic")
        drive = load_drive(scenario)
        for text in drive.world.notes:
            on_note(text)
        strike()
        page = None if page_file is None else _make_page(drive)
        resumed_frames = 0
        with make_bag(drive, folder, overwrite=overwrite) as bag:
            if page is None:
                resumed_frames = resume_recording(bag, drive, on_frame, on_note)

            def report_frames(done: int) -> None:
                strike()
                on_frame(done, drive.num_frames)

            writer = BackgroundWriter(bag.write)
            diagram = make_station(
                drive.scenario,
                world=drive.world,
                trajectory=drive.trajectory,
                traffic=drive.traffic,
                bag=writer,
                page=page,
                num_threads=num_threads,
            )
            _save_graphviz(diagram, graphviz_file)
            strike()
            loaded = time.perf_counter()
            simulated_s = _advance(
                diagram, writer, drive, resumed_frames, report_frames, reader
            )
        finished = time.perf_counter()
        if page is not None and page_file is not None:
            page.save(page_file, title=scenario.name)
    return Run(
        name=scenario.name,
        folder=folder,
        num_frames=drive.num_frames,
        resumed_frames=resumed_frames,
        simulated_s=simulated_s,
        wall_s=finished - loaded,
        loading_s=loaded - start,
    )


def _check_output(
    folder: Path, files: tuple[Path | None, ...], overwrite: bool
) -> None:
    """Checks that a recording and other files, if any, can be written.

    Raises:
        InputError: they cannot.
    """
    for file in files:
        if file is not None:
            check_writable(file)
    RecordingFolder(folder).check(overwrite)


def _make_page(drive: LoadedDrive) -> MeshcatRecorder:
    other, other_name = shown_beside(drive.scenario)
    stage = drive.scenario.stage
    stages = () if stage is None else tuple(map_folder(drive.scenario).stages())
    return MeshcatRecorder(
        drive.world,
        X_BSs=drive.X_BSs,
        period=frame_period(drive.scenario.lidars),
        num_frames=drive.num_frames,
        other_stage=None if other is None else load_stage(other),
        other_name=other_name,
        stage=stage,
        stages=stages,
    )


def _save_graphviz(diagram: Diagram, file: Path | None) -> None:
    if file is not None:
        write_part(file, diagram.GetGraphvizString())
        complete_part(file)


def _advance(
    diagram: Diagram,
    writer: BackgroundWriter,
    drive: LoadedDrive,
    first: int,
    on_frame: Callable[[int], None],
    reader: Callable[[Drive], None] | None,
) -> float:
    """Simulates frames and writes their messages.

    Args:
        diagram: the station.
        writer: of its recording.
        drive: the drive, simulated up to its last frame.
        first: the first frame to simulate.
        on_frame: receives the number of finished frames of the drive, after
            each.
        reader: see `simulate`.

    Returns:
        Simulated time from the first of them to the last [s].
    """
    if first >= drive.num_frames:
        return 0.0
    scenario = drive.scenario
    period = frame_period(scenario.lidars)
    schedule = drive_schedule(scenario)

    def monitor(context: Context) -> None:
        done = math.floor(context.get_time() / period + 1e-6) + 1
        on_frame(min(done, drive.num_frames))

    simulator = Simulator(diagram)
    simulator.set_monitor(monitor)
    # Messages come at ticks. The simulation begins and ends between two ticks,
    # so that rounding cannot add or drop a message.
    begin = first * schedule.steps[first_points_topic(scenario)]
    end = max(schedule.ends.values())
    start = max(begin - 0.5, 0.0) * schedule.period
    simulator.get_mutable_context().SetTime(start)
    with writer:
        if reader is not None and first == 0:
            in_progress = DriveInProgress(drive, simulator)
            reader(in_progress)
            in_progress.raise_fault()
        simulator.AdvanceTo((end + 0.5) * schedule.period)
    return (end - begin) * schedule.period
