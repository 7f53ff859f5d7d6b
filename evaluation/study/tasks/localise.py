"""The task `localise`: scans are localised in a map of the database."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cns_drake.base import points as clouds
from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from evaluation.localisation import estimators, localise
from evaluation.localisation.localise import Starts
from evaluation.recognition.place_outcome import Number, kept_share
from evaluation.study.parts import Part
from evaluation.study.surveys import DriveSource
from evaluation.study.tasks.task import (
    Answered,
    Jobs,
    Pair,
    Task,
    positive,
)

# The methods that need no optional package.
SHIPPED = tuple(
    name for name in estimators.METHODS if name != estimators.KISS_MATCHER
)
_COST = 60.0


class LocaliseTask(Task):
    """Measures how well scans are aligned to a map from wrong initial poses."""

    name = "localise"
    defaults: ClassVar[Mapping[str, Any]] = {
        "methods": list(SHIPPED),
        "starts": [[2.0, 10.0]],
        "spacing": None,
    }

    def check(self, name: str, value: Any, where: str) -> None:
        if name == "spacing":
            positive(value, where)
        elif name == "methods":
            for one in value:
                known = str(one) in estimators.METHODS
                if not known and not Path(str(one)).is_file():
                    raise InputError(
                        f"{where}: {one!r} is neither"
                        f" {', '.join(estimators.METHODS)} nor a file"
                    )
        else:
            try:
                radii = [one.radius for one in self._starts(value)]
            except (TypeError, ValueError):
                radii = []
            except InputError as error:
                _, _, fault = str(error).partition(": ")
                raise InputError(f"{where}: {fault}") from None
            if not radii:
                raise InputError(
                    f"{where}: {value!r} is no list of [metres, degrees]"
                )
            if len(set(radii)) < len(radii):
                raise InputError(f"{where}: two starts at one distance")

    @staticmethod
    def _starts(values: Any) -> tuple[Starts, ...]:
        return tuple(Starts(float(r), float(turn)) for r, turn in values)

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Part, ...]:
        # Estimators of the user are identified by path and content.
        named = tuple(
            Path(one).absolute() if one.endswith(".py") else one
            for one in self.settings["methods"]
        )
        texts = tuple(
            read_bytes(one).hex() if isinstance(one, Path) else ""
            for one in named
        )
        spacing = self.settings["spacing"] or pair.protocol.query_spacing
        arguments = (
            pair.database.source,
            pair.query.source,
            named,
            texts,
            self._starts(self.settings["starts"]),
            spacing,
        )
        part = jobs.files.part("localise", pair.key)
        found = jobs.add(part, measure_localisation, arguments, cost=_COST)
        return (found,)

    def _runs(self, found: Sequence[np.ndarray]) -> Iterator[tuple[str, Any]]:
        """Yields the name of each method and initial error, and its queries."""
        starts = self.settings["starts"]
        rows = iter(found)
        if not found:
            return
        for method in self.settings["methods"]:
            stem = Path(method).stem if method.endswith(".py") else method
            for radius, _ in starts:
                far = f" from {radius:g} m" if len(starts) > 1 else ""
                yield f"{stem}{far}", next(rows)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        then = dict(self._runs(before)) if before is not None else {}
        for method, rows in self._runs(found):
            yield from localise.numbers(rows, method)
            if method in then:
                share = kept_share(
                    float(localise.is_right(rows).mean()),
                    float(localise.is_right(then[method]).mean()),
                )
                yield Number(method, False, "kept", float(share), n=len(rows))

    def answers(self, found: Any) -> Iterator[Answered]:
        for method, rows in self._runs(found):
            yield method, False, localise.columns(rows)


def measure_localisation(
    reporter: Reporter,
    database: DriveSource,
    query: DriveSource,
    methods: tuple[str | Path, ...],
    texts: tuple[str, ...],
    starts: tuple[Starts, ...],
    spacing: float,
) -> list[np.ndarray]:
    """Localises the queries of a pair of drives in one world.

    Each scan is read only once, because a drive may be simulated while it is
    read.

    Args:
        reporter: reports progress.
        database: the drive of the map.
        query: the drive whose scans are localised.
        methods: names of registration methods, or Python files with your own.
        texts: contents of those files, and "" for names. Results are computed
            again if a text changes.
        starts: how the random initial poses of the scans are drawn, one entry
            for each size of their errors.
        spacing: distance between two queries [m].

    Returns:
        An array for each pair of a method and an entry of `starts`: first those
        of the first method, in the order of `starts`. Each array contains one
        record of `evaluation.localisation.localise.QUERY` per query. If no
        query is near the map, the list is empty.
    """
    mapped = database()
    asked = query()
    maps: dict[tuple[float, int], estimators.LocalisationMap] = {}
    localisers = []
    for method in methods:
        settings = estimators.default_settings(str(method))
        key = settings.voxel, settings.neighbours
        if key not in maps:
            # The drive is opened anew for each other map.
            source = mapped if not maps else database()
            maps[key] = estimators.make_map(source, settings)
        estimator = estimators.make_estimator(str(method), settings)
        localisers.append(localise.Localiser(maps[key], estimator, settings))
    try:
        is_mapped = localise.mapped_frames(
            mapped, localisers[0].surroundings, asked
        )
    except InputError as error:
        reporter.note(f"{error}: not localised")
        return []
    frames = localise.query_frames(asked, is_mapped, spacing)
    X_WS = asked.X_WS
    R_WT = localise.way_axes(X_WS[:, :3, 3], X_WS)
    found: list[list[np.ndarray]] = [
        [] for _ in range(len(methods) * len(starts))
    ]
    for frame in track(frames, "localising", len(frames), "scans"):
        scan = clouds.from_xyz(clouds.xyz(asked.scan(frame)))
        ends = iter(found)
        for localiser in localisers:
            for draw in starts:
                row, _ = localiser.query(
                    frame,
                    int(asked.stamps_ns[frame]),
                    scan,
                    X_WS[frame],
                    R_WT[frame],
                    *draw.draw(frame),
                )
                next(ends).append(row)
    localise.note_sparse(asked.name, np.array(found[0]), reporter.note)
    return [np.array(rows) for rows in found]
