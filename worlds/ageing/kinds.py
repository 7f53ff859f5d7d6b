"""What the kinds of structures mean to a city that ages."""

from pathlib import Path

from evaluation.base import parse_yaml

# Trees, the plants that grow.
TREE = "tree"
# Ground of parking bays, which is part of the streets.
PARKING_BAYS = "parking_bays"
_TABLE = parse_yaml(Path(__file__).with_name("kinds.yaml").read_bytes())
_LISTS = {use: frozenset(text.split()) for use, text in _TABLE.items()}


def is_kept(kind: str) -> bool:
    """Returns whether buildings of a kind never change, such as churches."""
    return _is_one_of("kept", kind)


def is_dwelling(kind: str) -> bool:
    """Returns whether buildings of a kind may get balconies."""
    return _is_one_of("dwellings", kind)


def is_signal(kind: str) -> bool:
    """Returns whether poles of a kind carry traffic lights."""
    return _is_one_of("signals", kind)


def is_never_built_on(kind: str) -> bool:
    """Returns whether nobody builds on ground of a kind, such as a park."""
    return not _LISTS["never_built_on"].isdisjoint(kind.split("_"))


def _is_one_of(use: str, kind: str) -> bool:
    return not _LISTS[use].isdisjoint((kind, kind.rpartition("_")[2]))
