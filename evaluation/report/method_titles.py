"""Names of methods in tables and figures, and their order."""

from __future__ import annotations

from collections.abc import Iterable

# The spelling of the methods' authors, in the order of tables; our methods come
# last.
_TITLES = {
    "scan-context++": "Scan Context++",
    "solid": "SOLiD",
    "ring++": "RING++",
    "btc": "BTC",
    "layered-overlap": "Layered overlap",
}


def title(method: str) -> str:
    """Returns a method's name as its authors write it."""
    return _TITLES.get(method, method)


def in_table_order(methods: Iterable[str]) -> list[str]:
    """Returns methods in the order of tables, others after them by name."""
    known = list(_TITLES)
    return sorted(
        set(methods),
        key=lambda m: (known.index(m) if m in known else len(known), m),
    )
