"""The command `map-update`."""

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cns_drake.base import shared_options, terminal
from evaluation.command_line import options

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
    output: Annotated[Path | None, typer.Option(metavar="FOLDER")] = None,
    json: shared_options.Json = False,
) -> None:
    """Score the labels of a change detector on two maps.

    The command compares the labels of a change detector with the ground truth.
    The labels say what changed between map A and map B. You give the labels
    (--labels-a and --labels-b), or choose a shipped change detector that
    computes them (--baseline). DIR is a folder from cns-drake export --format
    map-truth, or a folder with the same files for real drives: A/map.ply,
    A/truth.npy, B/map.ply and B/truth.npy. A shipped change detector also needs
    the scans and poses in DIR. Points whose ground-truth label is 255 are
    ignored.

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
            labels that were scored, A.npy and B.npy; created if it does not
            exist.

    Example:
        cns-eval map-update maps --baseline distance
    """
    from cns_drake.base import InputError
    from evaluation.map_update import read_pair, write_labels
    from evaluation.results import make_output
    from evaluation.study import (
        GIVEN,
        LabelledMapTask,
        measure_pairs,
        pair_of_maps,
    )

    if (labels_a is None) != (labels_b is None):
        raise InputError("--labels-a and --labels-b: give both")
    if labels_a is not None and baseline is not None:
        raise InputError("--baseline: not together with --labels-a")
    if output is not None:
        make_output(output, ["map-update"])
    pair = read_pair(folder)
    given = [file for file in (labels_a, labels_b) if file is not None]
    method = (baseline or BaselineName.FREE_SPACE).value
    name = GIVEN if given else method
    maps = pair_of_maps(pair.A.folder, pair.B.folder, folder.resolve().name)
    task = LabelledMapTask(folder, [] if given else [method], given)
    engine = measure_pairs("map-update", [maps], [task], output)
    found = engine.found(maps, task.name)[name]
    if output is not None:
        options.write_tables(engine)
        for session, labels in zip(pair, found.labels, strict=True):
            write_labels(output / f"{session.side}.npy", labels)
    terminal.show(
        {"method": name, **found.scores}, _rows(name, found.scores), json=json
    )


def _rows(name: str, scores: dict) -> Iterator[tuple[str, str]]:
    yield "method", name
    yield "mean IoU", terminal.number_text(scores["miou"])
    for label in ("kept", "gone", "new", "unobserved"):
        yield f"  {label}", terminal.number_text(scores[f"iou_{label}"])
    for title, part in (
        ("by point", scores),
        ("within 0.2 m", scores["within_02m"]),
        ("within 0.5 m", scores["within_05m"]),
        ("by structure", scores["by_structure"]),
    ):
        text = ", ".join(
            f"{change} {terminal.number_text(part[f'precision_{change}'])} and "
            f"{terminal.number_text(part[f'recall_{change}'])}"
            for change in ("gone", "new")
        )
        yield f"precision and recall {title}", text
    still = scores["without_vehicles_and_people"]["miou"]
    yield "mean IoU without vehicles and people", terminal.number_text(still)
    updated = scores["updated_map"]
    yield (
        "updated map: complete, accurate, Chamfer",
        f"{terminal.number_text(updated['completeness'])}, "
        f"{terminal.number_text(updated['accuracy'])}, "
        f"{terminal.number_text(updated['chamfer'])} m",
    )
