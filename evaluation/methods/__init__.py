"""Place-recognition methods, one a file, all behind one interface."""

from evaluation.methods import btc, layered_overlap, ringpp, scan_context, solid  # noqa: F401  (register themselves)
from evaluation.methods.method import (
    Method,
    MethodConfig,
    known_methods,
    make_method,
    optional_methods,
    register,
    shipped_methods,
)

__all__ = [
    "Method",
    "MethodConfig",
    "known_methods",
    "make_method",
    "optional_methods",
    "register",
    "shipped_methods",
]
