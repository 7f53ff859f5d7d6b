"""Which queries of a pair fail, predicted by what their scans show.

    python tests/benchmarks/predicts_failure.py QUERIES.csv

reads the `queries.csv` of `cns-drake study stages`, and prints a table: for
each pair of drives and method, the mean over all queries and the AUROC of
visible change, of parallax and of their difference, for wrong places and for
wrong poses. Redirect it to
`docs/notes/predicts_failure.csv`.
"""

import collections
import csv
from pathlib import Path
import sys

import numpy as np

from evaluation.recognition import auroc

COLUMNS = (
    "map", "db", "query", "method", "wrong", "predicted_by", "mean", "queries",
    "wrong_queries", "auroc",
)  # fmt: skip
# A pose is right within these errors [m, deg].
_POSE = 2.0, 5.0


def main() -> None:
    """Prints the table."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    with Path(sys.argv[1]).open(encoding="utf-8", newline="") as file:
        conditions = _conditions(csv.DictReader(file))
    for city, database, query, method in sorted({k[:4] for k in conditions}):
        changed, control = (
            conditions[city, database, query, method, stage]
            for stage in ("own", "last")
        )
        numbers = [name.rpartition("_")[2] for name in (database, query)]
        for wrong in ("place", "pose"):
            for row in _rows(changed, control, wrong):
                table.writerow([city, *numbers, method, wrong, *row])


def _conditions(
    reader: csv.DictReader,
) -> dict[tuple[str, ...], list[dict[str, str]]]:
    """Returns map, database, query, method, stage -> unverified answers."""
    found = collections.defaultdict(list)
    names = "map", "database", "query", "method", "both.stage"
    for row in reader:
        if (row["task"], row["verified"]) == ("place", "0"):
            found[tuple(row[name] for name in names)].append(row)
    return found


def _rows(
    changed: list[dict[str, str]], control: list[dict[str, str]], wrong: str
) -> list[list[object]]:
    """Returns the columns from `predicted_by` on.

    Args:
        changed: answers in the pair.
        control: answers to the same queries in an unchanged city.
        wrong: `place` or `pose`.
    """
    frames = [row["query_frame"] for row in changed]
    if frames != [row["query_frame"] for row in control]:
        raise ValueError("pair and control have other queries")
    visible, parallax = (
        np.array([float(row["visible_change"] or "nan") for row in some])
        for some in (changed, control)
    )
    if wrong == "place":
        is_right = np.array([row["correct"] == "1" for row in changed])
    else:
        names = "translation_error", "rotation_error_deg"
        errors = np.array(
            [[float(row[n] or "nan") for n in names] for row in changed]
        )
        is_right = (errors <= _POSE).all(axis=1)
    counts = np.array([row["has_match"] == "1" for row in changed])
    counts &= ~np.isnan(visible) & ~np.isnan(parallax)
    is_wrong = ~is_right[counts]
    if wrong == "pose" and np.isnan(errors).all():
        return []
    measures = {
        "visible_change": visible,
        "parallax": parallax,
        "difference": visible - parallax,
    }
    return [
        [
            name,
            f"{np.nanmean(values):.4f}",
            len(is_wrong),
            int(is_wrong.sum()),
            "" if np.isnan(area) else f"{area:.4f}",
        ]
        for name, values in measures.items()
        for area in [auroc(values[counts], is_wrong)]
    ]


if __name__ == "__main__":
    main()
