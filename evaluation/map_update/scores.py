"""Scores of labels of two maps against the ground truth.

All scores count points, not voxels. The IoU of a class compares the points of
this class in the ground truth with the points of this class in the prediction,
over both maps together. The class `unobserved` includes points that B is the
first to see. A class that does not occur in the ground truth is left out of the
mean, `miou`.

Precision and recall of gone (in A) and new (in B) exist in three forms. By
points, a predicted point is right if this point has changed in the ground
truth. Within 0.2 m and 0.5 m, a predicted point is right if a point that has
changed in the ground truth lies within this distance; for recall, prediction
and ground truth are exchanged. By structure, verdicts on whole structures are
compared, see `evaluation.map_update.structures.verdicts`.

The predictions also give an updated map: A without the points that are
predicted gone, plus the points of B that are predicted new or newly seen. The
completeness of the updated map is the share of B's map within 0.2 m of the
updated map. The accuracy is the share of the updated map within 0.2 m of B's
map; only points count that B's drive observed according to the ground truth.
The Chamfer distance is the mean of two mean distances: from the updated map to
B's map, and from B's map to the updated map.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import itertools
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import InputError, Reporter, json_values
from evaluation.map_update.baselines import run_baseline
from evaluation.map_update.labels import SIDES, Label, PairLabels
from evaluation.map_update.nearest_points import nearest_distances
from evaluation.map_update.sessions import (
    SessionPair,
    read_labels,
    read_pair,
    read_truth,
)
from evaluation.map_update.structures import class_names, verdicts
from evaluation.map_update.upkeep import TRUTH

# Class of a point -> its labels in both maps.
_CLASSES = {
    "kept": (Label.KEPT,),
    "gone": (Label.GONE,),
    "new": (Label.NEW,),
    "unobserved": (Label.UNOBSERVED, Label.NEWLY_SEEN),
}
# Class of a changed point -> the side of its map, and its label there.
_CHANGES = {"gone": ("A", Label.GONE), "new": ("B", Label.NEW)}
# Key of scores -> distance within which changed points are compared [m].
_TOLERANCES = {"within_02m": 0.2, "within_05m": 0.5}
# A point of the updated map agrees with B's map within this distance [m].
_AGREES_WITHIN = 0.2
# Limits of the classes of distance from the other drive [m].
_DISTANCES = (0.0, 10.0, 20.0, 40.0, math.inf)
# Name of labels that the user gives.
GIVEN = "labels"


def score(
    pair: SessionPair,
    truth: PairLabels,
    predicted: PairLabels,
    names: Mapping[int, str],
) -> dict:
    """Returns all scores of predicted labels, ready for JSON.

    A score that is undefined is None.

    Args:
        pair: the two maps.
        truth: the ground-truth labels of these maps.
        predicted: the predicted labels of these maps.
        names: number of a class of points -> its name, for scores by class.

    Raises:
        InputError: the ground truth leaves out every point.
    """
    counted = [labels != Label.IGNORED for labels in truth]
    if not any(rows.any() for rows in counted):
        raise InputError(
            f"{pair.A.folder.parent}: no point has a label in the ground truth"
        )
    both = _Labelled(pair, truth, predicted, counted)
    still = both.only([~session.moves for session in pair])
    result: dict = _scores_by_points(both)
    result["points"] = int(sum(rows.sum() for rows in counted))
    result["without_vehicles_and_people"] = _scores_by_points(still)
    for name, distance in _TOLERANCES.items():
        result[name] = _scores_within(both, distance)
    result["by_structure"] = _scores_by_structure(both)
    result.update(_predicted_shares(still))
    result["updated_map"] = _scores_of_updated_map(both)
    classes = np.unique(np.concatenate([session.classes for session in pair]))
    result["by_class"] = {
        names.get(number, str(number)): _scores_by_points(
            both.only([session.classes == number for session in pair])
        )
        for number in classes.tolist()
    }
    result["by_distance"] = _scores_by_distance(both)
    return json_values(result)


class _Labelled(NamedTuple):
    """Both maps with their labels, and masks of the points that count.

    Attributes:
        pair: the older map of N points and the newer map of M points.
        truth: their ground-truth labels.
        predicted: their predicted labels.
        counted: (N,) and (M,) bool, which points are scored.
    """

    pair: SessionPair
    truth: PairLabels
    predicted: PairLabels
    counted: list[np.ndarray]

    def only(self, kept: list[np.ndarray]) -> _Labelled:
        """Returns the same maps with fewer points that are scored.

        Args:
            kept: (N,) and (M,) bool; only points of these masks still count.
        """
        rows = zip(self.counted, kept, strict=True)
        return self._replace(counted=[one & other for one, other in rows])


def _scores_by_points(both: _Labelled) -> dict[str, float]:
    """Returns IoUs, precisions and recalls by points.

    The IoU is NaN for a class that occurs neither in the ground truth nor by
    prediction.
    """
    table = _confusion(both)
    right = np.diag(table)
    true = table.sum(axis=1)
    found = table.sum(axis=0)
    known = true > 0
    result = {"miou": math.nan}
    for k, name in enumerate(_CLASSES):
        union = true[k] + found[k] - right[k]
        result[f"iou_{name}"] = _ratio(right[k], union)
    if known.any():
        iou = [result[f"iou_{name}"] for name in _CLASSES]
        result["miou"] = float(np.mean(np.array(iou)[known]))
    for name in _CHANGES:
        k = list(_CLASSES).index(name)
        result[f"precision_{name}"] = _ratio(right[k], found[k])
        result[f"recall_{name}"] = _ratio(right[k], true[k])
    return result


def _confusion(both: _Labelled) -> np.ndarray:
    """Returns how many points of each true class have each predicted class.

    Returns:
        (4, 4) counts; rows are true classes, columns are predicted classes,
        both in the order of `_CLASSES`.
    """
    # Label -> number of its class.
    class_of = np.zeros(256, np.int64)
    for k, labels in enumerate(_CLASSES.values()):
        class_of[list(labels)] = k
    size = len(_CLASSES)
    cells = np.zeros(size * size, np.int64)
    for true, found, rows in zip(*both[1:], strict=True):
        cells += np.bincount(
            size * class_of[true[rows]] + class_of[found[rows]],
            minlength=size * size,
        )
    return cells.reshape(size, size)


def _scores_within(both: _Labelled, distance: float) -> dict[str, float]:
    """Returns precision and recall of changed points within a distance [m]."""
    pair, truth, predicted, counted = both
    found = {}
    for k, (name, (_, label)) in enumerate(_CHANGES.items()):
        points = pair[k].points
        true = points[counted[k] & (truth[k] == label)]
        guessed = points[counted[k] & (predicted[k] == label)]
        found[f"precision_{name}"] = _share_near(guessed, true, distance)
        found[f"recall_{name}"] = _share_near(true, guessed, distance)
    return found


def _share_near(
    points: np.ndarray, others: np.ndarray, distance: float
) -> float:
    """Returns the share of points with one of `others` within a distance."""
    if len(points) == 0:
        return math.nan
    if len(others) == 0:
        return 0.0
    found = nearest_distances(points, others, distance)
    return float(np.mean(np.isfinite(found)))


def _scores_by_structure(both: _Labelled) -> dict[str, float]:
    """Returns precision and recall by structures, and numbers of structures.

    For each kind of change, such as `gone`, the keys are `precision_gone`,
    `recall_gone` and `gone`. The value of `gone` is the number of structures
    that changed in this way according to the ground truth. A rate without
    structures is NaN.
    """
    pair, truth, predicted, counted = both
    found = {}
    for k, (name, (side, label)) in enumerate(_CHANGES.items()):
        true, guessed = (
            verdicts(
                pair[k].instances[counted[k]], labels[k][counted[k]], side
            ).labels
            == label
            for labels in (truth, predicted)
        )
        right = (true & guessed).sum()
        found[f"precision_{name}"] = _ratio(right, guessed.sum())
        found[f"recall_{name}"] = _ratio(right, true.sum())
        found[name] = int(true.sum())
    return found


def _predicted_shares(both: _Labelled) -> dict[str, float]:
    """Returns the shares of points and of structures predicted gone or new.

    The function also returns the share of the observed structures whose verdict
    (kept, gone or new) is right.
    """
    points, structures, right = [], [], []
    for session, true, found, rows in zip(*both, strict=True):
        unobserved, _, changed = SIDES[session.side]
        points.append(found[rows] == changed)
        is_true, is_found = (
            verdicts(session.instances[rows], labels[rows], session.side).labels
            for labels in (true, found)
        )
        structures.append(is_found == changed)
        right.append((is_true == is_found)[is_true != unobserved])
    return {
        name: _ratio(
            sum(int(part.sum()) for part in parts), sum(map(len, parts))
        )
        for name, parts in (
            ("called_points", points),
            ("called_structures", structures),
            ("right_structures", right),
        )
    }


def _scores_of_updated_map(both: _Labelled) -> dict[str, float]:
    """Returns completeness, accuracy and Chamfer distance of an updated map.

    The updated map consists of the points of A that are not predicted gone, and
    the points of B that are not predicted kept. It is compared with B's map.
    Completeness is the share of B's points that are near the updated map;
    accuracy is the share of the updated map's points that are near B's map. All
    three scores are NaN if one of the two maps has no points to compare.
    """
    pair, truth, predicted, counted = both
    stays = predicted.A != Label.GONE
    comes = predicted.B != Label.KEPT
    observed = stays & counted[0] & (truth.A != Label.UNOBSERVED)
    updated = np.concatenate([pair.A.points[stays], pair.B.points[comes]])
    # Points that B adds lie on B's map: their distance is 0. Points without a
    # ground-truth label are not scored, but a scored point can lie near to
    # them.
    own = np.concatenate(
        [
            nearest_distances(pair.A.points[observed], pair.B.points),
            np.zeros((comes & counted[1]).sum()),
        ]
    )
    other = nearest_distances(pair.B.points[counted[1]], updated)
    if len(own) == 0 or len(other) == 0:
        return dict.fromkeys(("completeness", "accuracy", "chamfer"), math.nan)
    chamfer = 0.5 * (own.mean() + other.mean())
    return {
        "completeness": float(np.mean(other <= _AGREES_WITHIN)),
        "accuracy": float(np.mean(own <= _AGREES_WITHIN)),
        "chamfer": float(chamfer) if math.isfinite(chamfer) else math.nan,
    }


def _scores_by_distance(both: _Labelled) -> dict:
    """Returns scores by points, one set of scores for each range of distances.

    The distance of a point is measured from the path of the other drive.
    """
    pair = both.pair
    if not (len(pair.A.X_WS) and len(pair.B.X_WS)):
        return {}
    away = [
        nearest_distances(mine.points, theirs.X_WS[:, :3, 3])
        for mine, theirs in (pair, pair[::-1])
    ]
    found = {}
    for low, high in itertools.pairwise(_DISTANCES):
        ring = both.only([(far >= low) & (far < high) for far in away])
        if any(rows.any() for rows in ring.counted):
            end = "" if math.isinf(high) else f"{high:g}"
            found[f"{low:g}-{end}"] = _scores_by_points(ring)
    return found


def _ratio(numerator: float, denominator: float) -> float:
    return float(numerator / denominator) if denominator else math.nan


class MapScores(NamedTuple):
    """The scores of a change detector.

    Attributes:
        scores: name of a score -> its value, see `score`.
        gone, new: numbers of points with the exact labels gone and new.
        labels: the detector's labels of both maps.
    """

    scores: dict[str, Any]
    gone: int
    new: int
    labels: PairLabels

    def score(self, *keys: str) -> float:
        """Returns a score by its keys in `scores`; NaN if it is undefined."""
        value: Any = self.scores
        for key in keys:
            value = value[key]
        return math.nan if value is None else float(value)

    @property
    def num_changed(self) -> int:
        """Number of points with the exact label gone or new."""
        return self.gone + self.new


def score_methods(
    reporter: Reporter,
    maps: Path,
    methods: tuple[str, ...],
    given: tuple[Path, ...] = (),
    pair: SessionPair | None = None,
) -> dict[str, MapScores]:
    """Scores the labels of change detectors against exact labels.

    Args:
        reporter: unused.
        maps: folder with the maps of two drives and their exact labels.
        methods: names of change detectors. The name `TRUTH` scores the exact
            labels themselves.
        given: files with labels of the older and of the newer map. These labels
            are scored under the name `GIVEN`.
        pair: the maps, if they are not where the folder has them.

    Returns:
        Method -> its scores.

    Raises:
        InputError: the folder cannot be read, or a detector cannot run.
    """
    pair = pair or read_pair(maps)
    truth = read_truth(pair)
    number = {
        "gone": int((truth.A == Label.GONE).sum()),
        "new": int((truth.B == Label.NEW).sum()),
    }
    found = {}
    for method in (*methods, *((GIVEN,) if given else ())):
        labels = _choose_labels(method, pair, truth, given)
        scores = score(pair, truth, labels, class_names(maps))
        found[method] = MapScores(scores, **number, labels=labels)
    return found


def _choose_labels(
    method: str, pair: SessionPair, truth: PairLabels, given: Sequence[Path]
) -> PairLabels:
    """Returns the labels that are scored under the name of a method.

    Args:
        method: name of a change detector, `TRUTH` or `GIVEN`.
        truth: the exact labels of these maps.
        given: files with the labels for `GIVEN`, of the older and of the newer
            map.
    """
    if method == TRUTH:
        return truth
    if method == GIVEN:
        return PairLabels(
            *(
                read_labels(path, session, truth=False)
                for path, session in zip(given, pair, strict=True)
            )
        )
    return run_baseline(method, pair)
