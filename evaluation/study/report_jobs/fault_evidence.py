"""Finds evidence, in two drives' scans, on why top-ranked places are wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base.jobs.step import Reporter
from cns_drake.base.points import xyz
from cns_drake.base.poses import inverse, transform
from cns_drake.base.progress import track
from cns_drake.drives.drive import Drive
from evaluation.drives.scan_clouds import within_range
from evaluation.maps.voxel_maps import downsample
from evaluation.methods import MethodConfig
from evaluation.methods.layered_overlap import LayeredOverlap, LayeredScan
from evaluation.recognition.fault_names import PairEvidence
from evaluation.recognition.faults import NEARLY
from evaluation.recognition.overlap_truth import sample_points
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.seen_surfaces import SeenSurfaces
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.features import KeptScans
from evaluation.study.storage.parts import Part

# Points at least this high above the ground are non-ground points [m].
_LEAST_HEIGHT = 0.5
# Edge of the cells in which a scan keeps one point for alignment [m].
_CELL = 0.5
# Greatest distance of two points that coincide [m].
_COINCIDENT = 1.0


def explain_faults(
    reporter: Reporter,
    drives: tuple[Part, Part],
    methods: tuple[MethodChoice, ...],
    results: tuple[Part, ...],
    protocol: RetrievalProtocol,
) -> PairEvidence | None:
    """Returns evidence on why methods rank wrong places first for queries.

    The result is None if no query has a match.

    Args:
        reporter: reports progress.
        drives: files with the scans (`KeptScans`) of the database and of the
            query.
        methods: methods of the results.
        results: file with each method's outcomes on the pair.
        protocol: protocol of the results.
    """
    found = []
    for choice, part in zip(methods, results, strict=True):
        found += [
            replace(one, method=choice.name)
            for one in part.read()
            if one.is_gated == protocol.gate
        ]
    if not any(one.outcomes.has_match.any() for one in found):
        return None
    database, query = (part.read() for part in drives)
    evidence = find_evidence(database, query, found, protocol)
    # The visible change concerns the queries as the protocol shows them.
    return replace(evidence, overlaps=found[0].columns["overlap"])


def find_evidence(
    database: Drive | KeptScans,
    query: Drive | KeptScans,
    results: Sequence[PlaceOutcome],
    protocol: RetrievalProtocol,
) -> PairEvidence:
    """Returns evidence on why the top-ranked places of queries are wrong.

    The scan of each query is compared with the scans of its matches and of its
    wrong top-ranked places.

    Args:
        database: drive of the places.
        query: drive of the queries.
        results: results of methods on this pair.
        protocol: protocol of the results.

    Raises:
        InputError: a scan cannot be read.
    """
    first = results[0]
    wrong = {one.method: _wrong_places(one) for one in results}
    rows, matched = first.matches.T
    is_needed = np.zeros(len(first.place_frames), dtype=bool)
    is_needed[matched] = True
    for places in wrong.values():
        is_needed[places[places >= 0]] = True
    scans = {}
    for place in track(
        np.flatnonzero(is_needed).tolist(),
        f"reasons: reading {database.name}",
        int(is_needed.sum()),
        "places",
    ):
        frame = int(first.place_frames[place])
        scans[place] = _ComparedScan.of(database, frame, protocol.max_range)
    classes = {
        number: str(one.get("class", "unknown"))
        for drive in (database, query)
        for number, one in (drive.instances or {}).items()
    }
    query_frames = first.columns["query_frame"]
    number = len(query_frames)
    overlaps, hidden_shares, changed, right_fits = np.full(
        (4, number), math.nan
    )
    changed_classes = [""] * number
    fits = {method: np.full(number, math.nan) for method in wrong}
    for row in track(
        range(number), f"reasons: comparing {query.name}", number, "queries"
    ):
        frame = int(query_frames[row])
        query_scan = _ComparedScan.of(query, frame, protocol.max_range)
        matches = matched[rows == row].tolist()
        right = None
        if matches and len(query_scan.points):
            seen = [
                scans[k].seen.shares_of(query_scan.seen_from(scans[k]))
                for k in matches
            ]
            best = int(np.argmax([one.shown for one in seen]))
            right = scans[matches[best]]
            overlaps[row], hidden_shares[row] = seen[best]
            if classes:
                changed[row], changed_classes[row] = _changed_share(
                    right, query_scan, classes
                )
        answers = sorted({int(places[row]) for places in wrong.values()} - {-1})
        compared = [scans[k] for k in answers]
        if answers and right is not None:
            compared.append(right)
        found = _coinciding_shares(query_scan, compared)
        if len(found) > len(answers):
            right_fits[row] = found[-1]
        fit_of = dict(zip(answers, found, strict=False))
        for method, places in wrong.items():
            fits[method][row] = fit_of.get(int(places[row]), math.nan)
    return PairEvidence(
        overlaps, hidden_shares, changed, changed_classes, right_fits, fits
    )


def _wrong_places(result: PlaceOutcome) -> np.ndarray:
    """Returns the wrong top-ranked place of each query, (Q,).

    The result is -1 for a query whose top-ranked place is right or less than
    two radii away.
    """
    outcomes = result.outcomes
    is_far = result.columns["distance"] > NEARLY * result.radius
    is_wrong = outcomes.has_match & ~outcomes.is_right
    return np.where(is_wrong & is_far, result.best_places[:, 0], -1)


@dataclass(frozen=True, eq=False)
class _ComparedScan:
    """A scan (N, 3) in the frame of the sensor [m], and its pose (4, 4).

    `instances` (N,) is the number of the structure on which each point lies;
    None if the recording does not contain it.
    """

    X_WS: np.ndarray
    points: np.ndarray
    instances: np.ndarray | None

    @classmethod
    def of(
        cls, drive: Drive | KeptScans, frame: int, max_range: float
    ) -> _ComparedScan:
        scan = drive.scan(frame)
        points = xyz(scan)
        kept = within_range(points, max_range)
        has_instances = "instance" in (scan.dtype.names or ())
        return cls(
            drive.X_WS[frame],
            points[kept],
            scan["instance"][kept] if has_instances else None,
        )

    @cached_property
    def seen(self) -> SeenSurfaces:
        return SeenSurfaces.of(self.points)

    @cached_property
    def described(self) -> LayeredScan:
        return LayeredOverlap().describe_place(self.points)

    @cached_property
    def non_ground(self) -> np.ndarray:
        """(M, 3) centroids of the non-ground points, per voxel [m]."""
        return downsample(
            self.points[self.points[:, 2] > _non_ground_height()], _CELL
        )

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree of the non-ground points."""
        return cKDTree(
            self.non_ground, balanced_tree=False, compact_nodes=False
        )

    def coinciding(self, points: np.ndarray) -> float:
        """Returns the share of given points that coincide with this scan.

        A point coincides if it is at most 1 m from a non-ground point of the
        scan. The points (N, 3), N > 0, are in the frame of this scan's sensor
        [m].
        """
        found, _ = self.tree.query(points, distance_upper_bound=_COINCIDENT)
        return float(np.isfinite(found).mean())

    @cached_property
    def sample(self) -> np.ndarray:
        """(M, 3) a random sample of the scan's points."""
        return sample_points(self.points)

    @cached_property
    def sample_instances(self) -> np.ndarray | None:
        """(M,) number of the structure on which each point of `sample` lies."""
        return None if self.instances is None else sample_points(self.instances)

    def seen_from(self, other: _ComparedScan) -> np.ndarray:
        """Returns `sample` in the frame of another scan's sensor."""
        X_OS = inverse(other.X_WS) @ self.X_WS
        return transform(X_OS, self.sample)


def _changed_share(
    place: _ComparedScan, query: _ComparedScan, classes: Mapping[int, str]
) -> tuple[float, str]:
    """Returns the share of two scans that is new or gone, and a class.

    The class is the class of structures with most of the new or gone points.

    A point is new or gone if it lies on a structure that has no point in the
    other scan, although nothing occludes the point from the other sensor.
    """
    changed: Counter[str] = Counter()
    total = 0
    for one, other in ((place, query), (query, place)):
        points, instances = one.sample, one.sample_instances
        if instances is None or other.instances is None:
            return math.nan, ""
        is_non_ground = points[:, 2] > _non_ground_height()
        total += int(is_non_ground.sum())
        is_gone = is_non_ground & ~np.isin(instances, other.instances)
        X_OS = inverse(other.X_WS) @ one.X_WS
        is_open = ~other.seen.hides(transform(X_OS, points[is_gone]))
        changed.update(
            classes.get(number, "unknown")
            for number in instances[is_gone][is_open].tolist()
        )
    if not changed:
        return (0.0 if total else math.nan), ""
    # If numbers are equal, the first name is returned.
    name = min(changed, key=lambda one: (-changed[one], one))
    return changed.total() / total, name


def _coinciding_shares(
    query: _ComparedScan, places: Sequence[_ComparedScan]
) -> list[float]:
    """Returns, for each place, the share of non-ground points that coincide.

    Query and place are aligned at the pose that the method layered overlap
    finds, not at their ground-truth poses. The result is the lesser of two
    shares: of the query's points and of the place's points.
    """
    shared = [0.0] * len(places)
    with_points = [k for k, one in enumerate(places) if len(one.non_ground)]
    if not (len(query.non_ground) and with_points):
        return shared
    method = LayeredOverlap()
    poses = method.relative_poses(
        method.describe(query.points),
        method.build_database([places[k].described for k in with_points]),
        range(len(with_points)),
    )
    for k, X_PQ in zip(with_points, poses, strict=True):
        if X_PQ is not None:
            place = places[k]
            shared[k] = min(
                place.coinciding(transform(X_PQ, query.non_ground)),
                query.coinciding(transform(inverse(X_PQ), place.non_ground)),
            )
    return shared


def _non_ground_height() -> float:
    """Returns the least height of non-ground points above the sensor [m]."""
    return _LEAST_HEIGHT - MethodConfig().sensor_height
