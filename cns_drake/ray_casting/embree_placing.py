"""Places many of Embree's instances by compiled code.

One foreign call from Python per instance would take longer than the placing.
"""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import TYPE_CHECKING, Any, NamedTuple

from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting import embree
from cns_drake.ray_casting.embree import FLOAT3X4_ROW_MAJOR
from cns_drake.ray_casting.foreign_calls import NUMBER, POINTER, void_call

if TYPE_CHECKING:
    from cns_drake.ray_casting.moving_groups import Placed


class Setters(NamedTuple):
    """Addresses of the C functions that change an RTCGeometry.

    Attributes:
        transform, steps: set its place, and the number of its places in a turn.
        enable, disable: include it in its scene, or not.
        commit: ends its changes.
    """

    transform: int
    steps: int
    enable: int
    disable: int
    commit: int

    @classmethod
    def of(cls, library: ctypes.CDLL) -> Setters:
        """Returns those of a loaded Embree."""
        functions = (
            library.rtcSetGeometryTransform,
            library.rtcSetGeometryTimeStepCount,
            library.rtcEnableGeometry,
            library.rtcDisableGeometry,
            library.rtcCommitGeometry,
        )
        return cls(*map(embree.address_of, functions))


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_transform(
    typing_context: Any,
    function: types.Type,
    handle: types.Type,
    time_step: types.Type,
    form: types.Type,
    matrix: types.Type,
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcSetGeometryTransform."""
    signature = types.void(function, handle, time_step, form, matrix)
    return signature, void_call(POINTER, NUMBER, NUMBER, POINTER)


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_steps(
    typing_context: Any,
    function: types.Type,
    handle: types.Type,
    count: types.Type,
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcSetGeometryTimeStepCount."""
    return types.void(function, handle, count), void_call(POINTER, NUMBER)


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_plain(
    typing_context: Any, function: types.Type, handle: types.Type
) -> tuple[Any, Callable[..., Any]]:
    """Calls a function of nothing but the geometry."""
    return types.void(function, handle), void_call(POINTER)


@compiled
def place_instances(
    setters: Setters,
    placed: Placed,
    handles: np.ndarray,
    is_disabled: np.ndarray,
    in_motion: np.ndarray,
) -> bool:
    """Gives instances in sight their places, and disables the others.

    Fewer instances are faster to build and to cast on. Those in motion have
    their places already.

    Args:
        setters: of Embree.
        placed: the groups.
        handles: (G,) addresses of the instances of all groups, 0 if a group has
            none.
        is_disabled, in_motion: (G,) states of the instances, to update.

    Returns:
        Whether any group has an instance.
    """
    once, first, form = np.int64(1), np.int64(0), np.int64(FLOAT3X4_ROW_MAJOR)
    matrix = np.empty((3, 4), np.float32)
    has_changed = False
    for k in range(len(placed.rows)):
        row, sees = placed.rows[k], placed.in_sight[k]
        handle = handles[row]
        if handle == 0:
            continue
        has_changed = True
        if sees and is_disabled[row]:
            _call_plain(setters.enable, handle)
        elif not (sees or is_disabled[row]):
            _call_plain(setters.disable, handle)
        is_disabled[row] = not sees
        if not sees:
            continue
        was_in_motion = in_motion[row]
        in_motion[row] = placed.moves[k]
        if in_motion[row]:
            continue
        if was_in_motion:
            _call_steps(setters.steps, handle, once)
        for i in range(3):
            for j in range(4):
                matrix[i, j] = placed.X_OLs[k, i, j]
        _call_transform(
            setters.transform, handle, first, form, matrix.ctypes.data
        )
        _call_plain(setters.commit, handle)
    return has_changed
