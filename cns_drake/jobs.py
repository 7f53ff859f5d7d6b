"""Recording many scenarios side by side, each in a process of its own.

A process each, because Python systems in a Drake diagram are not freed on
this release of Drake, because Python code holds its interpreter's lock, and
because whatever happens to one then does not happen to the others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
import contextlib
import multiprocessing
import multiprocessing.connection
import multiprocessing.resource_tracker
import os
from pathlib import Path
import signal
import threading
import traceback

from cns_drake import terminal
from cns_drake.errors import InputError
from cns_drake.frame_clock import frames_within
from cns_drake.planning import plan_drive
from cns_drake.provenance import INPUTS_KEY, combined_digest, digest_inputs
from cns_drake.recording_folder import RecordingFolder
from cns_drake.scenario import Scenario, make_scenario
from cns_drake.yaml_files import read_yaml
from evaluation.interrupts import (
    end_interrupted,
    interrupt_on_termination,
    uninterrupted,
)

# How long a process may take to close its recording [s].
_PATIENCE = 30.0


def record_all(
    scenarios: Sequence[Scenario],
    output: Path,
    num_processes: int,
    *,
    overwrite: bool = True,
) -> None:
    """Records scenarios as `<output>/<name>/`, with progress on stderr.

    A finished recording of the very same scenario and world is left as it
    is, an interrupted one goes on.

    Args:
        scenarios: what to record.
        output: the folder of recordings.
        num_processes: how many to simulate side by side.
        overwrite: replace whatever else has one of the names.

    Raises:
        InputError: some could not be recorded; all are named.
    """
    for name, count in Counter(s.name for s in scenarios).items():
        if count > 1:
            raise InputError(f"{name}: {count} sequences have this name")
    finished = [s for s in scenarios if is_recorded(s, output)]
    waiting = [s for s in scenarios if s not in finished]
    # What can be found wrong at once is found before anything slow.
    folders = [RecordingFolder(output / s.name) for s in waiting]
    others = [files.path.name for files in folders if files.is_finished()]
    if others and not overwrite:
        raise InputError(
            f"{output}: finished recordings of another scenario, world or "
            f"length: {', '.join(others)} (--overwrite replaces them)"
        )
    for files in folders:
        files.check(overwrite)
    context = multiprocessing.get_context("spawn")
    running: dict[str, _Job] = {}
    faults: list[str] = []
    with terminal.show_progress() as progress, contextlib.ExitStack() as stack:
        stack.callback(lambda: _stop(running.values()))
        for scenario in finished:
            terminal.print_note(progress, f"{scenario.name}: finished already")
        while waiting or running:
            while waiting and len(running) < num_processes:
                scenario = waiting.pop(0)
                running[scenario.name] = _Job(
                    context, progress, scenario, output, overwrite
                )
            multiprocessing.connection.wait(
                [job.messages for job in running.values()]
            )
            for name, job in list(running.items()):
                job.read()
                if job.ended:
                    del running[name]
                    if job.fault:
                        faults.append(job.fault)
    if faults:
        raise InputError("; ".join(faults))


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
    # A recording always says how many frames it has.
    if recorded.model_copy(update={"frames": scenario.frames}) != scenario:
        return False
    if inputs != combined_digest(digest_inputs(scenario)):
        return False
    frames = scenario.frames or frames_within(plan_drive(scenario).duration)
    return recorded.frames == frames


class _Job:
    """A process that records one scenario, and what it tells."""

    def __init__(self, context, progress, scenario, output, overwrite):
        self.messages, sender = context.Pipe(duplex=False)
        self.ended = False
        self.fault: str | None = None
        self._name = scenario.name
        self._progress = progress
        task = progress.add_task(scenario.name, total=None, note="loading")
        self._on_frame = terminal.frame_progress(progress, task)
        self.process = context.Process(
            target=_record,
            args=(scenario, output, overwrite, sender),
            daemon=True,
        )
        # Ctrl-C reaches all processes of a terminal at once, also those that
        # have only begun to import. It is for the parent to end them. The
        # first start of a process would unblock the signal on its way.
        multiprocessing.resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        sender.close()  # So that the pipe ends with the process.

    def read(self) -> None:
        """Takes in what has arrived."""
        try:
            while self.messages.poll():
                kind, *values = self.messages.recv()
                if kind == "frame":
                    self._on_frame(*values)
                elif kind == "note":
                    terminal.print_note(self._progress, *values)
                else:
                    self.fault = values[0]
        except EOFError:
            self.process.join()
            self.ended = True
            status = self.process.exitcode
            if status != 0 and self.fault is None:
                self.fault = (
                    f"{self._name}: its process ended with status {status}"
                )


def _stop(jobs) -> None:
    """Ends the processes of jobs, all at the same time."""
    for job in jobs:
        job.process.terminate()
    for job in jobs:
        job.process.join(_PATIENCE)
        job.process.kill()
        job.process.join()


def _record(scenario: Scenario, output: Path, overwrite: bool, sender) -> None:
    try:
        interrupt_on_termination(once=True)
        threading.Thread(target=_end_with_parent, daemon=True).start()
        _simulate(scenario, output, overwrite, sender)
    except InputError as error:
        _tell(sender, "fault", str(error))
    except KeyboardInterrupt:
        _tell(sender, "fault", f"{scenario.name}: interrupted")
        end_interrupted()
    except BaseException as error:
        traceback.print_exc()
        _tell(
            sender, "fault", f"{scenario.name}: {type(error).__name__}: {error}"
        )
        raise
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _simulate(scenario, output, overwrite, sender) -> None:
    with uninterrupted():
        from cns_drake.simulation import simulate

    def on_frame(done: int, total: int) -> None:
        if done % 20 == 0 or done == total:
            _tell(sender, "frame", done, total)

    simulate(
        scenario,
        output,
        overwrite=overwrite,
        on_frame=on_frame,
        on_note=lambda text: _tell(sender, "note", text),
    )


def _tell(sender, *message) -> None:
    # Where the parent has gone, there is nobody to tell.
    with contextlib.suppress(BrokenPipeError):
        sender.send(message)


def _end_with_parent() -> None:
    """Interrupts this process when its parent has ended, even if killed."""
    multiprocessing.parent_process().join()
    os.kill(os.getpid(), signal.SIGTERM)
