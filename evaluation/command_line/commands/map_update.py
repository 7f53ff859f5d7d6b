"""The command `map-update`."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from evaluation.base import InputError, shared_options, terminal
from evaluation.command_line import options
from evaluation.command_line.printed_text import metric_rows

GROUP = "Localise, and keep maps"


class BaselineName(str, Enum):
    FREE_SPACE = "free-space"
    DISTANCE = "distance"
    M3C2 = "m3c2"


def map_update(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    baseline: BaselineName | None = None,
    labels_a: Annotated[Path | None, typer.Option(metavar="FILE")] = None,
    labels_b: Annotated[Path | None, typer.Option(metavar="FILE")] = None,
    align: options.Align = "auto",
    output: Annotated[Path | None, typer.Option(metavar="FOLDER")] = None,
    json: shared_options.Json = False,
) -> None:
    """Score the labels of a change detector on two maps.

    The command compares labels of what changed between map A and map B with the
    ground truth: your own labels (--labels-a and --labels-b), or those of a
    shipped change detector (--baseline). DIR is a folder from cns-drake truth,
    or one with A/map.ply, A/truth.npy, B/map.ply and B/truth.npy of real
    drives, and, for a shipped detector, scans and poses. Points whose
    ground-truth label is 255 are ignored.

    Args:
        folder: Folder with the maps and their ground truth.
        baseline: Shipped change detector to score. By default free-space, if
            you give no labels of your own.
        labels_a: File with your labels of map A: 0 unobserved, 1 kept, 2 gone.
            The file is a .npy file, or a .ply file with a property
            `prediction`. Needs --labels-b.
        labels_b: File with your labels of map B: 1 kept, 3 new, 4 newly seen.
            The file is a .npy file, or a .ply file with a property
            `prediction`. Needs --labels-a.
        output: Folder for the tables results.csv and queries.csv, and for the
            labels that were scored, A.npy and B.npy.

    Example:
        cns-eval map-update maps --baseline distance
    """
    from evaluation.map_update import write_labels
    from evaluation.results import make_output
    from evaluation.verbs import update_map

    if (labels_a is None) != (labels_b is None):
        raise InputError("--labels-a and --labels-b: give both")
    if labels_a is not None and baseline is not None:
        raise InputError("--baseline: not together with --labels-a")
    if output is not None:
        make_output(output, ["map-update"])
    found = update_map(
        folder,
        baseline=(baseline or BaselineName.FREE_SPACE).value,
        labels=(labels_a, labels_b) if labels_a and labels_b else None,
        align=align,
    )
    if output is not None:
        options.write_tables(found, output)
        for side, labels in zip("AB", found.labels, strict=True):
            write_labels(output / f"{side}.npy", labels)
    terminal.show(
        found.to_json(),
        [("method", found.method), *metric_rows(found)],
        json=json,
    )
