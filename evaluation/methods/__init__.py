"""Place-recognition methods: one per file, all with the same interface."""

from evaluation.methods import (  # noqa: F401  (register themselves)
    btc,
    layered_overlap,
    learned,
    ringpp,
    scan_context,
    solid,
)
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import (
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
