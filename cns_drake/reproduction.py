"""The paper's experiments on a map, from simulation to report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import subprocess
import sys

from cns_drake.errors import InputError
from cns_drake.jobs import record_all
from cns_drake.paths import recordable_sequences, shipped_maps
from cns_drake.scenario import Scenario, load_scenario


def reproduce_maps(
    maps: Sequence[str] | None, output: Path, num_processes: int
) -> None:
    """Records the sequences of maps, evaluates them and reports.

    `<output>/<name>/` gets each recording, `<output>/pictures` a street of
    each map in its first and last stage, `<output>/report` the tables and
    figures. What is recorded already is not recorded again.

    Args:
        maps: which maps; all shipped ones if empty.
        output: the folder for everything.
        num_processes: how many sequences to simulate side by side.

    Raises:
        InputError: a map is not known, or a step failed.
    """
    folders = {path.parent for path in recordable_sequences().values()}
    known = {
        name: folder
        for name, folder in shipped_maps().items()
        if folder in folders
    }
    for name in maps or ():
        if name not in known:
            raise InputError(f"unknown map '{name}'; known: {', '.join(known)}")
    scenarios = [
        scenario
        for name in maps or known
        for scenario in _scenarios_of_map(name)
    ]
    record_all(scenarios, output, num_processes)
    for name in maps or known:
        _draw_stages(known[name], output / "pictures" / f"{name}_stages.png")
    # A process of its own: the evaluation stands without the simulator.
    command = [sys.executable, "-m", "evaluation", "report", str(output)]
    done = subprocess.run(
        [*command, "--output", str(output / "report")], check=False
    )
    if done.returncode != 0:
        raise InputError(f"{output}: the evaluation failed (see above)")


def _scenarios_of_map(name: str) -> list[Scenario]:
    """Returns a map's sequences, and its control drives.

    A control drive is the route of an earlier stage through the last one:
    compared with the last stage's own sequence, whatever it shows as change
    is due to the routes and not to the city.
    """
    sequences = [
        load_scenario(sequence)
        for sequence, path in recordable_sequences().items()
        if path.parent == shipped_maps()[name]
    ]
    last = max(sequences, key=lambda sequence: sequence.stage)
    controls = [
        sequence.model_copy(
            update={
                "name": f"{sequence.name}_stage_{last.stage}",
                "stage": last.stage,
                "title": f"Control: the route of {sequence.name} "
                f"in stage {last.stage}",
            }
        )
        for sequence in sequences
        if sequence is not last
    ]
    return sequences + controls


def _draw_stages(folder: Path, path: Path) -> None:
    # matplotlib is not needed by those who only record.
    from cns_drake.stage_pictures import draw_stages, load_views

    print(f"drawing {path}", file=sys.stderr)
    files = sorted(folder.glob("stage_*.sdf"))
    stages = {
        file.stem.replace("_", " "): file for file in (files[0], files[-1])
    }
    draw_stages(stages, load_views(folder / "views.yaml")["street"], path)
