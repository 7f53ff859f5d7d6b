"""The names of methods, as their authors write them and in one order."""

from collections.abc import Iterable

# The spelling of the methods' authors, in the order of tables; our methods come
# last.
_METHOD_TITLES = {
    "scan-context++": "Scan Context++",
    "solid": "SOLiD",
    "ring++": "RING++",
    "btc": "BTC",
    "layered-overlap": "Layered overlap",
    "learned": "Learned",
    "bevplace": "BEVPlace",
    "dpa-net": "DPA-Net",
    "map-closures": "MapClosures",
    "probe": "PROBE",
    "svt-net": "SVT-Net",
}


def title(label: str) -> str:
    """Returns the name of a method as its authors write it, with its settings.

    Args:
        label: name of the method as on the command line and, after a comma, its
            settings, if any.
    """
    method, comma, settings = label.partition(",")
    return f"{_METHOD_TITLES.get(method, method)}{comma}{settings}"


def in_table_order(methods: Iterable[str]) -> list[str]:
    """Returns methods in the order of tables.

    Methods without a place in this order follow, sorted by name.
    """
    known = list(_METHOD_TITLES)
    return sorted(
        set(methods),
        key=lambda m: (known.index(m) if m in known else len(known), m),
    )
