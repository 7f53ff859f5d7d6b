"""The test pairs of maps, frozen before any method was run on them.

`worlds/map_pairs.csv` lists them: a shipped city that lives for some years, or
an imported one of which a share of the buildings is built later, by seeds that
were drawn at random. A is a drive through the first stage, B another one
through the last. The file of an imported city is given by its digest.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import hashlib
from importlib.util import find_spec
import math
from pathlib import Path
import tempfile

from cns_drake.ageing.aged_map import age_map
from cns_drake.ageing.rates import read_rates
from cns_drake.base.csv_files import read_records, write_csv
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder, read_bytes
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.map_folder import MapFolder
from cns_drake.base.progress import Track, silent
from cns_drake.imports.import_map import import_city
from cns_drake.imports.options import ImportOptions
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps, worlds_folder
from cns_drake.simulation.simulated_drive import DriveSimulation
from cns_drake.studies import map_truth
from evaluation.map_update.baselines import BASELINES, run_baseline
from evaluation.map_update.scores import Labels, score
from evaluation.map_update.sessions import Label, read_pair, read_truth
from evaluation.report.ladder import CauseCell, draw_cells
from evaluation.report.tables import Table
from evaluation.study.localisation import ComparedPair, measure_pairs
from evaluation.study.surveys import RecordedDrive

# Share of an imported city's buildings that its first stage lacks.
_GROW = 0.3
_SCORES = (
    "miou",
    *(f"iou_{name}" for name in ("kept", "gone", "new", "unobserved")),
    *(
        f"{kind}_{name}"
        for name in ("gone", "new")
        for kind in ("precision", "recall")
    ),
    "called_points",
    "called_structures",
    "right_structures",
)
# Title of a panel -> the scores that are its colours and its numbers.
_DRAWN = {
    "mean IoU of points [%]": ("miou", "miou"),
    "structures called gone or new [%]": (
        "right_structures",
        "called_structures",
    ),
}
# The true labels, as those of a method.
TRUTH = "truth"
# Way between two scans of a pair that is one of many [m].
STUDY_SPACING = 5.0


@dataclass(frozen=True)
class MapPair:
    """A test pair.

    The source is a shipped map that lives for so many years, or the file of a
    city, with its digest and without years.
    """

    name: str
    source: str
    years: int | None
    seed: int
    sha256: str


def frozen_pairs() -> dict[str, MapPair]:
    """Returns the test pairs by name."""
    table = worlds_folder() / "map_pairs.csv"
    return {
        row["pair"]: MapPair(
            row["pair"],
            row["source"],
            int(row["years"]) if row["years"] else None,
            int(row["seed"]),
            row["sha256"],
        )
        for _, row in read_records(
            table, ("pair", "source", "years", "seed", "sha256")
        )
    }


def make_pair(
    pair: MapPair,
    folder: Path,
    files: Path | None,
    spacing: float,
    on_note: Callable[[str], None],
    track: Track = silent,
) -> Path:
    """Makes the city and the labelled maps of a pair, unless they are there.

    They are `city` and `maps` in the folder; the latter is returned. `files` is
    the folder of cities' files, for imports. Scans are `spacing` apart [m].

    Raises:
        InputError: a file is missing or another one, or cannot be written.
    """
    city, maps = folder / "city", folder / "maps"
    if maps.is_dir():
        return maps
    make_folder(folder)
    if not city.is_dir():
        if pair.years is None:
            _import(pair, city, files, on_note)
        else:
            source = shipped_maps()[pair.source]
            rates = read_rates(None, 1.0)
            age_map(source, (pair.years,), pair.seed, rates, city, on_note)
    stages = sorted(MapFolder(city).stages())
    drives = MapFolder(city).drives()
    # An imported city has another way at each stage.
    others = sorted(city.glob("other_*.yaml")) or drives
    surveys = [
        map_truth.simulate_survey(load_scenario(file).replaced(stage=stage))
        for file, stage in ((drives[0], stages[0]), (others[-1], stages[-1]))
    ]
    map_truth.write_truth(surveys[0], surveys[1], maps, spacing, track)
    return maps


def score_pairs(
    names: Sequence[str],
    methods: Sequence[str],
    output: Path,
    files: Path | None,
    spacing: float,
    on_note: Callable[[str], None],
    track: Track = silent,
) -> Path:
    """Makes pairs and scores baselines on them; returns the table's path.

    All pairs are made if none is named.

    Raises:
        InputError: a name is unknown, or a pair cannot be made.
    """
    pairs = frozen_pairs()
    rows: list[dict[str, object]] = []
    for name in names:
        if name not in pairs:
            raise InputError(
                f"unknown pair '{name}'; there are: {', '.join(pairs)}"
            )
    for name in names or pairs:
        maps = make_pair(
            pairs[name], output / name, files, spacing, on_note, track
        )
        rows += [
            {"pair": name, "method": method, **scores}
            for method, scores in score_methods(maps, methods, track).items()
        ]
    path = output / "map_pairs.csv"
    write_csv(path, list(rows[0]), (row.values() for row in rows))
    return path


def score_methods(
    maps: Path, methods: Sequence[str], track: Track = silent
) -> dict[str, dict[str, float | None]]:
    """Returns method -> name -> value of scores of baselines or of `TRUTH`.

    Raises:
        InputError: the folder cannot be read, or a baseline cannot run.
    """
    pair = read_pair(maps)
    truth = Labels(*read_truth(pair))
    found = {}
    for method in methods:
        labels = truth if method == TRUTH else run_baseline(method, pair, track)
        scores = score(pair, truth, labels, {})
        found[method] = {
            **{name: scores[name] for name in _SCORES},
            "gone": int((truth.A == Label.GONE).sum()),
            "new": int((truth.B == Label.NEW).sum()),
        }
    return found


def study_methods(on_note: Callable[[str], None]) -> tuple[str, ...]:
    """Returns the truth and all baselines that can run."""
    names = [TRUTH, *BASELINES]
    if find_spec("py4dgeo") is None:
        on_note("m3c2 is left out: it needs the extra map-update")
        names.remove("m3c2")
    return tuple(names)


def measure_maps(
    reporter: Reporter,
    database: DriveSimulation | RecordedDrive,
    query: DriveSimulation | RecordedDrive,
    methods: tuple[str, ...],
    spacing: float,
) -> dict[str, dict[str, float | None]]:
    """Maps two drives and scores methods like `score_methods`.

    Scans are `spacing` apart [m].
    """
    a, b = (
        map_truth.simulate_survey(source.scenario)
        if isinstance(source, DriveSimulation)
        else map_truth.open_survey(source.path)
        for source in (database, query)
    )
    with tempfile.TemporaryDirectory() as folder:
        maps = Path(folder) / "maps"
        map_truth.write_truth(
            a, b, maps, spacing, reporter.track, across_maps=True
        )
        return score_methods(maps, methods, reporter.track)


def update_pairs(
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    on_note: Callable[[str], None],
) -> Path:
    """Scores all baselines on the maps of pairs of drives.

    Writes `map_update.csv`, a row for each pair and method, and a figure.
    Finished pairs are not repeated.

    Returns:
        The path of the table.

    Raises:
        InputError: the folder cannot be made, or a step failed.
    """
    found = measure_pairs(
        pairs,
        output,
        cluster,
        measure_maps,
        (study_methods(on_note), STUDY_SPACING),
        "maps",
    )
    rows, cells = [], []
    for pair, of_pair in zip(pairs, found, strict=True):
        for method, scores in of_pair.items():
            rows.append(
                {
                    **pair.keys,
                    "method": method,
                    **scores,
                    "strength": pair.rung.strength,
                }
            )
            for title, (colour, number) in _DRAWN.items():
                share, part = scores[colour], scores[number]
                cells.append(
                    CauseCell(
                        pair.rung.map_name,
                        title,
                        method,
                        pair.rung.cause,
                        pair.rung.level,
                        math.nan if share is None else share,
                        "–" if part is None else f"{100.0 * part:.0f}",
                    )
                )
    table = output / "map_update.csv"
    Table.of_rows(rows).write_csv(table)
    draw_cells(cells, "mean IoU; right structures", output / "map_update")
    return table


def _import(
    pair: MapPair,
    city: Path,
    files: Path | None,
    on_note: Callable[[str], None],
) -> None:
    path = (files or Path()) / pair.source
    if not path.is_file():
        raise InputError(
            f"{path}: no such file; --files names the folder of the cities "
            "(docs/map_update.md says where they are from)"
        )
    if hashlib.sha256(read_bytes(path)).hexdigest() != pair.sha256:
        raise InputError(f"{path}: not the file of the test pair {pair.name}")
    # A road network gets buildings of its own, in two stages.
    grow = None if path.suffix == ".xodr" else _GROW
    import_city(path, city, ImportOptions(seed=pair.seed, grow=grow), on_note)
