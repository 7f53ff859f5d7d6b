"""Recording many scenarios side by side, each in a process of its own.

A process each, because Python systems in a Drake diagram are not freed on
this release of Drake, because Python code holds its interpreter's lock, and
because whatever happens to one then does not happen to the others.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
import multiprocessing
import multiprocessing.connection
from pathlib import Path
import traceback

import yaml

from cns_drake import terminal
from cns_drake.errors import InputError
from cns_drake.scenario import Scenario, make_scenario


def record_all(
    scenarios: Sequence[Scenario], output: Path, num_processes: int
) -> None:
    """Records scenarios as `<output>/<name>/`, with progress on stderr.

    A recording that is complete and of the very same scenario is left as it
    is; anything else of its name is replaced.

    Args:
        scenarios: what to record.
        output: the folder of recordings.
        num_processes: how many to simulate side by side.

    Raises:
        InputError: some could not be recorded; all are named.
    """
    waiting = [s for s in scenarios if not is_recorded(s, output)]
    context = multiprocessing.get_context("spawn")
    running: dict[str, _Job] = {}
    faults: list[str] = []
    with terminal.show_progress() as progress, contextlib.ExitStack() as stack:
        while waiting or running:
            while waiting and len(running) < num_processes:
                scenario = waiting.pop(0)
                job = _Job(context, progress, scenario, output)
                stack.callback(job.stop)
                running[scenario.name] = job
            multiprocessing.connection.wait(
                [job.messages for job in running.values()]
            )
            for name, job in list(running.items()):
                job.read()
                if job.ended:
                    del running[name]
                    if job.fault:
                        faults.append(f"{name}: {job.fault}")
    if faults:
        raise InputError("; ".join(faults))


def is_recorded(scenario: Scenario, output: Path) -> bool:
    """Tells whether a complete recording of just this scenario exists."""
    folder = output / scenario.name
    # A recording's metadata is what is written last.
    if not (folder / "metadata.yaml").is_file():
        return False
    try:
        text = (folder / "scenario.yaml").read_text(encoding="utf-8")
        recorded = make_scenario(yaml.safe_load(text), folder)
    except (OSError, yaml.YAMLError, InputError):
        return False
    if scenario.frames is None:  # A recording always says how many it has.
        recorded = recorded.model_copy(update={"frames": None})
    return recorded == scenario


class _Job:
    """A process that records one scenario, and what it tells."""

    def __init__(self, context, progress, scenario, output):
        self.messages, sender = context.Pipe(duplex=False)
        self.ended = False
        self.fault: str | None = None
        task = progress.add_task(scenario.name, total=None, note="loading")
        self._on_frame = terminal.frame_progress(progress, task)
        self._process = context.Process(
            target=_record, args=(scenario, output, sender), daemon=True
        )
        self._process.start()
        sender.close()  # So that the pipe ends with the process.

    def read(self) -> None:
        """Takes in what has arrived."""
        try:
            while self.messages.poll():
                kind, *values = self.messages.recv()
                if kind == "frame":
                    self._on_frame(*values)
                else:
                    self.fault = values[0]
        except EOFError:
            self._process.join()
            self.ended = True
            status = self._process.exitcode
            if status != 0 and self.fault is None:
                self.fault = f"its process ended with status {status}"

    def stop(self) -> None:
        """Ends the process if it is still there."""
        if self._process.is_alive():
            self._process.terminate()
            self._process.join()


def _record(scenario: Scenario, output: Path, sender) -> None:
    from cns_drake.simulation import simulate

    terminal.interrupt_on_termination()

    def on_frame(done: int, total: int) -> None:
        if done % 20 == 0 or done == total:
            sender.send(("frame", done, total))

    try:
        simulate(scenario, output, overwrite=True, on_frame=on_frame)
    except InputError as error:
        sender.send(("fault", str(error)))
    except KeyboardInterrupt:
        sender.send(("fault", "interrupted"))
    except BaseException as error:
        traceback.print_exc()
        sender.send(("fault", f"{type(error).__name__}: {error}"))
        raise
