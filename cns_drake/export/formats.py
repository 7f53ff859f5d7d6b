"""The formats to which recordings are exported: a family, found by name."""

from cns_drake.base import family_members

# A module with this ending has the layout of a format.
ENDING = "_layout"


def export_formats() -> tuple[str, ...]:
    """Returns the names of the formats to which a recording is exported."""
    return tuple(
        name.removesuffix(ENDING)
        for name in family_members(str(__package__), "LAYOUT = ")
    )
