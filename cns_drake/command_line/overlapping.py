"""The command `cns-drake overlap`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.interrupts import uninterrupted
from evaluation.command_line.options import MaxRange, PlaceSpacing, QuerySpacing
from evaluation.recognition.protocol import PAPER_PROTOCOL, RetrievalProtocol

_Drive = Annotated[str, typer.Argument(metavar="NAME|SCENARIO.yaml")]


def overlap(
    database: _Drive,
    query: _Drive,
    *,
    output: Annotated[
        Path, typer.Option(metavar="FILE.csv", help="Table to write.")
    ],
    query_spacing: QuerySpacing = PAPER_PROTOCOL.query_spacing,
    place_spacing: PlaceSpacing = PAPER_PROTOCOL.place_spacing,
    max_range: MaxRange = PAPER_PROTOCOL.max_range,
) -> None:
    """Exact overlap of queries with places.

    Rays are cast in the city of the first drive, its database, at the points of
    the second drive's scans. Nothing is recorded.
    """
    with uninterrupted():
        from cns_drake.base.files import make_folder
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.simulation.simulated_drive import DriveSimulation
        from cns_drake.studies.exact_overlap import exact_overlaps
        from evaluation.recognition.overlap_truth import (
            compared_frames,
            write_overlaps,
        )

    protocol = RetrievalProtocol(
        query_spacing=query_spacing,
        place_spacing=place_spacing,
        max_range=max_range,
    )
    # Before minutes of work.
    make_folder(output.parent)
    places, queries = (
        DriveSimulation(load_scenario(name))() for name in (database, query)
    )
    found = exact_overlaps(places, queries, protocol, terminal.track)
    frames = compared_frames(places, queries, protocol)
    write_overlaps(output, *frames, found)
    print(output)
