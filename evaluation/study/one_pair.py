"""The two tables of one method on one pair of drives, which was measured."""

from collections.abc import Mapping
from pathlib import Path

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import one_line
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import SETTINGS
from evaluation.study.chosen_methods import MethodChoice, Setting
from evaluation.study.engine import Engine
from evaluation.study.surveys import RecordingSource
from evaluation.study.tasks.place import PlaceTask, PoseTask
from evaluation.study.tasks.task import Held, NamedDrive, Pair

# Name of the experiment in tables of a single pair.
_EXPERIMENT = "pr"


def write_pair_tables(
    output: Path,
    outcome: PlaceOutcome,
    paths: tuple[Path, Path],
    query: Drive,
    protocol: RetrievalProtocol,
    settings: Mapping[str, Setting],
    sensor_height: float | None = None,
) -> None:
    """Writes an outcome as `results.csv` and `queries.csv`.

    Args:
        output: folder of the tables.
        outcome: the outcome.
        paths: paths of the database and of the query.
        query: the drive of the queries.
        protocol: the protocol that was asked for.
        settings: name -> value of the settings of the method that were given.
        sensor_height: height of the LiDAR [m]; None for the methods' default.

    Raises:
        InputError: a table cannot be written.
    """
    name = outcome.method
    columns = {f"{SETTINGS}{name}.{key}": v for key, v in settings.items()}
    height = {} if sensor_height is None else {"sensor_height": sensor_height}
    choice = MethodChoice(name, settings=tuple(settings.items()))
    tasks = {task.name: task({}, _EXPERIMENT) for task in (PlaceTask, PoseTask)}
    names = outcome.database, outcome.query
    database, asked = (
        NamedDrive(one, RecordingSource(path))
        for one, path in zip(names, paths, strict=True)
    )
    engine = Engine(_EXPERIMENT, tasks, {name: (choice, columns)}, output)
    engine.measured.append(
        Pair(
            map_name=_map_of(query),
            names=names,
            factors={},
            seed=protocol.seed,
            is_baseline=False,
            stated=protocol,
            key=" ".join(names),
            database=database,
            query=asked,
            way=database,
            protocol=protocol,
            settings=height,
            parts=dict.fromkeys(tasks, (Held([outcome]),)),
        )
    )
    engine.write_tables()


def _map_of(drive: Drive) -> str:
    """Returns the name of a drive's map, or else of its world frame."""
    named = (drive.scenario or {}).get("map")
    if named is not None:
        return one_line(Path(str(named)).name)
    return drive.world_frame.partition("/")[0] or drive.name
