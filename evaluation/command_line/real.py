"""The command `real`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import commands, terminal


def real(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(metavar="DIR")],
    method: commands.Methods = None,
    parameter: commands.MethodSettings = None,
    jobs: commands.Jobs = None,
    scheduler: commands.Scheduler = None,
    simulated: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    queries: Annotated[int | None, typer.Option(min=1, metavar="N")] = None,
) -> None:
    """Measure place recognition and registration on real scans.

    DIR contains excerpts of public data sets, each in a folder with the name
    that the page "Real drives" of the documentation lists: KITTI 00 and its
    revisits, nuScenes 1072, Newer College, NCLT, HeLiPR, bird's-eye images of
    KITTI with poses, and results of other programs over sessions. If a data set
    is missing, the command prints a note and continues with the others. The
    command writes results.csv and queries.csv, which cns-eval compare reads. To
    resume after an interruption, run the same command again.

    Args:
        folder: Folder with the excerpts of public data sets.
        output: Folder for the results; created if it does not exist.
        method: Method of place recognition or of registration to run, instead
            of all shipped methods: the name of a shipped method, standard for
            all standard methods of place recognition, or a Python file that
            registers your own method or defines your own function `localise`.
            May be repeated.
        simulated: Folder with simulated recordings. If a recording has the same
            model of LiDAR as a data set, its scans become further places of the
            data set's database. A classifier then also tries to tell these
            scans from the real ones, which shows how realistic the simulation
            is. The classifier also uses a folder kitti_bev with bird's-eye
            images in it.
        queries: Number of queries in each sequence of bird's-eye images. They
            are chosen evenly among the queries with a match; for each of them,
            one random match is the place. By default, all queries and all
            places.
    """
    from cns_drake.base.jobs.cluster import choose_cluster
    from evaluation.real.measuring import measure_real
    from evaluation.results.table import RESULTS
    from evaluation.study.chosen_methods import with_standard

    measure_real(
        folder,
        output,
        choose_cluster(jobs, scheduler),
        with_standard(method or ()),
        parameter or (),
        simulated,
        terminal.note,
        queries,
    )
    print(output / RESULTS)
