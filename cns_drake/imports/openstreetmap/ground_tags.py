"""What OpenStreetMap's tags say about an area on the ground."""

from collections.abc import Mapping

from cns_drake.imports.openstreetmap.tags import TABLES


def area_kind(tags: Mapping[str, str]) -> tuple[str, str] | None:
    """Returns the kind and the semantic class of an area on the ground.

    The result is None for tags of anything else.
    """
    if tags.get("natural") == "water" or tags.get("waterway") in (
        "riverbank",
        "dock",
    ):
        return "WaterBody", "other-ground"
    if tags.get("amenity") == "parking":
        return "Parking", "parking"
    if tags.get("highway") == "pedestrian" or tags.get("place") == "square":
        return "Square", "other-ground"
    if green_kind(tags):
        return "LandUse", "terrain"
    return None


def green_kind(tags: Mapping[str, str]) -> str:
    """Returns the kind of green land, such as `park`; "" if there is none."""
    return next(
        (
            tags[key]
            for key, values in TABLES["green"].items()
            if tags.get(key) in values.split()
        ),
        "",
    )
