"""The command `real`."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import commands, terminal
from cns_drake.base.errors import InputError


def real(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(metavar="DIR")],
    method: commands.Methods = None,
    simulated: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
) -> None:
    """Measure place recognition and registration on real scans.

    DIR contains excerpts of public data sets, each in a folder with the name
    that the page "Real drives" of the documentation lists: KITTI 00 and its
    revisits, nuScenes 1072, Newer College, NCLT and HeLiPR. If a data set is
    missing, the command says so and goes on without it. It writes results.csv
    and queries.csv, which cns-eval compare reads.

    Args:
        folder: Folder with the excerpts of public data sets.
        output: Folder for the results; created if it does not exist.
        method: Place-recognition method or registration method to run, and no
            others: the name of a shipped one, standard for all standard methods
            of place recognition, or a Python file that registers your own
            method or defines your own function `localise`. May be repeated. By
            default all shipped ones.
        simulated: Folder with simulated recordings. Recordings with the same
            model of LiDAR as a data set are used in two ways: their scans are
            added to the data set's database as further places, and a classifier
            is trained to tell them from the real scans, which shows how
            realistic the simulated scans are.
    """
    from cns_drake.base.files import make_folder
    from evaluation.real.measuring import Measuring
    from evaluation.results.table import RESULTS
    from evaluation.study.chosen_methods import with_standard

    measuring = Measuring(with_standard(method or ()), terminal.note)
    make_folder(output)
    measuring.run(folder, simulated)
    results, _ = measuring.engine.tables()
    if not results.rows:
        raise InputError(
            f"{folder}: no data set that these methods can measure; the notes"
            " say why"
        )
    replace(measuring.engine, output=output).write_tables()
    print(output / RESULTS)
