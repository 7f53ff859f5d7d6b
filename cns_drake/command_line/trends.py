"""The command `cns-drake trend`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base.drives.drive import PlacedDrive, check_same_map
from cns_drake.base.interrupts import uninterrupted
from cns_drake.command_line.options import Jobs, MethodFiles, Results, Scheduler
from cns_drake.command_line.simulating import family_members
from evaluation.command_line.options import Settings, with_named_protocol
from evaluation.recognition.protocol import RetrievalProtocol

if TYPE_CHECKING:
    from cns_drake.scenarios.scenario import Scenario


@with_named_protocol
def trend(
    *,
    vary: Annotated[
        Path,
        typer.Option(
            metavar="FAMILY.yaml",
            help="The members of this family are the databases.",
        ),
    ],
    query: Annotated[
        str,
        typer.Option(
            metavar="NAME|SCENARIO.yaml",
            help="The query drive: a shipped drive or a scenario file.",
        ),
    ],
    output: Results,
    method: MethodFiles = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    parameter: Settings = None,
    protocol: RetrievalProtocol,
) -> None:
    """AUC over TCR_sym, of a family of drives.

    No drive is recorded. Writes trend.csv and a figure with 95 % bands: AUC,
    and the share of it that is kept against the same route without change.
    After an interruption the same command goes on where it was.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.simulation.simulated_drive import DriveSimulation
        from evaluation.study.chosen_methods import choose_methods
        from evaluation.study.trend import write_trend
        from evaluation.study.trend_databases import (
            TrendDatabase,
            measure_drives,
        )

    cluster = choose_cluster(jobs, scheduler)
    methods = choose_methods(method or (), parameter or ())
    query_drive = load_scenario(query)
    members = family_members(vary, output, cluster)
    for member in members:
        check_same_map(*map(_placed, (member, query_drive)))
    controls = family_controls(members, query_drive)
    points = measure_drives(
        query_drive.name,
        DriveSimulation(query_drive),
        {
            member.name: TrendDatabase(
                DriveSimulation(member), controls[member.name].name
            )
            for member in members
        },
        {one.name: DriveSimulation(one) for one in controls.values()},
        output,
        cluster,
        methods,
        protocol,
    )
    print(write_trend(points, output))


def _placed(scenario: Scenario) -> PlacedDrive:
    city = None if scenario.map is None else {"map": scenario.map}
    return PlacedDrive(scenario.name, "map", city)


def family_controls(
    members: Sequence[Scenario], query_drive: Scenario
) -> dict[str, Scenario]:
    """Returns member -> its drive through the city of the query drive.

    Members that differ only by their city share one.
    """
    city = {
        name: getattr(query_drive, name)
        for name in ("map", "stage", "world", "without")
    }
    kinds: list[dict] = []
    controls = {}
    for member in members:
        drive = member.model_copy(update={**city, "name": "", "title": ""})
        kind = drive.model_dump()
        if kind not in kinds:
            kinds.append(kind)
        name = f"{query_drive.name}_unchanged_{kinds.index(kind) + 1}"
        controls[member.name] = drive.model_copy(update={"name": name})
    return controls
