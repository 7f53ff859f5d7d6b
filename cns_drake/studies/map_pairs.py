"""The test pairs of maps, frozen before any method was run on them.

`worlds/map_pairs.csv` lists them: a shipped city that lives for some years, or
an imported one of which a share of the buildings is built later, by seeds that
were drawn at random. A is a drive through the first stage, B another one
through the last. The file of an imported city is given by its digest.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import hashlib
from pathlib import Path

from cns_drake.ageing.aged_map import age_map
from cns_drake.ageing.rates import read_rates
from cns_drake.base.csv_files import read_records, write_csv
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder, read_bytes
from cns_drake.base.map_folder import MapFolder
from cns_drake.base.progress import Track, silent
from cns_drake.imports.import_map import import_city
from cns_drake.imports.options import ImportOptions
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps, worlds_folder
from cns_drake.studies.map_truth import simulate_survey, write_truth
from evaluation.map_update.baselines import run_baseline
from evaluation.map_update.scores import Labels, score
from evaluation.map_update.sessions import Label, read_labels, read_pair

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
)
_COLUMNS = ("pair", "method", *_SCORES, "gone", "new")


@dataclass(frozen=True)
class MapPair:
    """A test pair.

    Attributes:
        name: of the pair.
        source: a shipped map, or the name of a city's file.
        years: that a shipped map lives; None for an import.
        seed: of what happens.
        sha256: digest of the file.
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

    Args:
        pair: which one.
        folder: for `city` and `maps`.
        files: folder of cities' files, for imports.
        spacing: way between two scans [m].
        on_note: takes remarks.
        track: reports progress.

    Returns:
        The folder of the maps.

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
        simulate_survey(load_scenario(file).model_copy(update={"stage": stage}))
        for file, stage in ((drives[0], stages[0]), (others[-1], stages[-1]))
    ]
    write_truth(surveys[0], surveys[1], maps, spacing, track)
    return maps


def measure_pairs(
    names: Sequence[str],
    methods: Sequence[str],
    output: Path,
    files: Path | None,
    spacing: float,
    on_note: Callable[[str], None],
    track: Track = silent,
) -> Path:
    """Makes pairs and scores baselines on them; returns the table's path.

    Args:
        names: of the pairs; all without one.
        methods: baselines.
        output: the folder of all pairs.
        files: see `make_pair`.
        spacing: likewise.
        on_note: likewise.
        track: likewise.

    Raises:
        InputError: a name is unknown, or a pair cannot be made.
    """
    pairs = frozen_pairs()
    rows = []
    for name in names or pairs:
        if name not in pairs:
            raise InputError(
                f"unknown pair '{name}'; there are: {', '.join(pairs)}"
            )
        maps = make_pair(
            pairs[name], output / name, files, spacing, on_note, track
        )
        pair = read_pair(maps)
        truth = Labels(
            *(
                read_labels(one.folder / "truth.npy", one, truth=True)
                for one in pair
            )
        )
        for method in methods:
            found = score(pair, truth, run_baseline(method, pair, track), {})
            rows.append(_row(name, method, found, truth))
    path = output / "map_pairs.csv"
    cells = ([row[name] for name in _COLUMNS] for row in rows)
    write_csv(path, _COLUMNS, cells)
    return path


def _row(
    name: str, method: str, scores: Mapping, truth: Labels
) -> dict[str, object]:
    values = {
        key: "" if scores[key] is None else f"{scores[key]:.4f}"
        for key in _SCORES
    }
    return {
        "pair": name,
        "method": method,
        **values,
        "gone": int((truth.A == Label.GONE).sum()),
        "new": int((truth.B == Label.NEW).sum()),
    }


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
    options = ImportOptions(seed=pair.seed, grow=_GROW)
    import_city(path, city, options, on_note)
