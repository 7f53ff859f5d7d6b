"""Place-recognition methods, one a file, all behind one interface."""

from evaluation.methods import btc, ringpp, scan_context, solid  # noqa: F401  (register themselves)
from evaluation.methods.method import (
    Method,
    MethodConfig,
    known_methods,
    make_method,
    register,
    shipped_methods,
)

__all__ = [
    "Method",
    "MethodConfig",
    "known_methods",
    "make_method",
    "register",
    "shipped_methods",
]
