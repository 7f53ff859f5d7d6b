"""The task `map`: scores of change detectors on the maps of two drives."""

from importlib.util import find_spec
from pathlib import Path
import tempfile

from cns_drake.ground_truth import labelled_drive, write_truth
from cns_drake.simulation import SimulationSource
from evaluation.base import Reporter
from evaluation.drives import RecordingSource
from evaluation.map_update import BASELINES, TRUTH, MapScores, score_methods
from evaluation.study import Jobs, MapTask, Pair, Result

_COST = 25.0


class DrivenMapTask(MapTask):
    """The task `map` on drives; makes their maps, with exact labels."""

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        methods = self.settings["methods"]
        if methods is None:
            # M3C2 needs the extra map-update.
            methods = [TRUTH, *BASELINES]
            if find_spec("py4dgeo") is None:
                methods.remove("m3c2")
                note = "m3c2 is left out: it needs the extra map-update"
                jobs.notes[note] = None
        arguments = (
            pair.database.source,
            pair.query.source,
            tuple(methods),
            float(self.settings["spacing"]),
        )
        part = jobs.files.part("map", pair.key)
        found = jobs.add(
            part, measure_maps, arguments, (), _COST, self.version, pair.title
        )
        return (found,)


def measure_maps(
    reporter: Reporter,
    database: SimulationSource | RecordingSource,
    query: SimulationSource | RecordingSource,
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
