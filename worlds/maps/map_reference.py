"""Longitudes and latitudes on a map: a wall, around pyproj."""

from collections.abc import Callable
import math
import re
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field
import shapely
from shapely.geometry import Polygon

from evaluation.base import InputError, InputModel, read_yaml, validated
from worlds.maps.map_folder import MapFolder

if TYPE_CHECKING:
    import pyproj

# Semi-axes of the Earth, WGS 84 [m].
_SEMI_MAJOR = 6378137.0
_FLATTENING = 1.0 / 298.257223563
# Forms of a reference system that PROJ may read: codes, URLs and URNs of EPSG
# and other authorities, well-known text, and PROJ's own parameters if they are
# numbers or words. In all others, and in the parts of well-known text that
# `_WITH_FILES` names, PROJ can open a file, so also a device or a pipe.
_AUTHORITY = r"[A-Za-z]{2,9}"
_FORMS = re.compile(
    rf"(?:{_AUTHORITY}:)?\d+(?:\+(?:{_AUTHORITY}:)?\d+)?"
    rf"|https?://(?:www\.)?opengis\.net/def/crs[\w./:?&=-]*"
    rf"|urn:(?:x-)?ogc:def:crs[\w.:,-]*"
    r"|\s*(?:PROJ|GEOG|GEOC|GEOD|COMPD_|COMPOUND|VERT_?|LOCAL_|ENG)"
    r"(?:CRS|CS|ETICCRS|DCRS|PHICCRS|EDCRS)\s*\[.*"
    r"|(?:\s*\+(?:proj|type|[a-z]+_[012a-z]+|zone|south|ellps|datum|a|b|rf|k|R"
    r"|units|vunits|no_defs|towgs84|axis|pm|gamma|alpha|lonc|over)"
    r"(?:=[A-Za-z0-9.,-]*)?)+\s*",
    re.DOTALL | re.IGNORECASE,
)
_WITH_FILES = re.compile(r"EXTENSION|PARAMETERFILE", re.IGNORECASE)
# A file of heights, which no map takes from its reference system.
_HEIGHTS = re.compile(r"\+geoidgrids=\S*")


def projected_system(name: str) -> "pyproj.CRS":
    """Returns a reference system that a file names.

    Args:
        name: an EPSG code, two of them joined by `+`, the URL or URN of a code,
            well-known text, or parameters of PROJ that name no file. A file
            of heights (`+geoidgrids`) is left out.

    Raises:
        ValueError: the name has another form, or PROJ does not know the system.
    """
    import pyproj

    name = _HEIGHTS.sub("", name)
    if not _FORMS.fullmatch(name) or _WITH_FILES.search(name):
        raise ValueError("not a code, URL, URN or text of a reference system")
    try:
        return pyproj.CRS.from_user_input(name)
    except pyproj.exceptions.ProjError as error:
        raise ValueError("not known to PROJ") from error


class LocalMetres:
    """Converts degrees to metres east and north of an origin.

    The constructor takes the longitude and latitude of the origin [deg]. An
    object is called with longitudes and latitudes (N, 2) [deg], and returns x
    and y (N, 2) [m]. The conversion uses the Earth's radii of curvature at the
    origin. A place d metres north and d metres east of the origin is off by
    about 1.1 d^2 tan(latitude) / R, where R is the Earth's radius. At a
    latitude of 52 deg, this error is 0.5 m for d = 1.5 km, and 22 m for d = 10
    km. At the same latitude, lengths 10 km north of the origin are wrong by 20
    in 10,000.
    """

    def __init__(self, longitude: float, latitude: float):
        e2 = _FLATTENING * (2.0 - _FLATTENING)
        s = math.sin(math.radians(latitude))
        w2 = 1.0 - e2 * s * s
        north = _SEMI_MAJOR * (1.0 - e2) / math.pow(w2, 1.5)
        east = _SEMI_MAJOR / math.sqrt(w2) * math.cos(math.radians(latitude))
        self._origin = np.array([longitude, latitude])
        self._metres = np.radians(1.0) * np.array([east, north])

    def __call__(self, places: np.ndarray) -> np.ndarray:
        offset = places - self._origin
        # The shorter way around the Earth, also across the 180th meridian.
        offset[..., 0] -= 360.0 * np.rint(offset[..., 0] / 360.0)
        return self.metres(offset)

    def metres(self, offset: np.ndarray) -> np.ndarray:
        """Converts differences of longitude and latitude to metres.

        `offset` (..., 2) contains the differences in longitude and latitude
        [deg]. The result (..., 2) contains the distances east and north [m].
        """
        return np.asarray(offset * self._metres)

    def polygon(self, polygon: Polygon) -> Polygon:
        """Converts a polygon from degrees to metres."""
        return shapely.transform(polygon, self)


class _Origin(InputModel):
    """What `import.yaml` says of the coordinates of an imported map.

    Attributes:
        reference_system: name of the system, or its definition for PROJ.
        origin: latitude and longitude [deg], or x, y, z in the system, brought
            to metres east, north and up.
    """

    reference_system: str
    origin: list[Annotated[float, Field(allow_inf_nan=False)]] = Field(
        min_length=2, max_length=3
    )


def metres_on_map(folder: MapFolder) -> Callable[[np.ndarray], np.ndarray]:
    """Returns a function that converts degrees to places of an imported map.

    The function takes longitudes and latitudes (N, 2) of WGS 84 [deg], and
    returns x and y (N, 2) in W [m].

    Raises:
        InputError: the map is not imported, or its reference system is unknown.
    """
    import pyproj

    path = folder.import_facts
    if not path.is_file():
        raise InputError(f"{folder.path}: no {path.name} tells where it lies")
    known = validated(_Origin, read_yaml(path), path)
    if len(known.origin) == 2:
        return LocalMetres(*reversed(known.origin))
    try:
        system = projected_system(known.reference_system)
        (system, *_) = system.sub_crs_list or [system]
        change = pyproj.Transformer.from_crs(
            "OGC:CRS84", system, always_xy=True
        )
    except (ValueError, pyproj.exceptions.ProjError) as error:
        raise InputError(
            f"{path}: reference_system: {known.reference_system[:80]!r} is none"
            " that PROJ knows"
        ) from error
    axes = system.axis_info
    if system.is_geographic or (
        {axis.direction for axis in axes} != {"east", "north"}
    ):
        raise InputError(
            f"{path}: reference_system: its axes are not lengths to the east"
            " and north"
        )
    metres = axes[0].unit_conversion_factor

    def convert(degrees: np.ndarray) -> np.ndarray:
        places = np.column_stack(change.transform(*degrees.T))
        return metres * places - known.origin[:2]

    return convert
