"""Results of other programs over sessions, such as months of a data set.

A file `sessions/NAME.csv` has a row for each session. Its columns are `days`
(since the session of the map), `r1` (R@1 of one program), and `low` and `high`
(the limits of a 95 % interval of R@1). In the table of results, the rows of
this file belong to a method NAME and have the factor `days`. A chart shows the
curves of all files.
"""

from collections.abc import Sequence
import itertools
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.files import listed
from cns_drake.base.number_text import number_within
from evaluation.recognition.protocol import RECORDED_PROTOCOL
from evaluation.results.figure_files import save_figure
from evaluation.results.figure_text import escape_dollars
from evaluation.results.keys import made_by
from evaluation.results.styles import METHOD_STYLES
from evaluation.results.table import Row

FOLDER = "sessions"
CHART = "sessions"
_COLUMNS = ("days", "r1", "low", "high")
# Greatest number of days since the map, a century.
_MOST_DAYS = 36525.0
# Size of the chart [inches].
_SIZE = (6.0, 3.6)


def read_sessions(folder: Path, experiment: str) -> list[Row]:
    """Returns the results of all files `*.csv` in a folder, in order of days.

    Args:
        folder: folder of the files; it need not exist.
        experiment: name of the experiment, for the rows.

    Raises:
        InputError: there is a folder but no file in it, or a file lacks a
            column or a row, has the same day twice, or has a value that is no
            number or not in its range.
    """
    if not folder.exists():
        return []
    files = listed(folder, "*.csv")
    if not files:
        raise InputError(f"{folder}: no table (*.csv) in it")
    return [row for file in files for row in _read_rows(file, experiment)]


def _read_rows(file: Path, experiment: str) -> list[Row]:
    found: dict[float, Row] = {}
    for line, cells in read_records(file, _COLUMNS):
        days, r1, low, high = (
            number_within(
                cells[name],
                _MOST_DAYS if name == "days" else 1.0,
                f"{file}: line {line}: {name}",
            )
            for name in _COLUMNS
        )
        if days < 0.0 or days in found:
            fault = "negative" if days < 0.0 else "there twice"
            raise InputError(f"{file}: line {line}: days: {days:g} is {fault}")
        if not 0.0 <= low <= r1 <= high:
            raise InputError(
                f"{file}: line {line}: not in the order 0, low, r1, high, 1"
            )
        found[days] = Row(
            experiment=experiment,
            map=FOLDER,
            database="map",
            query="session",
            seed=0,
            factors={"days": days},
            task="place",
            method=file.stem,
            gate=False,
            **made_by(RECORDED_PROTOCOL, {"sessions": file.stem}),
            metric="r1",
            value=r1,
            low=low,
            high=high,
        )
    if not found:
        raise InputError(f"{file}: no row")
    return [found[days] for days in sorted(found)]


def draw_sessions(rows: Sequence[Row], folder: Path) -> Path:
    """Draws R@1 over days, with intervals, and returns the path of the picture.

    Args:
        rows: rows from `read_sessions`.
        folder: folder to which `sessions.png` and `sessions.pdf` are written.

    Raises:
        InputError: a file cannot be written.
    """
    with rc_context({"font.size": 10.0}):
        figure = Figure(figsize=_SIZE, layout="constrained")
        axes = figure.subplots()
        names = dict.fromkeys(row.method for row in rows)
        styles = itertools.cycle(METHOD_STYLES.values())
        for name, (colour, style, marker) in zip(names, styles, strict=False):
            of_method = [row for row in rows if row.method == name]
            below = [row.value - row.low for row in of_method]
            above = [row.high - row.value for row in of_method]
            axes.errorbar(
                [float(str(row["days"])) for row in of_method],
                [row.value for row in of_method],
                [below, above],
                linestyle=style,
                marker=marker,
                color=colour,
                capsize=2,
                ms=5,
                label=escape_dollars(name),
            )
        axes.set_xlabel("days after the map")
        axes.set_ylabel("R@1")
        axes.set_ylim(0.0, 1.02)
        axes.grid(alpha=0.3)
        axes.legend(loc="lower left")
        save_figure(figure, folder / CHART, ("pdf", "png"))
    return folder / f"{CHART}.png"
