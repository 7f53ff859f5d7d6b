"""Placing many instances of Embree's by compiled code.

One foreign call of Python's per instance would take longer than the placing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.ray_casting.embree import FLOAT3X4_ROW_MAJOR
from evaluation.support.compiled import compiled


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_set_transform(
    typing_context: Any,
    function: types.Type,
    handle: types.Type,
    form: types.Type,
    matrix: types.Type,
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcSetGeometryTransform for the first time step."""
    signature = types.void(function, handle, form, matrix)

    def generate(
        context: Any,
        builder: ir.IRBuilder,
        signature: Any,
        values: Sequence[ir.Value],
    ) -> Any:
        pointer, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        function_type = ir.FunctionType(
            ir.VoidType(), [pointer, number, number, pointer]
        )
        builder.call(
            builder.inttoptr(values[0], function_type.as_pointer()),
            [
                builder.inttoptr(values[1], pointer),
                ir.Constant(number, 0),
                builder.trunc(values[2], number),
                builder.inttoptr(values[3], pointer),
            ],
        )
        return context.get_dummy_value()

    return signature, generate


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def _call_commit(
    typing_context: Any, function: types.Type, handle: types.Type
) -> tuple[Any, Callable[..., Any]]:
    """Calls rtcCommitGeometry."""
    signature = types.void(function, handle)

    def generate(
        context: Any,
        builder: ir.IRBuilder,
        signature: Any,
        values: Sequence[ir.Value],
    ) -> Any:
        pointer = ir.IntType(8).as_pointer()
        function_type = ir.FunctionType(ir.VoidType(), [pointer])
        builder.call(
            builder.inttoptr(values[0], function_type.as_pointer()),
            [builder.inttoptr(values[1], pointer)],
        )
        return context.get_dummy_value()

    return signature, generate


@compiled
def place_instances(
    set_transform: int,
    commit: int,
    handles: np.ndarray,
    matrices: np.ndarray,
) -> None:
    """Sets where instances are.

    Args:
        set_transform: address of rtcSetGeometryTransform.
        commit: address of rtcCommitGeometry.
        handles: (N,) addresses of the instances.
        matrices: (N, 3, 4) float32 affine maps, row by row.
    """
    form = np.int64(FLOAT3X4_ROW_MAJOR)
    for k in range(len(handles)):
        _call_set_transform(
            set_transform, handles[k], form, matrices[k].ctypes.data
        )
        _call_commit(commit, handles[k])
