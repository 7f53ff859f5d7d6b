"""The shipped estimators by name, and their settings."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
import math
from typing import Any

from evaluation.base import InputError

# Greatest coordinate of a point that is used, along each axis of the LiDAR [m].
HALF_EXTENT = 100.0


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
            field.name: int if isinstance(field.default, int) else float
            for field in fields(self)
            if field.name not in unused
        }
        found = {}
        for name, text in values:
            if name not in known:
                raise InputError(
                    f"--set: {method} has no setting {name!r} (known:"
                    f" {', '.join(known)})"
                )
            found[name] = _parse(name, known[name], text)
        return replace(self, **found)


def _parse(name: str, kind: Callable, text: Any) -> Any:
    """Returns the value of a setting."""
    try:
        value = kind(text)
    except (TypeError, ValueError):
        value = math.nan
    least = _LEAST.get(name, _LEAST_LENGTH)
    if not least <= value <= _GREATEST:
        raise InputError(
            f"--set: {name}: {text!r} is no number from {least:g} to"
            f" {_GREATEST:g}"
        )
    return value


# Least values of settings that are not lengths above 0, or may be 0.
_LEAST = {"last_width": 0.0, "neighbours": 4.0}
# Least value of all other settings.
_LEAST_LENGTH = 1e-3
# Greatest value of all settings.
_GREATEST = 1000.0
# Name of a method -> small_gicp's name of its algorithm.
SMALL_GICP_KINDS = {
    "icp": "ICP",
    "plane-icp": "PLANE_ICP",
    "gicp": "GICP",
    "vgicp": "VGICP",
}
# Name of a robust estimator -> name of the algorithm with the same errors.
ROBUST_KINDS = {"robust-plane-icp": "PLANE_ICP", "robust-gicp": "GICP"}
KISS_MATCHER = "kiss-matcher"
METHODS = (*SMALL_GICP_KINDS, *ROBUST_KINDS, KISS_MATCHER)
# Settings that only the methods with an iterative alignment use, and methods
# with the setting `resolution`. All methods use the other settings, because all
# downsample map and scan, and measure the fit.
_ALIGNING = (*SMALL_GICP_KINDS, *ROBUST_KINDS)
_ALIGNMENT = ("width", "last_width", "iterations")
_VOXELS = ("vgicp", KISS_MATCHER)
# The best on unchanged cities; see docs/localisation.md.
_DEFAULTS = {
    "gicp": Settings(width=8.0),
    "plane-icp": Settings(width=4.0),
    "vgicp": Settings(resolution=1.0),
    **dict.fromkeys(ROBUST_KINDS, Settings(width=6.0, last_width=0.5)),
}


def default_settings(method: str) -> Settings:
    """Returns the default settings of a shipped method."""
    return _DEFAULTS.get(method, Settings())
