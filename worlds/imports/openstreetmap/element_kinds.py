"""Kinds of OpenStreetMap's elements, from their tags."""

from worlds.imports.openstreetmap.features import Tags
from worlds.imports.openstreetmap.tags import TABLES, has_tag

_KIND_KEYS = tuple(TABLES["kinds"].split())
_GONE = tuple(TABLES["gone"].split())
_LIFECYCLE = tuple(TABLES["lifecycle"].split())


def element_kind(tags: Tags) -> str:
    """Returns the kind of an element in words, from the first known tag.

    An example is `highway=residential`. Without a known tag, the kind is
    `other`.
    """
    for key in _KIND_KEYS:
        if has_tag(tags, key):
            return f"{key}={tags[key]}"
    if any(key.startswith("addr:") for key in tags):
        return "address"
    for key in tags:
        stage, _, rest = key.partition(":")
        if stage in _LIFECYCLE and rest:
            return f"{stage}:{rest}"
    return f"relation of type {tags['type']}" if "type" in tags else "other"


def is_building(tags: Tags) -> bool:
    """Returns whether tags describe a building or a part of a building.

    Towers, masts, chimneys and tanks of `man_made` count, too. A former
    building counts as well, if its tags state the date of its demolition.
    """
    return (
        has_tag(tags, "building")
        or has_tag(tags, "building:part")
        or tags.get("man_made") in TABLES["works"]
        or ("end_date" in tags and was_building(tags))
    )


def was_building(tags: Tags) -> bool:
    """Returns whether tags mark a building that no longer exists."""
    return any(has_tag(tags, f"{stage}:building") for stage in _GONE)
