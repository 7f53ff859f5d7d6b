"""The paper's experiments on a map, from simulation to report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import subprocess
import sys

from cns_drake.errors import InputError
from cns_drake.jobs import record_all
from cns_drake.paths import sequences_of_map, shipped_maps
from cns_drake.scenario import Scenario, load_scenario
from evaluation.cluster import Cluster


def reproduce_maps(
    maps: Sequence[str] | None, output: Path, cluster: Cluster
) -> None:
    """Records the sequences of maps, evaluates them and reports.

    `<output>/<name>/` gets each recording, `<output>/pictures` the drives of
    each map from above and a street in its first and last stage,
    `<output>/report` the tables and figures. What is recorded already is not
    recorded again.

    Args:
        maps: which maps, by name or folder; all shipped ones if empty.
        output: the folder for everything.
        cluster: where to simulate.

    Raises:
        InputError: a map is not known, or a step failed.
    """
    folders = [_map_folder(name) for name in maps or _recordable_maps()]
    scenarios = [
        scenario for folder in folders for scenario in _scenarios_of_map(folder)
    ]
    record_all(scenarios, output, cluster)
    for folder in folders:
        _draw(folder, output / "pictures")
    # A process of its own: the evaluation stands without the simulator.
    command = [sys.executable, "-m", "evaluation", "report", str(output)]
    done = subprocess.run(
        [*command, "--output", str(output / "report")], check=False
    )
    if done.returncode != 0:
        raise InputError(f"{output}: the evaluation failed (see above)")


def _recordable_maps() -> list[str]:
    return [
        name
        for name, folder in shipped_maps().items()
        if sequences_of_map(folder)
    ]


def _map_folder(name: str) -> Path:
    """Returns the folder of a map that can be recorded.

    Raises:
        InputError: there is no such map.
    """
    folder = shipped_maps().get(name, Path(name))
    if not folder.is_dir():
        known = ", ".join(_recordable_maps())
        raise InputError(
            f"unknown map '{name}'; known: {known}; or give a folder"
        )
    if not sequences_of_map(folder):
        raise InputError(
            f"{folder}: no sequence_NN.yaml whose stage_NN.sdf is there"
        )
    return folder


def _scenarios_of_map(folder: Path) -> list[Scenario]:
    """Returns a map's sequences, and its control drives.

    A control drive is the route of an earlier stage through the last one:
    compared with the last stage's own sequence, whatever it shows as change
    is due to the routes and not to the city.
    """
    sequences = [load_scenario(path) for path in sequences_of_map(folder)]
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


def _draw(folder: Path, pictures: Path) -> None:
    # matplotlib is not needed by those who only record.
    from cns_drake.aerial_pictures import draw_drives
    from cns_drake.stage_pictures import draw_stages, load_views

    name = folder.resolve().name
    path = pictures / f"{name}_drives.png"
    print(f"drawing {path}", file=sys.stderr)
    scenarios = [load_scenario(file) for file in sequences_of_map(folder)]
    draw_drives(
        {scenario.name.replace("_", " "): scenario for scenario in scenarios},
        path,
    )
    # A map of one's own may do without views.
    if (folder / "views.yaml").is_file():
        path = pictures / f"{name}_stages.png"
        print(f"drawing {path}", file=sys.stderr)
        files = sorted(folder.glob("stage_*.sdf"))
        stages = {
            file.stem.replace("_", " "): file for file in (files[0], files[-1])
        }
        draw_stages(stages, load_views(folder / "views.yaml")["street"], path)
