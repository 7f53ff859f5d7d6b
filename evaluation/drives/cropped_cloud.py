"""Clouds of the points of several scans that are within a range."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.compiled import compiled
from cns_drake.base.errors import InputError


class CroppedCloud:
    """A cloud that scans are added to, each in its own frame.

    Points are transformed with fused multiply-adds, which have the same bits on
    every processor.
    """

    def __init__(
        self, max_range: float, fields: tuple[str, ...] = (), source: str = ""
    ):
        """Starts an empty cloud.

        Args:
            max_range: greatest absolute value of each coordinate [m].
            fields: of the points, beside their coordinates.
            source: of the scans, for messages.
        """
        self._max_range = max_range
        self._fields = fields
        self._source = source
        self._p_F = np.empty((0, 3))
        self._number = 0
        self._kept = np.empty(0, dtype=bool)
        self._values: dict[str, list[np.ndarray]] = {f: [] for f in fields}

    def add(
        self,
        scan: np.ndarray,
        X_FS: np.ndarray | None = None,
        *,
        num_more: int = 0,
    ) -> None:
        """Adds the points of a scan that are finite and within range.

        Args:
            scan: structured array (N,).
            X_FS: (4, 4) pose of its frame in that of the cloud; identity if
                left out.
            num_more: how many scans like this one follow; a hint for speed.

        Raises:
            InputError: if the scan lacks a field.
        """
        known = scan.dtype.names or ()
        for name in self._fields:
            if name not in known:
                raise InputError(
                    f"{self._source}: its points have no field {name!r} (they"
                    f" have {', '.join(known)})"
                )
        if self._fields and len(self._kept) < len(scan):
            self._kept = np.empty(len(scan), dtype=bool)
        needed = self._number + len(scan)
        if needed > len(self._p_F):
            # Scans that follow may be a little longer.
            more = num_more * len(scan)
            self._reserve(needed + more + more // 8)
        numbers, layout = _flat(scan)
        self._number = _keep(
            numbers,
            layout,
            X_FS is not None,
            np.eye(4) if X_FS is None else np.array(X_FS, dtype=np.float64),
            self._max_range,
            self._p_F,
            self._number,
            self._kept,
        )
        for name, values in self._values.items():
            kept = self._kept[: len(scan)]
            values.append(scan[name].compress(kept, axis=0))

    def finish(self) -> np.ndarray:
        """Returns the cloud, to which nothing is added any more.

        Returns:
            (N, 3) float64; with fields, a structured array (N,) of float64 x,
            y, z and the fields.
        """
        # No other array refers to the memory, whose rest is given back.
        self._p_F.resize((self._number, 3), refcheck=False)
        if not self._fields:
            return self._p_F
        values = {
            name: np.concatenate(parts) for name, parts in self._values.items()
        }
        cloud = np.empty(
            self._number,
            [(axis, np.float64) for axis in "xyz"]
            + [(f, one.dtype, one.shape[1:]) for f, one in values.items()],
        )
        for axis, coordinates in zip("xyz", self._p_F.T, strict=True):
            cloud[axis] = coordinates
        for name, one in values.items():
            cloud[name] = one
        return cloud

    def _reserve(self, number: int) -> None:
        p_F = np.empty((number, 3))
        p_F[: self._number] = self._p_F[: self._number]
        self._p_F = p_F


def _flat(scan: np.ndarray) -> tuple[np.ndarray, tuple[int, int, int, int]]:
    """Returns the coordinates of a scan among numbers of one type.

    Returns:
        (M,) float32 or float64; and how many there are from one point to the
        next, and the places of the first point's x, y and z.
    """
    fields: Mapping[str, Any] = scan.dtype.fields or {}
    size = np.dtype(np.float32).itemsize
    places = [fields[axis][1] for axis in "xyz"]
    if (
        all(fields[axis][0] == np.float32 for axis in "xyz")
        and not any(place % size for place in (*places, scan.itemsize))
        and scan.flags.c_contiguous
    ):
        numbers = scan.view(np.float32)
        if numbers.flags.aligned:
            x, y, z = (place // size for place in places)
            return numbers, (scan.itemsize // size, x, y, z)
    return point_arrays.xyz(scan).reshape(-1), (3, 0, 1, 2)


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _fma(
    typing_context: Any, a: types.Type, b: types.Type, c: types.Type
) -> tuple[Any, Callable[..., Any]]:
    """Returns a b + c, rounded once."""

    def generate(
        context: Any, builder: Any, signature: Any, arguments: Any
    ) -> Any:
        return builder.fma(*arguments)

    number = types.float64
    return number(number, number, number), generate


@compiled
def _keep(
    numbers: np.ndarray,
    layout: tuple[int, int, int, int],
    is_moved: bool,
    X: np.ndarray,
    max_range: float,
    cloud: np.ndarray,
    size: int,
    kept: np.ndarray,
) -> int:
    """Writes the points of a scan that are within a range.

    Args:
        numbers: of the scan, see `_flat`.
        layout: likewise.
        is_moved: whether to transform the points.
        X: (4, 4) float64, by which pose.
        max_range: see `CroppedCloud`.
        cloud: (K, 3) float64 to write, with room for all.
        size: number of its points up to now.
        kept: to fill with whether each point is kept, unless it is empty.

    Returns:
        The new size.
    """
    step, at_x, at_y, at_z = layout
    r_xx, r_xy, r_xz, p_x = X[0, 0], X[0, 1], X[0, 2], X[0, 3]
    r_yx, r_yy, r_yz, p_y = X[1, 0], X[1, 1], X[1, 2], X[1, 3]
    r_zx, r_zy, r_zz, p_z = X[2, 0], X[2, 1], X[2, 2], X[2, 3]
    is_marked = len(kept) > 0
    xs, ys, zs = numbers[at_x::step], numbers[at_y::step], numbers[at_z::step]
    for i in range(len(xs)):
        x, y, z = np.float64(xs[i]), np.float64(ys[i]), np.float64(zs[i])
        if is_moved:
            x, y, z = (
                _fma(z, r_xz, _fma(y, r_xy, x * r_xx)) + p_x,
                _fma(z, r_yz, _fma(y, r_yy, x * r_yx)) + p_y,
                _fma(z, r_zz, _fma(y, r_zy, x * r_zx)) + p_z,
            )
        # A comparison with NaN is false, so NaN is out of range.
        is_near = (
            (abs(x) <= max_range)
            & (abs(y) <= max_range)
            & (abs(z) <= max_range)
        )
        if is_near:
            cloud[size, 0] = x
            cloud[size, 1] = y
            cloud[size, 2] = z
            size += 1
        if is_marked:
            kept[i] = is_near
    return size
