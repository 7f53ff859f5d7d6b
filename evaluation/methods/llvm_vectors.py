"""Arrays and vectors in the language of the compiler, for intrinsics."""

from __future__ import annotations

from typing import Any

from llvmlite import ir


def array_data(
    context: Any, builder: Any, signature: Any, values: Any, index: int
) -> Any:
    """Returns the pointer to the numbers of an argument, an array.

    Args:
        context, builder, signature, values: those of an intrinsic's code.
        index: of the argument.
    """
    make = context.make_array(signature.args[index])
    return make(context, builder, values[index]).data


def load_vector(builder: Any, array: Any, at: Any, kind: Any) -> Any:
    """Returns numbers that follow each other as a vector.

    Args:
        builder: of the code.
        array: pointer to its first number.
        at: index of the first number that is loaded.
        kind: type of the vector, an `ir.VectorType`.
    """
    vector = builder.load(_place(builder, array, at, kind))
    vector.align = _bytes_of(kind)
    return vector


def store_vector(builder: Any, array: Any, at: Any, vector: Any) -> None:
    """Stores a vector; see `load_vector`."""
    pointer = _place(builder, array, at, vector.type)
    builder.store(vector, pointer).align = _bytes_of(vector.type)


def in_all_lanes(builder: Any, number: Any, kind: Any) -> Any:
    """Returns a vector of a kind each lane of which is a number."""
    index = ir.IntType(32)
    nothing = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(index, 0))
    zeros = ir.Constant(ir.VectorType(index, kind.count), [0] * kind.count)
    return builder.shuffle_vector(first, nothing, zeros)


def _place(builder: Any, array: Any, at: Any, kind: Any) -> Any:
    return builder.bitcast(builder.gep(array, [at]), kind.as_pointer())


def _bytes_of(kind: Any) -> int:
    """Returns the size of a number of a vector; arrays are aligned to it."""
    return (
        4 if isinstance(kind.element, ir.FloatType) else kind.element.width // 8
    )
