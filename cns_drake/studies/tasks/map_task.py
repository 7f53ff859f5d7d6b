"""The task `map`: scores of change detectors on the maps of two drives."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
import tempfile

from cns_drake.ground_truth import labelled_drive, write_truth
from evaluation.base import Key, Reporter
from evaluation.drives import DriveSource
from evaluation.map_update import BASELINES, TRUTH, MapScores, score_methods
from evaluation.study import DataOf, MapTask, Pair


class DrivenMapTask(MapTask):
    """The task `map` on drives; makes their maps, with exact labels."""

    def notes(self) -> Iterator[str]:
        if self.settings["methods"] is None and not _has_m3c2():
            yield "m3c2 is left out: it needs the extra map-update"

    def keys(self, pair: Pair) -> list[Key]:
        made_of = {
            "drives": [pair.database[0].digest, pair.query.digest],
            "methods": list(self._names),
            "spacing": float(self.settings["spacing"]),
        }
        return [Key(self.name, made_of, self.version)]

    def compute(
        self, pair: Pair, data_of: DataOf, reporter: Reporter
    ) -> dict[str, MapScores]:
        return measure_maps(
            reporter,
            pair.database[0].source,
            pair.query.source,
            self._names,
            float(self.settings["spacing"]),
        )

    @property
    def _names(self) -> tuple[str, ...]:
        if self.settings["methods"] is not None:
            return tuple(self.settings["methods"])
        known = (TRUTH, *BASELINES)
        return tuple(one for one in known if one != "m3c2" or _has_m3c2())


def _has_m3c2() -> bool:
    return find_spec("py4dgeo") is not None


def measure_maps(
    reporter: Reporter,
    database: DriveSource,
    query: DriveSource,
    methods: tuple[str, ...],
    spacing: float,
) -> dict[str, MapScores]:
    """Makes labelled maps of two drives, and scores change detectors on them.

    Args:
        reporter: reports progress.
        database, query: sources of the older and the newer drive.
        methods: names of change detectors; see `score_methods`.
        spacing: distance driven between two scans [m].

    Returns:
        Method -> its scores.
    """
    a, b = map(labelled_drive, (database, query))
    with tempfile.TemporaryDirectory() as folder:
        maps = Path(folder) / "maps"
        write_truth(a, b, maps, spacing, across_maps=True)
        return score_methods(reporter, maps, methods)
