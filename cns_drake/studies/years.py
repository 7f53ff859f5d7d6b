"""What a city's years cost each method, without a recording.

A drive queries a database of its own route that was mapped some years before:
the city of today ages, see `cns_drake.ageing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import shutil
from typing import Any

import numpy as np

from cns_drake.ageing.aged_map import age_map
from cns_drake.ageing.rates import check_years
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder, user_errors, write_text
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.provenance import digest_file
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.simulation.simulated_drive import DriveSimulation
from cns_drake.studies import ladder_rungs, map_pairs
from cns_drake.studies.ladder import RungPlan, query_drives
from evaluation.change.tcr import temporal_change
from evaluation.drives.sampling import sample_frames
from evaluation.localisation.localise import is_right
from evaluation.maps.voxel_maps import VoxelAccumulator
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.report.years import (
    BACKWARD,
    FORWARD,
    MAP_TASK,
    UNCHANGED_TASK,
    AgedPair,
    draw_years,
    lifetime_table,
    year_rows,
    year_table,
    year_text,
)
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.localisation import (
    FAR_STARTS,
    SHIPPED,
    measure_localisation,
)
from evaluation.study.parts import MakePart, Part, StudyFiles

YEARS = (1, 2, 5, 10, 20, 40)
QUICK_YEARS = (5, 20, 40)
# Turned and tilted queries; with --quick, every third.
YEARS_PROTOCOL = FAIR_PROTOCOL
QUICK_PROTOCOL = replace(YEARS_PROTOCOL, query_spacing=30.0, place_spacing=10.0)
# Maps for the TCR have a scan each so many metres.
_MAP_SPACING = 5.0
# The file in its folder with the fingerprint of an aged map.
_PART = "aged.data"
# Expected seconds to map a city.
_MAP_COST = 20.0


@dataclass(frozen=True)
class AgeCity(Step):
    """Lets a city live."""

    source: Path
    years: tuple[int, ...]
    seed: int
    rates: tuple[tuple[str, float], ...]
    folder: Path

    @property
    def output(self) -> Path:
        return self.folder

    def is_done(self) -> bool:
        # A folder that has its final name is complete.
        return Part(self.folder / _PART).is_current(self._made_of())

    def run(self, reporter: Reporter) -> None:
        made_of = self._made_of()
        if (self.folder / _PART).is_file():
            with user_errors(self.folder):
                shutil.rmtree(self.folder)
        age_map(
            self.source,
            self.years,
            self.seed,
            dict(self.rates),
            self.folder,
            finish=lambda draft, _: Part(draft / _PART).write(made_of, None),
        )

    def _made_of(self) -> dict[str, object]:
        files = MapFolder(self.source).files()
        return {
            "files": {one.name: digest_file(one) for one in files},
            "years": list(self.years),
            "seed": self.seed,
            "rates": dict(self.rates),
            "code": code_digest("cns_drake.ageing.aged_map"),
        }


def measure_years(
    maps: Sequence[str] | None,
    years: Sequence[int],
    seeds: Sequence[int],
    rates: Mapping[str, float],
    output: Path,
    cluster: Cluster,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol = YEARS_PROTOCOL,
    directions: Sequence[str] = (FORWARD, BACKWARD),
    *,
    localises: bool = False,
    updates: bool = False,
    on_note: Callable[[str], None] = lambda text: None,
) -> tuple[Path, str]:
    """Measures what years cost; writes tables, chart and findings.

    `<output>/years.csv` and `lifetimes.csv` are the tables, `years.png` (and
    PDF, SVG) the chart, `findings.txt` the findings, `cities/` the aged maps.
    Finished work is not repeated. Years are positive and ascending; the
    directions say whether the database is of today, the query, or both in turn.
    Returns the path of `years.csv`, and the findings.

    Raises:
        InputError: an argument or a map cannot be used, the folder cannot be
            made, or a step failed.
    """
    wanted = check_years(years)
    if wanted[0] <= 0:
        raise InputError(f"--years: {wanted[0]}: not after today")
    drives = query_drives(maps or shipped_maps())
    make_folder(output)
    output = output.absolute()
    cities = {
        (drive.name, seed): AgeCity(
            map_folder(drive).path.resolve(),
            wanted,
            seed,
            tuple(sorted(rates.items())),
            output / "cities" / f"{map_folder(drive).name}_s{seed}",
        )
        for drive in drives
        for seed in seeds
    }
    on_note(f"{len(cities)} cities age")
    run_jobs(
        [Job(f"age {step.folder.name}", step) for step in cities.values()],
        cluster,
    )
    files = StudyFiles(output)
    jobs: list[Job] = []
    found: list[tuple[Scenario, int, int, str, Part, Part, Part]] = []
    # One of each task, in the order of `found`.
    further: dict[str, list[Part]] = {}
    tasks: dict[str, tuple] = {}
    if localises:
        tasks["localise"] = (
            "localised",
            measure_localisation,
            (SHIPPED, ("",) * len(SHIPPED), FAR_STARTS, protocol.query_spacing),
        )
    if updates:
        tasks[MAP_TASK] = (
            "maps",
            map_pairs.measure_maps,
            (map_pairs.study_methods(on_note), map_pairs.STUDY_SPACING),
        )

    def add_tasks(name: str, drives: ladder_rungs.RungDrives) -> None:
        both = DriveSimulation(drives.database), DriveSimulation(drives.query)
        for task, (kind, function, arguments) in tasks.items():
            part = files.part(kind, name)
            step = MakePart(part, function, (*both, *arguments))
            jobs.append(Job(f"{task} task of {name}", step, cost=_MAP_COST))
            further.setdefault(task, []).append(step.part)

    for drive in drives:
        plan = RungPlan(drive, ladder_rungs.NEAR, methods, protocol, files)
        plain = ladder_rungs.plain_drives(drive)
        today = _map_job(drive, files, jobs)
        part = plan.add_rung(
            ladder_rungs.Rung(ladder_rungs.NONE, 0, 0, "", plain)
        )
        found.append((drive, 0, 0, FORWARD, part, today, today))
        add_tasks(drive.name, plain)
        for seed in seeds:
            folder = cities[drive.name, seed].folder
            for k, year in enumerate(wanted):
                aged = {"map": str(folder), "stage": f"{k + 2:02d}"}
                ending = f"y{year}_s{seed}"
                then, before = (
                    one.replaced(**aged, name=f"{one.name}_{ending}")
                    for one in (drive, plain.database)
                )
                mapped = _map_job(then, files, jobs)
                pairs = {
                    FORWARD: replace(plain, query=then),
                    BACKWARD: replace(plain, database=before),
                }
                for direction in directions:
                    rung = ladder_rungs.Rung(
                        direction, year, seed, "", pairs[direction]
                    )
                    part = plan.add_rung(rung)
                    found.append(
                        (drive, year, seed, direction, part, today, mapped)
                    )
                    add_tasks(
                        f"{drive.name}_{ending} {direction}", pairs[direction]
                    )
        jobs += plan.jobs.values()
    run_jobs(jobs, cluster)
    pairs_found = [
        AgedPair(
            map_folder(drive).name,
            year,
            seed,
            direction,
            temporal_change(before.read(), after.read()).symmetric
            if year
            else 0.0,
            part.read(),
            {
                key: value
                for task, parts in further.items()
                for key, value in _values(task, parts[k].read()).items()
            },
        )
        for k, (drive, year, seed, direction, part, before, after) in enumerate(
            found
        )
    ]
    rows = year_rows(pairs_found)
    text = year_text(rows)
    lifetime_table(rows).write_csv(output / "lifetimes.csv")
    write_text(output / "findings.txt", text + "\n")
    year_table(rows).write_csv(output / "years.csv")
    draw_years(rows, output / "years")
    return output / "years.csv", text


def _values(task: str, found: Any) -> dict[tuple[str, str], tuple[float, int]]:
    """Returns `AgedPair.further` of what a part of a task holds."""
    if task != MAP_TASK:
        return {
            (task, method): (float(is_right(rows).mean()), len(rows))
            for method, rows in zip(SHIPPED, found, strict=True)
        }
    truth = found.pop(map_pairs.TRUTH)
    number = truth["gone"] + truth["new"]
    unchanged = 1.0 - truth["called_points"]
    return {
        (UNCHANGED_TASK, map_pairs.TRUTH): (unchanged, number),
        **{
            (task, method): (scores["miou"], number)
            for method, scores in found.items()
        },
    }


def _map_job(drive: Scenario, files: StudyFiles, jobs: list[Job]) -> Part:
    """Adds the job that maps a city along a drive; returns its part."""
    part = files.part("trend", "map", drive.name)
    step = MakePart(part, map_city, (DriveSimulation(drive), _MAP_SPACING))
    jobs.append(Job(f"map {drive.name}", step, cost=_MAP_COST))
    return part


def map_city(
    reporter: Reporter, source: DriveSimulation, spacing: float
) -> np.ndarray:
    """Returns the centroids (N, 3) of the voxel map of a drive's scans [m].

    Scans are `spacing` apart [m].
    """
    drive = source()
    frames = sample_frames(drive.X_WS[:, :3, 3], spacing)
    voxels = VoxelAccumulator()
    for frame in reporter.track(frames, "mapping", len(frames)):
        voxels.add(drive.scan(frame), drive.X_WS[frame])
    return voxels.to_map().centroids_W
