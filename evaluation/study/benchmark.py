"""The whole benchmark on a folder of recordings: tables, figures, a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import run_jobs
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.study.assembly import assemble
from evaluation.study.chosen_methods import choose_methods
from evaluation.study.collection import find_recordings
from evaluation.study.plan import plan_study


def write_report(
    recordings: Path,
    output: Path,
    cluster: Cluster,
    own_methods: Iterable[Path] = (),
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    on_note: Callable[[str], None] = lambda text: None,
    *,
    settings: Iterable[str] = (),
    with_costs: bool = False,
    reference_for: Callable[[set[str]], Reference] = lambda maps: NO_REFERENCE,
    lidar: str | None = None,
) -> Path:
    """Measures all recordings in a folder; writes tables, figures, a page.

    See `evaluation.study` for the files. Results of an earlier run, finished
    or not, are used if they belong to the same recordings and methods.

    Args:
        recordings: folder of recordings; drives of one map that share stage
            and route with others serve as same-stage controls.
        output: folder to write, made if needed.
        cluster: where the work is done.
        own_methods: Python files with one method each, to run besides those
            of this package.
        protocol: of place recognition.
        on_note: gets notes on recordings that are left out, and on cities
            without a pair to compare.
        settings: see `choose_methods`.
        with_costs: whether to measure the costs of the methods, too.
        reference_for: returns the reference for the report of some maps.
        lidar: name of the LiDAR, for recordings with several.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a recording cannot be read, or the output cannot be
            written.
    """
    methods = choose_methods(own_methods, settings)
    found = find_recordings(recordings, on_note, lidar)
    reference = reference_for({one.map_name for one in found})
    jobs = plan_study(
        found,
        output,
        methods,
        protocol,
        with_costs=with_costs,
        reference=reference,
    )
    make_folder(output)
    run_jobs(jobs, cluster)
    return assemble(
        found,
        output,
        methods,
        protocol=protocol,
        with_costs=with_costs,
        reference=reference,
        on_note=on_note,
    )
