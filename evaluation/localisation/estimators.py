"""Estimators: functions that register a scan to a map from an initial pose.

The shipped estimators are the algorithms of small_gicp (K. Koide, "small_gicp:
Efficient and parallel algorithms for point cloud registration", JOSS 2024), two
estimators with a robust kernel, and KISS-Matcher (H. Lim et al., ICRA 2025),
which is an optional extra. An estimator of your own is a Python function.

In small_gicp, the point-to-plane error of two corresponding points is the
elementwise product of their offset and the normal, instead of the dot product.
Both errors are equal on surfaces that are parallel to two axes of the world. On
other surfaces, the elementwise error also penalises a motion along the surface.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import inspect
import math
from pathlib import Path
from types import ModuleType

import numpy as np
from scipy.spatial.transform import Rotation
import small_gicp

from evaluation.alignment import Surface, covariances
from evaluation.base import InputError, did_you_mean, poses
from evaluation.localisation.localisation_map import (
    FEWEST_POINTS,
    LocalisationMap,
    voxel_shift,
)
from evaluation.localisation.settings import (
    HALF_EXTENT,
    KISS_MATCHER,
    METHODS,
    ROBUST_KINDS,
    SMALL_GICP_KINDS,
    Settings,
)
from evaluation.methods import as_users_code, run_module

# An alignment ends when a step is below both of these [m, rad].
_LEAST_MOVE = 1e-4
_LEAST_TURN = 1e-5


@dataclass(frozen=True)
class Estimate:
    """The result of one alignment.

    Attributes:
        X_WS: (4, 4) pose; None if the estimator found none.
        score: the estimator's own score; a higher score means a better result.
            If the score is None, the share of the scan's points that lie on the
            map is used instead.
        iterations: number of steps; 0 if unknown.
    """

    X_WS: np.ndarray | None
    score: float | None = None
    iterations: int = 0


# A function that takes a map, a downsampled scan (N, 3) in S, the scan as
# measured, and the start X_WS.
Estimator = Callable[
    [LocalisationMap, np.ndarray, np.ndarray, np.ndarray], Estimate
]


def _by_small_gicp(
    kind: str,
    settings: Settings,
    surroundings: LocalisationMap,
    scan: np.ndarray,
    measured: np.ndarray,
    start: np.ndarray,
) -> Estimate:
    """Aligns a scan by small_gicp, once or twice; see `Estimator`."""
    source = small_gicp.PointCloud(scan)
    surface = surroundings.surface
    X_VW = np.eye(4)
    target: tuple = (surface.cloud, source, surface.tree)
    if kind in ("GICP", "VGICP"):
        small_gicp.estimate_covariances(
            source, num_neighbors=settings.neighbours
        )
    if kind == "VGICP":
        target = (surroundings.voxels(settings.resolution), source)
        X_VW = voxel_shift(settings.resolution)
    X = X_VW @ start
    iterations = 0
    options: dict = {} if kind == "VGICP" else {"registration_type": kind}
    for width in filter(None, (settings.width, settings.last_width)):
        found = small_gicp.align(
            *target,
            init_T_target_source=X,
            max_correspondence_distance=width,
            max_iterations=settings.iterations,
            translation_epsilon=_LEAST_MOVE,
            rotation_epsilon=_LEAST_TURN,
            **options,
        )
        iterations += found.iterations + 1
        if found.num_inliers and np.isfinite(found.T_target_source).all():
            X = found.T_target_source
    return Estimate(poses.inverse(X_VW) @ X, None, iterations)


def _by_robust(
    kind: str,
    settings: Settings,
    surroundings: LocalisationMap,
    scan: np.ndarray,
    measured: np.ndarray,
    start: np.ndarray,
) -> Estimate:
    """Aligns a scan by an estimator with a robust kernel; see `Estimator`."""
    spread = None
    if kind == "GICP":
        source = small_gicp.PointCloud(scan)
        small_gicp.estimate_covariances(
            source, num_neighbors=settings.neighbours
        )
        spread = covariances(source)
    X, iterations = _align_robustly(
        surroundings.surface, scan, start, settings, spread
    )
    return Estimate(X, None, iterations)


def _by_kiss_matcher(
    package: ModuleType,
    settings: Settings,
    surroundings: LocalisationMap,
    scan: np.ndarray,
    measured: np.ndarray,
    start: np.ndarray,
) -> Estimate:
    """Registers a scan by KISS-Matcher; see `Estimator`."""
    # Its numbers are float32: far coordinates would lose decimals.
    p_WS = start[:3, 3]
    target = surroundings.around(p_WS, HALF_EXTENT) - p_WS
    if len(target) < FEWEST_POINTS:
        return Estimate(None, -math.inf)
    matcher = package.KISSMatcher(
        package.KISSMatcherConfig(voxel_size=settings.resolution)
    )
    found = matcher.estimate(
        list(measured.astype(np.float32)), list(target.astype(np.float32))
    )
    if not found.valid:
        return Estimate(None, -math.inf)
    X = poses.make_pose(
        np.asarray(found.rotation, np.float64),
        np.asarray(found.translation, np.float64).ravel() + p_WS,
    )
    return Estimate(X, float(matcher.get_num_final_inliers()))


def _by_own(
    function: Callable,
    path: Path,
    surroundings: LocalisationMap,
    scan: np.ndarray,
    measured: np.ndarray,
    start: np.ndarray,
) -> Estimate:
    """Registers a scan by a function of the user; see `Estimator`."""
    nearby = surroundings.around(start[:3, 3], HALF_EXTENT)
    answer = function(nearby, measured.copy(), start.copy())
    try:
        X, score = answer
        score = float(score)
        X = None if X is None else np.array(X, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path}: returned {type(answer).__name__} instead of a pose"
            " (4, 4) and a score"
        ) from error
    if X is not None and not poses.is_pose(X):
        raise InputError(
            f"{path}: returned no pose: (4, 4) with a rotation and a last row"
            " 0 0 0 1"
        )
    # NaN is the lowest score.
    return Estimate(X, -math.inf if math.isnan(score) else score)


def make_estimator(method: str, settings: Settings) -> Estimator:
    """Returns the function that registers a scan by a given method.

    Args:
        method: a shipped method, one of `METHODS`, or the path of a Python
            file.
        settings: settings of a shipped method. A file with a method of your own
            contains its settings.

    Raises:
        InputError: if there is no such method, its package is not installed,
            or its file cannot be used.
    """
    if method in SMALL_GICP_KINDS:
        return partial(_by_small_gicp, SMALL_GICP_KINDS[method], settings)
    if method in ROBUST_KINDS:
        return partial(_by_robust, ROBUST_KINDS[method], settings)
    if method == KISS_MATCHER:
        try:
            import kiss_matcher
        except ImportError as error:
            raise InputError(
                "--method kiss-matcher: the package is not installed"
                " (pip install 'cns-eval[kiss-matcher]')"
            ) from error
        return partial(_by_kiss_matcher, kiss_matcher, settings)
    if not method.endswith(".py"):
        raise InputError(
            f"--method: no method {method!r} (known: {', '.join(METHODS)}, or"
            f" FILE.py){did_you_mean(method, METHODS)}"
        )
    path = Path(method)
    function = as_users_code(_function_of_file(path), path)
    return partial(_by_own, function, path)


def _function_of_file(path: Path) -> Callable:
    """Returns the estimator that a user's Python file defines.

    It is the function `localise`, or the only public function of the file.
    """
    module = run_module(path)
    own = {
        name: value
        for name, value in vars(module).items()
        if inspect.isfunction(value)
        and value.__module__ == module.__name__
        and not name.startswith("_")
    }
    function = own.get("localise")
    if function is None and len(own) == 1:
        (function,) = own.values()
    if function is None:
        raise InputError(
            f"{path}: has {len(own)} functions, none of which is `localise`"
        )
    return function


# Sum of two points' variances across the plane in small_gicp's covariances;
# along the plane the variance is a thousand times as large.
_ACROSS = 2e-3
# The search width is this many times s, see above.
_WIDTH_PER_MOTION = 3.0
# The search width is this many times the kernel's k, because k is s / 3.
_WIDTH_PER_KERNEL = 9.0
# An alignment has at most this share of the previous alignment's width.
_SHRINKING = 0.5
# Added to the diagonal of the Hessian, so that it can be inverted where pairs
# do not determine a motion.
_DAMPING = 1e-6
# An alignment ends if there are fewer pairs, which do not determine a pose.
_FEWEST_PAIRS = 6


def _align_robustly(
    surface: Surface,
    scan: np.ndarray,
    start: np.ndarray,
    settings: Settings,
    covariances: np.ndarray | None,
) -> tuple[np.ndarray, int]:
    """Registers a scan to a map by ICP or GICP with a Geman-McClure kernel.

    Several alignments follow one another. Each alignment begins at the result
    of the previous alignment, and pairs points over shorter distances than the
    previous alignment.

    Args:
        scan: (N, 3) in S [m].
        start: initial pose X_WS (4, 4).
        settings: the widths of the first and of the last alignment, and the
            greatest number of steps of each.
        covariances: (N, 3, 3) covariances of the scan's points in S, for GICP;
            None for point-to-plane ICP.

    Returns:
        The estimated X_WS, and the number of steps.
    """
    X = start
    width = settings.width
    last_width = settings.last_width or width
    total = 0
    while True:
        begin = X
        X, number = _align(
            surface, scan, begin, width, settings.iterations, covariances
        )
        total += number
        if width <= last_width:
            return X, total
        wanted = _WIDTH_PER_MOTION * _greatest_motion(begin, X)
        width = max(last_width, min(wanted, _SHRINKING * width))


def _align(
    surface: Surface,
    scan: np.ndarray,
    start: np.ndarray,
    width: float,
    iterations: int,
    covariances: np.ndarray | None,
) -> tuple[np.ndarray, int]:
    """Registers a scan with one search width.

    Args:
        width: greatest distance between paired points [m].
        iterations: greatest number of steps.
        surface, scan, start, covariances: see `_align_robustly`.

    Returns:
        The estimated X_WS, and the number of steps.
    """
    X = start
    for number in range(1, iterations + 1):
        step = _gauss_newton_step(surface, scan, X, width, covariances)
        R = Rotation.from_rotvec(step[:3]).as_matrix() @ X[:3, :3]
        X = poses.make_pose(R, X[:3, 3] + step[3:])
        move, turn = np.linalg.norm(step[3:]), np.linalg.norm(step[:3])
        if move < _LEAST_MOVE and turn < _LEAST_TURN:
            return X, number
    return X, iterations


def _greatest_motion(X_WA: np.ndarray, X_WB: np.ndarray) -> float:
    """Returns how far a point of a scan moves at most from pose A to B [m].

    A rotation counts by how far it moves a point at the greatest range.
    """
    X_AB = poses.inverse(X_WA) @ X_WB
    turn = Rotation.from_matrix(X_AB[:3, :3]).magnitude()
    by_turn = 2.0 * HALF_EXTENT * math.sin(turn / 2.0)
    return by_turn + float(np.linalg.norm(X_AB[:3, 3]))


def _gauss_newton_step(
    surface: Surface,
    scan: np.ndarray,
    X_WS: np.ndarray,
    width: float,
    covariances: np.ndarray | None,
) -> np.ndarray:
    """Returns a Gauss-Newton step (6,) in W.

    The step is a rotation vector about the LiDAR [rad], then a translation [m].
    It is 0 with too few pairs.

    Args:
        scan, covariances: see `_align_robustly`.
        X_WS: (4, 4) pose before the step.
        width: greatest distance between paired points [m].
    """
    arms = scan @ X_WS[:3, :3].T
    found, squares = surface.tree.batch_nearest_neighbor_search(
        arms + X_WS[:3, 3]
    )
    near = np.asarray(squares) < width**2
    nearest = np.asarray(found, dtype=np.int64)[near]
    if len(nearest) < _FEWEST_PAIRS:
        return np.zeros(6)
    arms = arms[near]
    off = arms + X_WS[:3, 3] - surface.points[nearest]
    if covariances is None:
        n = surface.normals[nearest]
        omega = n[:, :, None] * n[:, None]
    else:
        R = X_WS[:3, :3]
        spread = surface.covariances[nearest] + R @ covariances[near] @ R.T
        omega = _ACROSS * np.linalg.inv(spread)
    pull = np.einsum("nij,nj->ni", omega, off)
    kernel = width / _WIDTH_PER_KERNEL
    squares = np.einsum("ni,ni->n", off, pull)
    weights = (kernel / (kernel + squares)) ** 2
    # A small turn w moves a point by w x arm.
    J = np.zeros((len(arms), 3, 6))
    J[:, :, :3] = np.cross(np.eye(3), arms[:, None]).transpose(0, 2, 1)
    J[:, :, 3:] = np.eye(3)
    weighted = (J.transpose(0, 2, 1) @ omega) * weights[:, None, None]
    H = np.einsum("nij,njk->ik", weighted, J) + _DAMPING * np.eye(6)
    g = np.einsum("nij,nj->i", weighted, off)
    return np.linalg.solve(H, -g)
