"""The command `real`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal
from cns_drake.base.errors import InputError


def real(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(metavar="DIR")],
    method: list[str] | None = None,
    simulated: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
) -> None:
    """Measure place recognition and registration on real scans.

    DIR holds excerpts of public data sets, each in a folder named as the
    documentation lists them: KITTI 00 and its revisits, nuScenes 1072, Newer
    College, NCLT and HeLiPR. Missing data sets are named and skipped. Writes
    results.csv and queries.csv, which cns-eval compare reads.

    Args:
        folder: Folder with the excerpts.
        output: Folder for the results.
        method: Method or estimator to run: the name of a shipped one, or the
            Python file of your own; by default all; may be repeated.
        simulated: Folder of simulated recordings. Those of the same LiDAR add
            places to the database, and a classifier is trained to tell them
            from the real scans.
    """
    from cns_drake.base.files import make_folder
    from evaluation.real.measuring import Measuring
    from evaluation.results.table import QUERIES, RESULTS

    measuring = Measuring(method or (), terminal.track, terminal.note)
    make_folder(output)
    measuring.run(folder, simulated)
    if not measuring.rows:
        raise InputError(
            f"{folder}: no data set that these methods can measure; the notes"
            " say why"
        )
    measuring.queries().write_csv(output / QUERIES)
    measuring.results().write_csv(output / RESULTS)
    print(output / RESULTS)
    terminal.next_command("cns-eval", "compare", output)
