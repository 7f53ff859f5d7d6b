"""The tasks of a study, measured on public data sets of few scans.

Each scan of a data set with poses is a query. The places among which it is
searched are all other scans of the same model of LiDAR: from its data set, from
other data sets and from simulated recordings. A place is a single scan; queries
are turned and tilted as in the protocol `fair`. Each scan is also localised,
from a random start, in a map of the scans around it. A classifier (see
`evaluation.real.judge`) also tries to tell each data set from simulated scans
of the same model of LiDAR.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import importlib.util
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.progress import track
from evaluation.clouds.cloud_files import OnNote
from evaluation.drives import Drive
from evaluation.localisation import estimators, localise
from evaluation.maps.voxel_maps import map_drive
from evaluation.methods import (
    Method,
    MethodConfig,
    make_method,
    shipped_methods,
)
from evaluation.methods.method import load_method, run_module
from evaluation.real.data_sets import (
    RealScans,
    open_data_sets,
    simulated_drives,
)
from evaluation.recognition.description import (
    DescribedDrive,
    describe_drive,
    joined_scans,
)
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.place_outcome import Number, PlaceOutcome
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.recognition.retrieval import compare_with_gates
from evaluation.study.engine import Engine
from evaluation.study.parts import Part
from evaluation.study.tasks.localise import LocaliseTask
from evaluation.study.tasks.place import PlaceTask, PoseTask
from evaluation.study.tasks.task import Held, Jobs, NamedDrive, Pair, Task

_SIMULATED = replace(FAIR_PROTOCOL, scans_per_place=1)
# Every real scan is a query and a place.
_REAL = replace(_SIMULATED, query_spacing=1e-6, place_spacing=1e-6)
# Name of the experiment.
_NAME = "real"
# The default starts of a study [m, deg].
_STARTS = localise.Starts(2.0, 10.0)
# Scans within this distance make the map of a query [m].
_AROUND = 30.0
_ESTIMATORS = tuple(
    one for one in estimators.METHODS if one != estimators.KISS_MATCHER
)
# Number of random draws of patches for the judge; their AUCs differ by up to
# 0.04.
_DRAWS = 1


class _Part(NamedTuple):
    """Described places from one data set or one recording."""

    name: str
    world: str
    described: list[DescribedDrive]
    scans: list[np.ndarray]


def _height_of(one: RealScans) -> dict[str, float]:
    """Returns the height of a LiDAR that differs from the methods' default."""
    height = one.data_set.height
    usual = MethodConfig().sensor_height
    return {} if height == usual else {"sensor_height": height}


class Measuring:
    """Runs place recognition and localisation on real data sets.

    With simulated recordings, it also measures how well a classifier tells real
    from simulated scans.

    Attributes:
        engine: makes the tables of what has been measured.
    """

    def __init__(self, names: Sequence[str], on_note: OnNote):
        """Chooses the methods and estimators to measure.

        Args:
            names: names of methods and estimators, or Python files with your
                own; if empty, all shipped ones. A file of an estimator defines
                a function `localise`.
            on_note: is called with each note for the user.

        Raises:
            InputError: a method is not known, its file cannot be used, or two
                estimators have one name.
        """
        self._note = on_note
        chosen = names or (*shipped_methods(), *_ESTIMATORS)
        aligning = {
            one: Path(one).stem
            for one in chosen
            if one in estimators.METHODS
            or (
                one.endswith(".py")
                and hasattr(run_module(Path(one)), "localise")
            )
        }
        self._methods = [
            load_method(Path(one)).name if one.endswith(".py") else one
            for one in chosen
            if one not in aligning
        ]
        self._made_for(1.0)
        settings = estimators.default_settings
        self._estimators = {
            name: (estimators.make_estimator(one, settings(one)), settings(one))
            for one, name in aligning.items()
        }
        if len(self._estimators) < len(aligning):
            raise InputError(
                "--method: two registration methods have one name:"
                f" {', '.join(aligning)}"
            )
        tasks: list[Task] = [PlaceTask({}, _NAME), PoseTask({}, _NAME)]
        if aligning:
            tasks.append(LocaliseTask({"methods": list(aligning)}, _NAME))
        tasks.append(JudgeTask({}, _NAME))
        self.engine = Engine(
            _NAME, {one.name: one for one in tasks}, {}, Path()
        )

    def _made_for(self, height: float) -> list[Method]:
        """Returns the methods for a height of the LiDAR [m]."""
        values = {"sensor_height": height}
        return [make_method(name, values) for name in self._methods]

    def run(self, folder: Path, simulated: Path | None) -> None:
        """Runs all measurements on the data sets in a folder.

        Args:
            folder: folder that contains a folder for each data set.
            simulated: folder of simulated recordings. Their scans are added as
                places, and a classifier tries to tell the real scans from them.

        Raises:
            InputError: the folder contains no data set, or a data set cannot be
                read.
        """
        found = open_data_sets(folder, self._note)
        for unit in dict.fromkeys(one.data_set.unit for one in found):
            sets = [one for one in found if one.data_set.unit == unit]
            made = (
                simulated_drives(simulated, unit, self._note)
                if simulated
                else []
            )
            self._recognise(sets, made)
            for one in sets:
                if one.data_set.poses:
                    self._localise(one)
                if made:
                    self._judge(one, made)
            if not made:
                self._note(f"{unit}: no simulated scan of it to judge")

    def _add(
        self, one: RealScans, found: Mapping[str, Any], database: str = ""
    ) -> None:
        """Adds a data set's results: task -> its result."""
        names = database or one.name, one.name
        drives = [NamedDrive(name, _Opened(one.drive)) for name in names]
        self.engine.measured.append(
            Pair(
                map_name=one.data_set.world,
                names=names,
                factors={},
                seed=_REAL.seed,
                is_baseline=False,
                stated=_REAL,
                key=" ".join(names),
                database=drives[0],
                query=drives[1],
                way=drives[0],
                protocol=_REAL,
                settings=_height_of(one),
                parts={task: (Held(one),) for task, one in found.items()},
            )
        )

    def _recognise(
        self, sets: Sequence[RealScans], made: Sequence[Drive]
    ) -> None:
        asked = [one for one in sets if one.data_set.poses]
        if not (asked and self._methods):
            return
        methods = self._made_for(asked[0].data_set.height)
        parts = [
            self._described(one.drive, one.name, one.data_set.world, methods)
            for one in sets
        ]
        parts += [
            self._described(one, one.name, one.name, methods, _SIMULATED)
            for one in made
        ]
        for one in asked:
            self._ask(one, parts, methods)

    def _described(
        self,
        drive: Drive,
        name: str,
        world: str,
        methods: Sequence[Method],
        protocol: RetrievalProtocol = _REAL,
    ) -> _Part:
        scans: list[np.ndarray] = []
        described = describe_drive(
            drive,
            methods,
            {"places", "queries"} if protocol is _REAL else {"places"},
            protocol,
            visit=lambda _, cloud: scans.append(cloud),
        )
        return _Part(name, world, described, scans)

    def _ask(
        self,
        one: RealScans,
        parts: Sequence[_Part],
        methods: Sequence[Method],
    ) -> None:
        """Adds a data set's results of the tasks `place` and `pose`."""
        world, drive = one.data_set.world, one.drive
        # The data set itself comes first, then other sets of the same world.
        parts = sorted(
            parts, key=lambda part: (part.name != one.name, part.world != world)
        )
        scans = [scan for part in parts for scan in part.scans]
        worlds = [part.world for part in parts for _ in part.scans]
        known = list(dict.fromkeys(part.world for part in parts))
        of_world = [known.index(part.world) for part in parts]
        is_known = np.ones((len(drive), len(scans)), bool)
        np.fill_diagonal(is_known, False)
        shown = [_REAL.query_scan(drive, k) for k in range(len(drive))]
        overlaps = None
        outcomes = []
        for k, method in enumerate(
            track(methods, f"comparing {one.name}", len(methods), "methods")
        ):
            own = parts[0].described[k]
            places = joined_scans(
                [part.described[k].places for part in parts], of_world
            )
            both = compare_with_gates(
                method,
                replace(own, places=places),
                own,
                _REAL,
                [None, _REAL.radius],
                is_known=is_known,
            )
            asked = own.queries
            if overlaps is None:
                overlaps = best_overlaps(
                    scans, places.X_WS, shown, asked.X_WS, both[0].matches
                )
            outcomes += [
                PlaceOutcome.of(
                    method.name,
                    method,
                    replace(_REAL, gate=gate),
                    found,
                    (one.name, asked.stamps_ns, asked.p_WSs),
                    worlds,
                    overlaps,
                )
                for gate, found in zip((False, True), both, strict=True)
            ]
        self._add(one, {"place": outcomes, "pose": outcomes})

    def _localise(self, one: RealScans) -> None:
        """Adds a data set's results of the task `localise`.

        Each scan is localised in a map of the other scans.
        """
        drive, X_WS = one.drive, one.drive.X_WS
        R_WT = localise.way_axes(X_WS[:, :3, 3], X_WS)
        found: dict[str, list[np.ndarray]] = {n: [] for n in self._estimators}
        frames = range(len(drive)) if found else ()
        for k in track(frames, f"localising {one.name}", len(frames), "scans"):
            apart = np.linalg.norm(X_WS[:, :3, 3] - X_WS[k, :3, 3], axis=1)
            apart[k] = math.inf
            if apart.min() > localise.NEAR:
                continue
            around = np.flatnonzero(apart < _AROUND).tolist()
            mapped = map_drive(drive, estimators.Settings.voxel, frames=around)
            surroundings = estimators.map_of(
                mapped.centroids_W, one.name, estimators.Settings()
            )
            for name, (estimator, settings) in self._estimators.items():
                by = localise.Localiser(surroundings, estimator, settings)
                row, _ = by.query(
                    k, k, drive.scan(k), X_WS[k], R_WT[k], *_STARTS.draw(k)
                )
                found[name].append(row)
        number = max(map(len, found.values()), default=len(drive))
        if number < len(drive):
            self._note(
                f"{one.name}: {number} of {len(drive)} scans localised; the"
                f" others have no other scan within {localise.NEAR:g} m"
            )
        rows = [np.array(some) for some in found.values() if some]
        if rows:
            localise.note_sparse(one.name, rows[0], self._note)
            self._add(one, {"localise": rows})

    def _judge(self, one: RealScans, made: Sequence[Drive]) -> None:
        """Adds how well a classifier tells a data set from simulated scans.

        There is a result for each group of features.
        """
        if not one.data_set.whole:
            self._note(f"{one.name}: thinned scans, not judged")
            return
        if importlib.util.find_spec("sklearn") is None:
            self._note(
                f"{one.name}: not judged; a package is not installed (pip"
                " install 'cns-drake[judge]')"
            )
            return
        from evaluation.real import judge

        places = judge.places_of([one.drive])
        if len(places) < 2:
            self._note(f"{one.name}: one place, not judged")
            return
        found = judge.judge_draws(places, judge.places_of(made), _DRAWS)
        self._add(one, {"judge": found}, database="simulated")


class JudgeTask(Task):
    """Measures how well a classifier tells real scans from simulated ones."""

    name = "judge"

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Part, ...]:
        return ()  # `Measuring` does it.

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for group, auc in found["auc"].items():
            values = {"auc": auc, "auc_control": found["control"][group]}
            for name, value in values.items():
                if not math.isnan(value):
                    number = found["patches"][0]
                    yield Number(group, False, name, value, n=number)


@dataclass(frozen=True)
class _Opened:
    """The source of a drive that is open."""

    drive: Drive

    def __call__(self) -> Drive:
        return self.drive

    def identity(self) -> str:
        return self.drive.name
