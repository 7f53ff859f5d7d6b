"""The ladder: the cost of each cause of change for each method.

A drive queries a database with the same route through the same city, with one
cause of change between the two at a time. Nothing is recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import itertools
import math
from pathlib import Path

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder, write_text
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario, map_folder
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.simulation.simulated_drive import DriveSimulation
from cns_drake.studies import ladder_rungs
from cns_drake.studies.redrawing import redraw_cities
from cns_drake.studies.reproduction import recordable_map
from evaluation.drives.sampling import sample_frames
from evaluation.recognition.description import Role
from evaluation.recognition.protocol import DEFAULT_PROTOCOL, RetrievalProtocol
from evaluation.report import ladder
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.localisation import ComparedPair
from evaluation.study.parts import MakePart, Part, StudyFiles, SurveyFiles
from evaluation.study.rungs import DescribedSource, measure_rung
from evaluation.study.surveys import Survey

# With --quick only the strongest level of each cause is measured, on every
# other query.
QUICK_EXTENT = ladder_rungs.Extent(levels=(4,), most_places=300)
QUICK_PROTOCOL = replace(DEFAULT_PROTOCOL, query_spacing=20.0)
# Number of causes that are crossed two by two.
_CROSSED = 6
# A search for places elsewhere is noted after each so many drives.
_NOTED_DRIVES = 20

# Expected seconds: to describe a drive, and for a rung.
_DESCRIPTION_COST = 30.0
_RUNG_COST = 60.0

# Name of the only stage of a redrawn city.
_STAGE = "01"


def climb_ladder(
    maps: Sequence[str] | None,
    output: Path,
    cluster: Cluster,
    methods: tuple[MethodChoice, ...],
    extent: ladder_rungs.Extent,
    protocol: RetrievalProtocol = DEFAULT_PROTOCOL,
    *,
    with_pairs: bool = False,
    on_note: Callable[[str], None] = lambda text: None,
) -> tuple[Path, str]:
    """Measures all rungs of maps; writes tables, figure and findings.

    `<output>/ladder.csv` and `queries.csv` are the tables, `ladder.png` (and
    PDF, SVG) the figure, `findings.txt` the findings. Finished work is not
    repeated. `with_pairs` also crosses the six causes that cost most two by
    two, and writes `pairs.csv`. Returns the path of `ladder.csv`, and the
    findings.

    Raises:
        InputError: a map is unknown, the folder cannot be made, or a step
            failed.
    """
    asked = query_drives(maps or shipped_maps())
    make_folder(output)
    files = StudyFiles(output.absolute())
    plans: dict[str, RungPlan] = {}
    planned: list[tuple[Scenario, ladder_rungs.Rung]] = []
    for drive in asked:
        rungs, notes = ladder_rungs.plan_rungs(drive, extent)
        for text in notes:
            on_note(f"{drive.source}: {text}")
        plan = RungPlan(drive, extent.viewpoint, methods, protocol, files)
        most = max(rung.drives.num_distractors for rung in rungs)
        plan.distractors = distracting_drives(
            ladder_rungs.plain_drives(drive).database,
            most,
            protocol.place_spacing,
            output / "cities",
            cluster,
            on_note,
        )
        plans[drive.name] = plan
        planned += [(drive, rung) for rung in rungs]
    measured = _measure(planned, plans, cluster, protocol)
    rows = ladder.ladder_rows(measured)
    pairs: list[ladder.LadderRow] = []
    if with_pairs:
        apart = {ladder_rungs.NONE, ladder_rungs.ALL, *ladder_rungs.APART}
        causes = [
            one for one in ladder.strongest_causes(rows) if one not in apart
        ]
        crossed = causes[:_CROSSED]
        on_note(f"crossing two by two: {', '.join(crossed)}")
        planned = [
            (drive, rung)
            for drive in asked
            for rung in ladder_rungs.plan_pairs(drive, crossed, extent)
        ]
        measured += _measure(planned, plans, cluster, protocol)
        pairs = ladder.ladder_rows(measured)[len(rows) :]
    queries = ladder.ladder_query_table(measured, protocol)
    queries.write_csv(output / "queries.csv")
    ladder.draw_ladder(rows, output / "ladder")
    text = ladder.ladder_text(rows)
    if pairs:
        ladder.pair_table(rows, pairs).write_csv(output / "pairs.csv")
        text += f"\n\n{ladder.pair_text(rows, pairs)}"
    write_text(output / "findings.txt", text + "\n")
    table = output / "ladder.csv"
    found = ladder.ladder_table([*rows, *pairs], protocol, extent.viewpoint)
    found.write_csv(table)
    return table, text


def rung_pairs(
    maps: Sequence[str] | None,
    extent: ladder_rungs.Extent,
    on_note: Callable[[str], None] = lambda text: None,
) -> list[ComparedPair]:
    """Returns the drives of all rungs of maps, for tasks with a map.

    A rung that changes only how a query is described, or adds places, is left
    out.

    Raises:
        InputError: a map is unknown.
    """
    pairs = []
    for drive in query_drives(maps or shipped_maps()):
        rungs, notes = ladder_rungs.plan_rungs(drive, extent)
        for text in notes:
            on_note(f"{drive.source}: {text}")
        pairs += [
            ComparedPair(
                _labelled(drive, rung),
                (
                    DriveSimulation(rung.drives.database),
                    DriveSimulation(rung.drives.query),
                ),
                rung.seed,
            )
            for rung in rungs
            if not (rung.drives.query_changes or rung.drives.num_distractors)
        ]
    return pairs


def _measure(
    planned: Sequence[tuple[Scenario, ladder_rungs.Rung]],
    plans: Mapping[str, RungPlan],
    cluster: Cluster,
    protocol: RetrievalProtocol,
) -> list[ladder.MeasuredRung]:
    """Measures rungs, each with the drive of its queries."""
    parts = [plans[drive.name].add_rung(rung) for drive, rung in planned]
    jobs: dict[str, Job] = {}
    for plan in plans.values():
        jobs |= plan.jobs
    run_jobs(jobs.values(), cluster)
    return [
        ladder.MeasuredRung(
            _labelled(drive, rung, protocol.radius),
            rung.seed,
            rung.fingerprint(),
            part.read(),
        )
        for (drive, rung), part in zip(planned, parts, strict=True)
    ]


def query_drives(maps: Iterable[str]) -> list[Scenario]:
    """Returns the last drive of each map.

    Raises:
        InputError: a map is unknown, or two have drives of one name.
    """
    drives: dict[str, Scenario] = {}
    for folder in dict.fromkeys(recordable_map(name) for name in maps):
        drive = load_scenario(MapFolder(folder).recordable_drives()[-1])
        if drive.name in drives:
            raise InputError(
                f"{folder}: another map has a drive {drive.name}, too"
            )
        drives[drive.name] = drive
    return list(drives.values())


@dataclass
class RungPlan:
    """The jobs of one map; distractors drive through other cities."""

    _query: Scenario
    _viewpoint: str
    _methods: tuple[MethodChoice, ...]
    _protocol: RetrievalProtocol
    _files: StudyFiles
    jobs: dict[str, Job] = field(default_factory=dict)
    distractors: Sequence[Scenario] = ()

    def __post_init__(self) -> None:
        self._plain = ladder_rungs.plain_drives(self._query, self._viewpoint)

    def add_rung(self, rung: ladder_rungs.Rung) -> Part:
        """Adds the jobs of a rung; returns the part that they write."""
        needs: list[str] = []

        def described(
            drive: Scenario, role: Role, *, with_scans: bool
        ) -> tuple[Part, ...]:
            job, files = describe_job(
                drive,
                role,
                self._methods,
                self._protocol,
                self._files,
                with_scans=with_scans,
            )
            self.jobs[job.name] = job
            needs.append(job.name)
            parts = (files.described(one.name) for one in self._methods)
            return (files.scans, *parts) if with_scans else tuple(parts)

        def source(side: str, role: Role) -> DescribedSource:
            drive = getattr(rung.drives, side)
            # Only drives without a change serve several rungs.
            is_changed = side == "query" and rung.drives.query_changes
            if is_changed or drive != getattr(self._plain, side):
                return DriveSimulation(drive)
            return described(drive, role, with_scans=True)

        name = f"{self._query.name} {rung.cause} {rung.level} {rung.seed}"
        if self._viewpoint != ladder_rungs.NEAR:
            name += f" {self._viewpoint}"
        part = self._files.part("rungs", name)
        others = self.distractors if rung.drives.num_distractors else ()
        arguments = (
            source("database", "places"),
            source("query", "queries"),
            tuple(described(one, "places", with_scans=False) for one in others),
            rung.drives.num_distractors,
            self._methods,
            rung.drives.protocol(self._protocol),
        )
        step = MakePart(part, measure_rung, arguments)
        self.jobs[name] = Job(name, step, tuple(needs), _RUNG_COST)
        return part


def describe_job(
    drive: Scenario,
    role: Role,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    files: StudyFiles,
    *,
    with_scans: bool = False,
) -> tuple[Job, SurveyFiles]:
    """Returns the job that describes a drive, and the files that it writes."""
    written = files.survey(f"{drive.name} {role}")
    step = Survey(
        DriveSimulation(drive),
        frozenset({role}),
        methods,
        protocol,
        written,
        with_scans=with_scans,
        with_map=False,
    )
    job = Job(f"describe {drive.name}", step, cost=_DESCRIPTION_COST)
    return job, written


def _labelled(
    query_scenario: Scenario, rung: ladder_rungs.Rung, radius: float = math.nan
) -> ladder.LadderRung:
    # The database has the route of the query, at any stage.
    route = str(query_scenario.stage)
    return ladder.LadderRung(
        map_folder(query_scenario).name,
        route,
        route,
        rung.cause,
        rung.level,
        rung.strength,
        rung.drives.radius(radius),
    )


def distracting_drives(
    query: Scenario,
    number: int,
    spacing: float,
    output: Path,
    cluster: Cluster,
    on_note: Callable[[str], None] = lambda text: None,
) -> list[Scenario]:
    """Returns drives through other cities with about so many places.

    These are the shipped drives of other maps, each through its own stage;
    then those of this map, along the same streets between other buildings, if
    it is shipped; then the drives of other maps through the other stages; then
    through those cities drawn anew. The LiDARs of the query, whose city is left
    out, measure all of them. Places are `spacing` apart [m].

    Raises:
        InputError: a shipped map cannot be used.
    """
    drives: list[Scenario] = []
    found = 0
    if number:
        on_note(f"{query.name}: looking for {number} places elsewhere")
    for drive in _drives(query, output, cluster):
        if found >= number:
            break
        drive = drive.replaced(lidars=query.lidars)
        drives.append(drive)
        found += _num_places(drive, spacing)
        if len(drives) % _NOTED_DRIVES == 0:
            on_note(f"{query.name}: found {found} places elsewhere")
    return drives


def _num_places(scenario: Scenario, spacing: float) -> int:
    trajectory = plan_drive(scenario)
    frames = count_frames(scenario, trajectory)
    _, p_WB = trajectory.poses(scenario.frame_period * np.arange(frames))
    return len(sample_frames(p_WB, spacing))


def _drives(
    query: Scenario, output: Path, cluster: Cluster
) -> Iterator[Scenario]:
    """Yields an endless series of drives."""
    maps = {name: MapFolder(path) for name, path in shipped_maps().items()}
    drives = {
        name: [load_scenario(path) for path in folder.recordable_drives()]
        for name, folder in maps.items()
    }
    own = Path(str(query.map)).name
    others = [name for name in maps if name != own]

    def redrawn(name: str, seed: int) -> Iterator[Scenario]:
        cities = redraw_cities(maps[name].path, _STAGE, [seed], output, cluster)
        for one in drives[name]:
            yield _elsewhere(one, str(cities[seed]), _STAGE, f"c{seed}")

    for name in others:
        yield from drives[name]
    if own in maps:
        yield from redrawn(own, 1)
    for name in others:
        for stage in maps[name].stages():
            yield from (
                _elsewhere(one, one.map, stage, stage)
                for one in drives[name]
                if one.stage != stage
            )
    for seed in itertools.count(1):
        for name in others:
            yield from redrawn(name, seed)


def _elsewhere(
    scenario: Scenario, place: str | None, stage: str, ending: str
) -> Scenario:
    name = f"{scenario.name}_in_{ending}"
    return scenario.replaced(name=name, map=place, stage=stage)
