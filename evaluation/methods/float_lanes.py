"""Numbers that are computed side by side, for compiled functions.

A compiled function computes with sixteen numbers as with one: it loads them
from an array, adds, subtracts and multiplies them, and stores them. A compiler
finds such vectors by itself only in loops over few arrays. No product is fused
with a sum, so that results do not depend on the processor.
"""

from __future__ import annotations

from collections.abc import Callable
import operator
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import (
    intrinsic,
    models,
    overload,
    register_model,
)

from evaluation.methods.llvm_vectors import (
    array_data,
    in_all_lanes,
    load_vector,
    store_vector,
)

# How many numbers are computed side by side.
LANES = 16

_FLOATS = ir.VectorType(ir.FloatType(), LANES)
_WORDS = ir.VectorType(ir.IntType(32), LANES)
_ALL_BUT_SIGN = 0x7FFFFFFF


class _Floats(types.Type):
    """The type of LANES float32 in compiled functions."""

    def __init__(self) -> None:
        super().__init__(name=f"float32x{LANES}")


_floats = _Floats()


@register_model(_Floats)
class _FloatsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any):
        super().__init__(manager, kind, _FLOATS)


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def load(
    typing_context: Any, array: Any, at: Any
) -> tuple[Any, Callable[..., Any]]:
    """Returns LANES numbers of a contiguous float32 array (N,), from `at`."""

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        data = array_data(context, builder, signature, values, 0)
        return load_vector(builder, data, values[1], _FLOATS)

    return _floats(array, types.intp), generate


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def store(
    typing_context: Any, array: Any, at: Any, lanes: Any
) -> tuple[Any, Callable[..., Any]]:
    """Stores LANES numbers in a contiguous float32 array (N,), from `at`."""

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        data = array_data(context, builder, signature, values, 0)
        store_vector(builder, data, values[1], values[2])
        return context.get_dummy_value()

    return types.void(array, types.intp, _floats), generate


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def same(typing_context: Any, number: Any) -> tuple[Any, Callable[..., Any]]:
    """Returns LANES numbers that are all a float32."""

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        return in_all_lanes(builder, values[0], _FLOATS)

    return _floats(types.float32), generate


@intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
def magnitude(
    typing_context: Any, lanes: Any
) -> tuple[Any, Callable[..., Any]]:
    """Returns the magnitudes of LANES numbers."""

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        words = builder.bitcast(values[0], _WORDS)
        kept = ir.Constant(_WORDS, [_ALL_BUT_SIGN] * LANES)
        return builder.bitcast(builder.and_(words, kept), _FLOATS)

    return _floats(_floats), generate


def _enable(operation: Callable, instruction: str) -> None:
    """Makes an operator of Python work on LANES numbers."""

    @intrinsic  # type: ignore[untyped-decorator]  # numba has no hints.
    def compute(
        typing_context: Any, left: Any, right: Any
    ) -> tuple[Any, Callable[..., Any]]:
        def generate(
            context: Any, builder: Any, signature: Any, values: Any
        ) -> Any:
            return getattr(builder, instruction)(*values)

        return _floats(_floats, _floats), generate

    @overload(operation)  # type: ignore[untyped-decorator]
    def implement(left: Any, right: Any) -> Callable | None:
        def computed(left: Any, right: Any) -> Any:
            return compute(left, right)

        are_lanes = isinstance(left, _Floats) and isinstance(right, _Floats)
        return computed if are_lanes else None


_enable(operator.add, "fadd")
_enable(operator.iadd, "fadd")
_enable(operator.sub, "fsub")
_enable(operator.mul, "fmul")
