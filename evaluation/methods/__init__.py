"""Place-recognition methods, one a file, all behind one interface."""

from evaluation.methods import scan_context  # noqa: F401  (registers itself)
from evaluation.methods.method import (
    Method,
    MethodConfig,
    known_methods,
    make_method,
    register,
)

__all__ = [
    "Method",
    "MethodConfig",
    "known_methods",
    "make_method",
    "register",
]
