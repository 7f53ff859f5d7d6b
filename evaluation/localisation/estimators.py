"""Estimators: functions that register a scan to a map from an initial pose.

The shipped estimators are those of small_gicp (K. Koide, "small_gicp: Efficient
and parallel algorithms for point cloud registration", JOSS 2024), two
estimators with a robust kernel, and, as an optional extra, KISS-Matcher (H. Lim
et al., ICRA 2025). An estimator of your own is a Python function.

In small_gicp, the point-to-plane error of two corresponding points is the
elementwise product of their offset and the normal, instead of the dot product.
Both errors are equal on surfaces that are parallel to two axes of the world. On
other surfaces, the elementwise error also penalises a motion along the surface.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
import inspect
import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import small_gicp

from cns_drake.base import points as clouds
from cns_drake.base import poses
from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError, did_you_mean
from cns_drake.base.progress import track
from evaluation.alignment.registration import Surface, covariances, make_surface
from evaluation.clouds.cloud_files import read_blocks
from evaluation.clouds.notes import OnNote, no_note
from evaluation.drives.joined_drive import JoinedDrive
from evaluation.drives.sampling import sample_frames, within_range
from evaluation.localisation.robust import MAX_RANGE, align_robustly
from evaluation.maps.voxel_maps import VoxelAccumulator
from evaluation.methods.own_files import run_module, with_named_faults
from evaluation.recognition.keeping import kept_places

# Distance between the scans of a drive that enter the map [m].
_MAP_SPACING = 1.0
# Least number of points of a map, and of a downsampled scan that is aligned.
FEWEST_POINTS = 10
# An alignment ends when a step is below these [m, rad].
_STILL = (1e-4, 1e-5)
# A point of a scan fits if a surface of the map is this near [m].
_FIT = 0.15
# Pairs farther apart say nothing about the fit [m].
_PAIR = 1.0
# Shift of the voxels of VGICP, as a fraction of their side.
_VOXEL_SHIFT = 0.37
# Least standard deviation from a plane [m], even where a scan fits exactly.
_ROUGHNESS = 0.01
# Normals are exact to 3 deg. This is the square of the component along the
# surface that such an error produces; uncorrected, it would seem to constrain a
# scan along the surface.
_NORMAL_NOISE = math.sin(math.radians(3.0)) ** 2


@dataclass(frozen=True)
class Settings:
    """Settings of the shipped estimators.

    Attributes:
        voxel: side of the voxels to which the map is downsampled [m].
        scan_voxel: side of the voxels to which a scan is downsampled [m].
        width: greatest distance between corresponding points [m]. With VGICP, a
            point corresponds to the Gaussian of its own voxel if the mean of
            this Gaussian lies within that distance.
        last_width: `width` of a second alignment, which starts from the result
            of the first [m]; 0 for no second alignment. The robust estimators
            shrink their width down to this value.
        resolution: side of the voxels of VGICP and of KISS-Matcher [m].
        neighbours: number of points that a normal or a covariance is fitted
            to.
        iterations: greatest number of steps of an alignment.
    """

    voxel: float = 0.5
    scan_voxel: float = 0.5
    width: float = 2.0
    last_width: float = 0.0
    resolution: float = 1.0
    neighbours: int = 10
    iterations: int = 50

    def with_values(
        self, values: Iterable[tuple[str, Any]], method: str
    ) -> "Settings":
        """Returns the settings with new values for some settings.

        Args:
            values: pairs of a name and its value, a number or text.
            method: name of the method, which must have these settings.

        Raises:
            InputError: if a setting is unknown, or a value does not fit.
        """
        unused = {
            *(() if method in _ALIGNING else _ALIGNMENT),
            *(() if method in _VOXELS else ("resolution",)),
        }
        known: dict[str, Callable] = {
            one.name: int if isinstance(one.default, int) else float
            for one in fields(self)
            if one.name not in unused
        }
        found = {}
        for name, text in values:
            if name not in known:
                raise InputError(
                    f"--set: {method} has no setting {name!r} (known:"
                    f" {', '.join(known)})"
                )
            try:
                value = known[name](text)
            except (TypeError, ValueError):
                value = math.nan
            least = 0.0 if name == "last_width" else 1e-3
            least = 4.0 if name == "neighbours" else least
            if not least <= value <= 1000.0:
                raise InputError(
                    f"--set: {name}: {text!r} is no number from {least:g} to"
                    " 1000"
                )
            found[name] = value
        return replace(self, **found)


@dataclass(frozen=True, eq=False)
class LocalisationMap:
    """A map in which scans are localised.

    Attributes:
        name: name of the drive or file from which the map was made.
        surface: the downsampled points in W, with normals and covariances.
    """

    name: str
    surface: Surface

    @cached_property
    def _voxels(self) -> dict[float, small_gicp.GaussianVoxelMap]:
        return {}

    def voxels(self, resolution: float) -> small_gicp.GaussianVoxelMap:
        """Returns the map with one Gaussian per voxel, for VGICP.

        The frame of this map is W, shifted by a fraction of a voxel, so that
        walls and ground at round coordinates do not lie on the border of
        voxels.

        Args:
            resolution: side of a voxel [m].
        """
        if resolution not in self._voxels:
            voxels = small_gicp.GaussianVoxelMap(resolution)
            voxels.insert(self.surface.cloud, _voxel_shift(resolution))
            self._voxels[resolution] = voxels
        return self._voxels[resolution]

    def around(self, p_W: np.ndarray, distance: float) -> np.ndarray:
        """Returns the map points (M, 3) in a box around a position.

        Args:
            p_W: (3,) the position [m].
            distance: half the side of the box [m].
        """
        offsets = self.surface.points - p_W
        return self.surface.points[within_range(offsets, distance)]

    def distances(self, points_W: np.ndarray) -> np.ndarray:
        """Returns the distances (N,) of points from the nearest map point [m].

        Args:
            points_W: (N, 3) the points [m].
        """
        _, squares = self.surface.tree.batch_nearest_neighbor_search(points_W)
        return np.sqrt(np.asarray(squares))


def _voxel_shift(resolution: float) -> np.ndarray:
    """Returns the pose of W in the frame of the voxels of VGICP.

    Without this shift, the ground at height 0 and walls at round coordinates
    would lie on the sides of voxels, where rounding chooses between two voxels.
    """
    return poses.make_pose(np.eye(3), np.full(3, _VOXEL_SHIFT * resolution))


def make_map(
    source: Drive | Path,
    settings: Settings,
    columns: int | None = None,
    on_note: OnNote = no_note,
) -> LocalisationMap:
    """Returns the localisation map of a drive or of a cloud in W.

    A drive's scans are placed at their ground-truth poses.

    Args:
        source: the drive, or the cloud's file.
        settings: settings for downsampling and for normals.
        columns: number of columns of a `.bin` file; by default guessed from the
            values.
        on_note: is called with notes on how a cloud's file was read.

    Raises:
        InputError: the source cannot be read, or has too few points.
    """
    if isinstance(source, Drive):
        blocks = _scans(source)
    else:
        parts = read_blocks(source, columns, on_note)
        blocks = ((part, None) for part in parts)
    accumulator = VoxelAccumulator(settings.voxel)
    for block, X_WS in blocks:
        accumulator.add(block, X_WS)
    points = accumulator.to_map().centroids_W
    if len(points) < FEWEST_POINTS:
        raise InputError(
            f"{source.name}: a map of {len(points)} points, fewer than"
            f" {FEWEST_POINTS}"
        )
    return map_of(points, source.name, settings)


def _scans(drive: Drive) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """Yields the cropped scans of which a map is made, each with its X_WS."""
    frames = map_frames(drive).tolist()
    for frame in track(frames, f"mapping {drive.name}", len(frames), "scans"):
        scan = drive.scan(frame)
        near = within_range(clouds.xyz(scan), MAX_RANGE)
        yield scan[near], drive.X_WS[frame]


def map_frames(drive: Drive) -> np.ndarray:
    """Returns the frames (K,) of a drive that are used for its map.

    If the drive consists of several drives, frames that these drives do not
    keep in the map are left out.
    """
    if not isinstance(drive, JoinedDrive):
        return sample_frames(drive.X_WS[:, :3, 3], _MAP_SPACING)
    frames = drive.sampled(_MAP_SPACING)
    p_WSs = drive.X_WS[frames, :3, 3]
    kept = kept_places(p_WSs, drive.drive_of(frames), drive.keep, _MAP_SPACING)
    return frames[kept]


def map_of(
    points: np.ndarray, name: str, settings: Settings
) -> LocalisationMap:
    """Returns a localisation map made of points.

    Args:
        points: (M, 3) points in W [m], at least `FEWEST_POINTS`.
        name: name of the map.
        settings: settings for downsampling and for normals.
    """
    surface = make_surface(points, settings.neighbours)
    return LocalisationMap(name, surface)


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


@dataclass(frozen=True)
class Fit:
    """The fit of a scan at a pose.

    Attributes:
        share: share of the scan's points that lie on a surface of the map.
        residual: root mean square distance of the scan's points from the planes
            at the nearest points of the map, without points more than 1 m from
            the map [m]; NaN if no point is left.
        covariance: (6, 6) covariance of a small motion about the LiDAR, in axes
            of W: rotation [rad], translation [m]. The covariance is the inverse
            Hessian of the point-to-plane error, corrected for the noise of the
            normals, times the square of the residual (at least 0.01 m).
    """

    share: float
    residual: float
    covariance: np.ndarray


def fit_at(surface: Surface, scan: np.ndarray, X_WS: np.ndarray) -> Fit:
    """Returns how well a scan fits a map at a given pose, see `Fit`.

    Args:
        surface: surface of the map.
        scan: (N, 3) points in the LiDAR's frame S [m].
        X_WS: (4, 4) the pose.
    """
    p_W = poses.transform(X_WS, scan)
    found, squares = surface.tree.batch_nearest_neighbor_search(p_W)
    is_pair = np.asarray(squares) < _PAIR**2
    nearest = np.asarray(found, dtype=np.int64)[is_pair]
    n_W = surface.normals[nearest]
    off = np.einsum("ni,ni->n", n_W, p_W[is_pair] - surface.points[nearest])
    arms = p_W[is_pair] - X_WS[:3, 3]
    H = _hessian(arms, n_W)
    for axis in np.eye(3):
        H -= _NORMAL_NOISE * _hessian(arms, np.broadcast_to(axis, arms.shape))
    residual = math.sqrt(np.mean(off**2)) if len(off) else math.nan
    sigma = max(residual, _ROUGHNESS) if len(off) else 1.0
    return Fit(
        float(np.count_nonzero(np.abs(off) < _FIT) / len(scan)),
        residual,
        _inverse(H / sigma**2),
    )


def _hessian(arms: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Returns the point-to-plane Hessian (6, 6) over turn, then move."""
    J = np.concatenate([np.cross(arms, normals), normals], axis=1)
    return J.T @ J


def _inverse(H: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(H)
    # Directions without constraints get a standard deviation of 100 m or rad.
    return vectors / np.maximum(values, 1e-4) @ vectors.T


def _by_small_gicp(
    kind: str,
    settings: Settings,
    surroundings: LocalisationMap,
    scan: np.ndarray,
    measured: np.ndarray,
    start: np.ndarray,
) -> Estimate:
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
        X_VW = _voxel_shift(settings.resolution)
    X = X_VW @ start
    iterations = 0
    options: dict = {} if kind == "VGICP" else {"registration_type": kind}
    for width in filter(None, (settings.width, settings.last_width)):
        found = small_gicp.align(
            *target,
            init_T_target_source=X,
            max_correspondence_distance=width,
            max_iterations=settings.iterations,
            translation_epsilon=_STILL[0],
            rotation_epsilon=_STILL[1],
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
    spread = None
    if kind == "GICP":
        source = small_gicp.PointCloud(scan)
        small_gicp.estimate_covariances(
            source, num_neighbors=settings.neighbours
        )
        spread = covariances(source)
    X, iterations = align_robustly(
        surroundings.surface,
        scan,
        start,
        (settings.width, settings.last_width or settings.width),
        settings.iterations,
        _STILL,
        spread,
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
    # Its numbers are float32: far coordinates would lose decimals.
    p_WS = start[:3, 3]
    target = surroundings.around(p_WS, MAX_RANGE) - p_WS
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
    nearby = surroundings.around(start[:3, 3], MAX_RANGE)
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
    return Estimate(X, score if score == score else -math.inf)


_KINDS = {
    "icp": "ICP",
    "plane-icp": "PLANE_ICP",
    "gicp": "GICP",
    "vgicp": "VGICP",
}
_ROBUST = {"robust-plane-icp": "PLANE_ICP", "robust-gicp": "GICP"}
KISS_MATCHER = "kiss-matcher"
METHODS = (*_KINDS, *_ROBUST, KISS_MATCHER)
# Settings that only the methods with an iterative alignment use, and methods
# with the setting `resolution`. All methods use the others: they thin map and
# scan, and measure the fit.
_ALIGNING = (*_KINDS, *_ROBUST)
_ALIGNMENT = ("width", "last_width", "iterations")
_VOXELS = ("vgicp", KISS_MATCHER)
# The best on unchanged cities; see docs/localisation.md.
_DEFAULTS = {
    "gicp": Settings(width=8.0),
    "plane-icp": Settings(width=4.0),
    "vgicp": Settings(resolution=1.0),
    **dict.fromkeys(_ROBUST, Settings(width=6.0, last_width=0.5)),
}


def default_settings(method: str) -> Settings:
    """Returns the default settings of a shipped method."""
    return _DEFAULTS.get(method, Settings())


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
    if method in _KINDS:
        return partial(_by_small_gicp, _KINDS[method], settings)
    if method in _ROBUST:
        return partial(_by_robust, _ROBUST[method], settings)
    if method == KISS_MATCHER:
        try:
            import kiss_matcher
        except ImportError as error:
            raise InputError(
                "--method kiss-matcher: the package is not installed"
                " (pip install 'cns-drake[kiss-matcher]')"
            ) from error
        return partial(_by_kiss_matcher, kiss_matcher, settings)
    if not method.endswith(".py"):
        raise InputError(
            f"--method: no method {method!r} (known: {', '.join(METHODS)}, or"
            f" FILE.py){did_you_mean(method, METHODS)}"
        )
    path = Path(method)
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
    return partial(_by_own, with_named_faults(function, path), path)
