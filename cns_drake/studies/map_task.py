"""The task `map`: scores of change detectors on the maps of two drives."""

from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
import tempfile
from typing import Any, ClassVar

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.step import Reporter
from cns_drake.simulation.simulated_drive import SimulationSource
from cns_drake.studies import map_truth
from evaluation.map_update.baselines import BASELINES, run_baseline
from evaluation.map_update.scores import Labels, score
from evaluation.map_update.sessions import Label, read_pair, read_truth
from evaluation.recognition.place_outcome import Number
from evaluation.study.parts import Part
from evaluation.study.surveys import RecordingSource
from evaluation.study.tasks.task import Jobs, Pair, Task, positive

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
# Name under which the true labels are scored, like a method's labels.
TRUTH = "truth"
_COST = 60.0


class MapTask(Task):
    """Scores change detectors, which label points as kept, gone or new."""

    name = "map"
    defaults: ClassVar[Mapping[str, Any]] = {"methods": None, "spacing": 5.0}

    def check(self, name: str, value: Any, where: str) -> None:
        if name == "spacing":
            positive(value, where)
            return
        known = (TRUTH, *BASELINES)
        for one in value:
            if one not in known:
                raise InputError(
                    f"{where}: {one!r} is none of {', '.join(known)}"
                )

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Part, ...]:
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
        return (jobs.add(part, measure_maps, arguments, cost=_COST),)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for method, scores in found.items():
            number = scores["gone"] + scores["new"]
            for name in (*_SCORES, "gone", "new"):
                if scores[name] is not None:
                    value = float(scores[name])
                    yield Number(method, False, name, value, n=number)


def measure_maps(
    reporter: Reporter,
    database: SimulationSource | RecordingSource,
    query: SimulationSource | RecordingSource,
    methods: tuple[str, ...],
    spacing: float,
) -> dict[str, dict[str, float | None]]:
    """Makes labelled maps of two drives, and scores change detectors on them.

    Args:
        reporter: reports progress.
        database, query: sources of the older and the newer drive.
        methods: names of change detectors; see `score_methods`.
        spacing: distance driven between two scans [m].

    Returns:
        Method -> name of a score -> its value.
    """
    a, b = (
        map_truth.simulate_survey(source.scenario)
        if isinstance(source, SimulationSource)
        else map_truth.open_survey(source.path)
        for source in (database, query)
    )
    with tempfile.TemporaryDirectory() as folder:
        maps = Path(folder) / "maps"
        map_truth.write_truth(a, b, maps, spacing, across_maps=True)
        return score_methods(maps, methods)


def score_methods(
    maps: Path, methods: tuple[str, ...]
) -> dict[str, dict[str, float | None]]:
    """Scores the labels of change detectors against exact labels.

    Args:
        maps: folder with the maps of two drives and their exact labels.
        methods: names of change detectors. The name `TRUTH` scores the exact
            labels themselves.

    Returns:
        Method -> name of a score -> its value, or None if it is undefined.
        `gone` and `new` are numbers of points with these exact labels.

    Raises:
        InputError: the folder cannot be read, or a detector cannot run.
    """
    pair = read_pair(maps)
    truth = Labels(*read_truth(pair))
    found = {}
    for method in methods:
        labels = truth if method == TRUTH else run_baseline(method, pair)
        scores = score(pair, truth, labels, {})
        found[method] = {
            **{name: scores[name] for name in _SCORES},
            "gone": int((truth.A == Label.GONE).sum()),
            "new": int((truth.B == Label.NEW).sum()),
        }
    return found
