"""The command `real`."""

from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import terminal


def real(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    output: Annotated[Path, typer.Option(metavar="DIR")],
    method: list[str] | None = None,
    simulated: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
) -> None:
    """Measure on real scans what a study measures.

    DIR holds excerpts of public data sets, each in a folder of its name, as the
    documentation lists them: KITTI 00 and its revisits, nuScenes 1072, Newer
    College, NCLT and HeLiPR. Those that are missing are named and skipped.
    Writes results.csv and queries.csv, which compare reads.

    Args:
        folder: Folder of the data sets.
        output: Folder to write.
        method: Run only this method or estimator, by name, or a method of your
            own by its Python file; may be repeated.
        simulated: Folder of recordings. Those of the same LiDAR add places, and
            a classifier tells the real scans from them.
    """
    from cns_drake.base.files import make_folder
    from evaluation.real.measuring import Measuring
    from evaluation.results.table import QUERIES, RESULTS

    measuring = Measuring(method or (), terminal.track, terminal.note)
    make_folder(output)
    measuring.run(folder, simulated)
    measuring.queries().write_csv(output / QUERIES)
    measuring.results().write_csv(output / RESULTS)
    print(output / RESULTS)
    terminal.next_command("cns-eval", "compare", output)
