"""The command `real`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import shared_options, terminal

GROUP = "Recognise places"


def real(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(metavar="DIR")],
    method: shared_options.Methods = None,
    parameter: shared_options.MethodSettings = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    simulated: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    queries: Annotated[int | None, typer.Option(min=1, metavar="N")] = None,
) -> None:
    """Measure place recognition and registration on real scans.

    DIR contains excerpts of public data sets: KITTI 00 and its revisits,
    nuScenes 1072, Newer College, NCLT, HeLiPR, and bird's-eye images of KITTI.
    DIR can also contain tables with the results of other programs for several
    sessions of a data set. The page "Real drives" of the documentation lists
    the name of each data set's folder. The command names missing data sets, and
    measures all others. The results are written to results.csv and queries.csv,
    which cns-eval compare reads. To resume after an interruption, run the same
    command again.

    Args:
        folder: Folder with the excerpts of public data sets.
        output: Folder for the results; created if it does not exist.
        method: Method of place recognition or of registration to run: the name
            of a shipped method, a Python file with your own method or your own
            function `localise`, or the word standard, which means all standard
            methods of place recognition. By default all standard methods run,
            and the shipped methods of registration.
            May be repeated.
        simulated: Folder with simulated recordings. The scans of a recording
            are added as distractors to the database of each data set that was
            recorded with the same model of LiDAR. The command also trains a
            classifier to distinguish simulated from real scans. The worse the
            classifier, the more realistic the simulation. If the folder
            contains a folder kitti_bev with bird's-eye images, the classifier
            uses these images as well.
        queries: Number of queries in each sequence of bird's-eye images, at
            equal intervals among the queries with a match. The database then
            contains one random match of each query. By default all queries and
            all places are used.

    Example:
        cns-eval real real_scans --output real
    """
    from cns_drake.base import choose_cluster
    from evaluation.real import measure_real
    from evaluation.results import RESULTS
    from evaluation.study import expanded_names

    measure_real(
        folder,
        output,
        choose_cluster(jobs, scheduler),
        expanded_names(method or ()),
        parameter or (),
        simulated,
        terminal.note,
        queries,
    )
    print(output / RESULTS)
