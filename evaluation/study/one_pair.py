"""A single pair of drives, which the engine measures in this process.

The commands `pr`, `tcr`, `localise` and `map-update` are studies of one pair.
Their results stay in memory, and may be written as the two tables of a study.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cns_drake.base import Reporter, one_line
from cns_drake.drives import Drive
from evaluation.change import DriveMap
from evaluation.recognition import RANDOM_YAW_PROTOCOL, RetrievalProtocol
from evaluation.results import check_output
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.engine import Engine
from evaluation.study.parts import Part
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.jobs import Jobs, job_name
from evaluation.study.tasks.pair import Held, NamedDrive, Pair, Result
from evaluation.study.tasks.task import Task


@dataclass(frozen=True, eq=False)
class OpenSource:
    """The source of a drive, a point cloud or a map that is open already.

    Attributes:
        opened: the drive, or the path of a point cloud.
        columns: number of values per point in `.bin` files; by default guessed
            from the values.
        drive_map: map of the drive, if the map was made already.
    """

    opened: Drive | Path
    columns: int | None = None
    drive_map: DriveMap | None = None

    def __call__(self) -> Any:
        """Returns the open drive, or the path of the point cloud."""
        return self.opened

    def identity(self) -> str:
        """Returns the name; results of open drives are never stored."""
        return self.opened.name


@dataclass
class JobsAtOnce(Jobs):
    """Jobs that are done when they are added. Their results are in memory.

    Attributes:
        on_note: is called with each note of a job.
    """

    # Who asks for one method waits for it.
    leaves_out_slow = False

    on_note: Callable[[str], None] = lambda text: None
    _done: dict[str, Held] = field(default_factory=dict)

    def mapped(
        self, drive: NamedDrive, spacing: float | None, needs: list[str]
    ) -> Result:
        if isinstance(drive.source, OpenSource) and drive.source.drive_map:
            return Held(drive.source.drive_map)
        return super().mapped(drive, spacing, needs)

    def add(
        self,
        part: Part,
        function: Callable[..., object],
        arguments: tuple[object, ...],
        needs: Iterable[str] = (),
        cost: float = 0.0,
        version: int = 1,
    ) -> Result:
        name = job_name(part)
        if name not in self._done:
            self._done[name] = Held(function(self._reporter(), *arguments))
        return self._done[name]

    def _reporter(self) -> Reporter:
        def send(kind: str, *values: Any) -> None:
            if kind == "note":
                self.on_note(*values)

        return Reporter(send)


def measure_pairs(
    experiment: str,
    pairs: Iterable[Pair],
    tasks: Iterable[Task],
    output: Path | None = None,
    methods: Iterable[tuple[MethodChoice, Mapping[str, Any]]] = (),
    on_note: Callable[[str], None] = lambda text: None,
    processes: int = 1,
) -> Engine:
    """Measures pairs of drives, and returns the engine with the results.

    Args:
        experiment: name of the experiment in the tables.
        pairs: the pairs.
        tasks: the tasks.
        output: folder in which `Engine.write_tables` writes both tables.
        methods: methods of place recognition, each with the columns of its
            settings in tables.
        on_note: is called with notes on what is left out.
        processes: number of processes that a task may use.

    Raises:
        InputError: something cannot be measured.
    """

    def jobs(
        files: StudyFiles,
        methods: tuple[MethodChoice, ...],
        distractors: Sequence[NamedDrive],
    ) -> JobsAtOnce:
        return JobsAtOnce(
            files, methods, distractors, processes=processes, on_note=on_note
        )

    if output is not None:
        check_output(output)
    engine = Engine(
        experiment,
        {one.name: one for one in tasks},
        {one.key: (one, columns) for one, columns in methods},
        output or Path(),
        on_note,
    )
    engine.add(list(pairs), make_jobs=jobs)
    return engine


def pair_of(
    database: OpenSource,
    query: OpenSource,
    names: tuple[str, str],
    protocol: RetrievalProtocol = RANDOM_YAW_PROTOCOL,
    settings: Mapping[str, Any] | None = None,
    **more: Any,
) -> Pair:
    """Returns a pair of open drives, clouds or maps.

    Args:
        database, query: the drives.
        names: names of the drives in tables.
        protocol: the protocol that the user requested.
        settings: name -> value of settings outside of the protocol that change
            a number.
        more: further fields of the pair.
    """
    drives = [
        NamedDrive(name, source)
        for name, source in zip(names, (database, query), strict=True)
    ]
    values: dict[str, Any] = {
        "map_name": _map_of(query.opened),
        "names": names,
        "factors": {},
        "seed": protocol.seed,
        "baseline": None,
        "stated": protocol,
        "key": " ".join(names),
        "database": drives[0],
        "query": drives[1],
        "way": drives[0],
        "protocol": protocol,
        "settings": settings or {},
    }
    return Pair(**{**values, **more})


def pair_of_drive_maps(
    both: tuple[DriveMap, DriveMap], names: tuple[str, str], **more: Any
) -> Pair:
    """Returns a pair of drives or map files whose voxel maps are known.

    The drives keep the names of their maps, which name the files of results: a
    control has the `names` of its pair in tables, and other drives. The other
    arguments are the same as for `pair_of`.
    """
    database, query = (
        OpenSource(Path(one.name), drive_map=one) for one in both
    )
    drive = both[1].drive
    map_name = drive if isinstance(drive, Drive) else query.opened
    own = both[0].name, both[1].name
    pair = pair_of(database, query, own, map_name=_map_of(map_name), **more)
    return replace(pair, names=names)


def pair_of_maps(older: Path, newer: Path, map_name: str) -> Pair:
    """Returns a pair of maps in folders, for a task that reads them itself."""
    sources = OpenSource(older), OpenSource(newer)
    return pair_of(
        *sources, (older.name, newer.name), map_name=one_line(map_name)
    )


def _map_of(opened: Drive | Path) -> str:
    """Returns the name of a drive's map; without a map, of its world frame."""
    if isinstance(opened, Path):
        return one_line(opened.name)
    named = (opened.scenario or {}).get("map")
    if named is not None:
        return one_line(Path(str(named)).name)
    return opened.world_frame.partition("/")[0] or opened.name
