"""Places many of Embree's instances by compiled code.

One foreign call from Python per instance would take longer than the placing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.embree import FLOAT3X4_ROW_MAJOR
from cns_drake.ray_casting.foreign_calls import NUMBER, POINTER, void_call


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_set_transform(
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
def _call_commit(
    typing_context: Any, function: types.Type, handle: types.Type
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcCommitGeometry."""
    return types.void(function, handle), void_call(POINTER)


@compiled
def place_instances(
    set_transform: int,
    commit: int,
    handles: np.ndarray,
    matrices: np.ndarray,
) -> None:
    """Sets the poses of instances.

    Args:
        set_transform: address of rtcSetGeometryTransform.
        commit: address of rtcCommitGeometry.
        handles: (N,) addresses of the instances.
        matrices: (N, 3, 4) float32 affine maps, row by row.
    """
    first, form = np.int64(0), np.int64(FLOAT3X4_ROW_MAJOR)
    for k in range(len(handles)):
        _call_set_transform(
            set_transform, handles[k], first, form, matrices[k].ctypes.data
        )
        _call_commit(commit, handles[k])
