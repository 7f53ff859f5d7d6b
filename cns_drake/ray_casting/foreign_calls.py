"""Calls of C functions by their address, from compiled code.

With an address as a value, in place of a ctypes function, numba can keep the
compiled code on disk, which saves a second at every start.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir

# Kinds of arguments: a pointer, or an unsigned number of 32 bits.
POINTER, NUMBER = ir.IntType(8).as_pointer(), ir.IntType(32)


def void_call(*kinds: ir.Type) -> Callable[..., Any]:
    """Returns the generator of a call for numba's `intrinsic`.

    Args:
        kinds: of the function's arguments. The compiled code passes the address
            of the function, then one integer for each argument.
    """
    function_type = ir.FunctionType(ir.VoidType(), kinds)

    def generate(
        context: Any,
        builder: ir.IRBuilder,
        signature: Any,
        values: Sequence[ir.Value],
    ) -> Any:
        function = builder.inttoptr(values[0], function_type.as_pointer())
        arguments = [
            builder.inttoptr(value, kind)
            if kind is POINTER
            else builder.trunc(value, kind)
            for kind, value in zip(kinds, values[1:], strict=True)
        ]
        builder.call(function, arguments)
        return context.get_dummy_value()

    return generate
