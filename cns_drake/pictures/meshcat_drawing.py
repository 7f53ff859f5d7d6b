"""Draws a city and a route into a Meshcat scene."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import DTypeLike
from pydrake.geometry import Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform

from cns_drake.pictures.city_parts import DEFAULT_RGB, ColouredPart
from cns_drake.scene import (
    PerceptionGeometry,
    TriangleSurface,
    merge_surfaces,
    merge_triangles,
)
from evaluation.base import distances_along

# Vertices are rounded to an invisible grid of 16 mm, because the zeros at the
# end of each float compress well.
_VERTEX_GRID = 2.0**-6

# One colour, since points have a colour map.
ROUTE_RGB = (1.0, 0.75, 0.0)
_ROUTE_WIDTH = 2.0
# Height of the ribbon at the start and at the end of the route [m]: where a
# route passes twice, its later part is on top.
_ROUTE_HEIGHTS = (0.2, 0.7)

# The cone that marks a place [m].
_MARKER_HEIGHT = 7.0
_MARKER_RADIUS = 2.5
_MARKER_RGBA = Rgba(1.0, 0.75, 0.0)

# Heights above the map's zero with the first and the last colour of points [m].
POINT_HEIGHTS = (0.0, 25.0)
# Number of colours between them.
_NUM_COLORS = 64

# Direction towards the sun, in the south-west, so that the visible sides are
# lit.
_SUN_W = np.array([-0.50, -0.55, 0.67]) / np.linalg.norm([-0.50, -0.55, 0.67])
# Margin around the view within which shadows are cast [m].
_SHADOW_MARGIN = 150.0
# Height of what casts shadows [m].
_SHADOW_HEIGHT = 120.0
# Side of the map of shadows [pixels].
_SHADOW_PIXELS = 4096.0

_WHITE = [1.0, 1.0, 1.0, 1.0]
# Lower than that of sRGB, so that asphalt in the shade is not black.
_GAMMA = 1.8
# High in the sky.
_SKY_RGB = [0.30, 0.55, 0.92]
_SUNLIGHT = 2.1
_SKYLIGHT = 2.6


def draw_parts(
    meshcat: Meshcat, path: str, parts: Iterable[ColouredPart]
) -> None:
    """Draws parts of a city as one mesh per class, named `<path>/<class>`.

    Args:
        meshcat: Meshcat's server.
        path: path in Meshcat.
        parts: the parts.
    """
    by_class: dict[str, list[ColouredPart]] = {}
    for part in parts:
        by_class.setdefault(part.semantic_class, []).append(part)
    for semantic_class, members in sorted(by_class.items()):
        surface, owners = merge_triangles(
            [(k, RigidTransform(), m.surface) for k, m in enumerate(members)]
        )
        rgb = np.zeros_like(surface.p_GVset)
        rgb[surface.triangles] = np.array([m.rgb for m in members])[
            owners, None
        ]
        _draw_mesh(meshcat, f"{path}/{semantic_class}", surface, rgb)


def draw_body(
    meshcat: Meshcat, path: str, geometries: Iterable[PerceptionGeometry]
) -> None:
    """Draws the geometry of one frame in its own colours.

    Args:
        meshcat: Meshcat's server.
        path: path in Meshcat of the frame.
        geometries: the geometries of the frame.
    """
    by_color: dict[tuple, list[PerceptionGeometry]] = {}
    for geometry in geometries:
        rgb = geometry.rgb or DEFAULT_RGB
        by_color.setdefault(rgb, []).append(geometry)
    for k, (rgb, members) in enumerate(by_color.items()):
        surface = merge_surfaces(members, lambda frame_id: RigidTransform())
        _draw_mesh(meshcat, f"{path}/{k}", surface, Rgba(*rgb))


def draw_marker(meshcat: Meshcat) -> None:
    """Draws a large cone that stands on its tip at the vehicle's origin."""
    meshcat.SetObject(
        "/vehicle/marker",
        MeshcatCone(height=_MARKER_HEIGHT, a=_MARKER_RADIUS, b=_MARKER_RADIUS),
        _MARKER_RGBA,
    )


def draw_route(
    meshcat: Meshcat, path: str, X_WBs: Sequence[RigidTransform]
) -> None:
    """Draws a route as a flat ribbon of one colour.

    Args:
        meshcat: Meshcat's server.
        path: path in Meshcat of the ribbon.
        X_WBs: poses of the vehicle along the route.
    """
    p_WBset = np.array([X_WB.translation() for X_WB in X_WBs])
    left_W = np.array([X_WB.rotation().matrix()[:, 1] for X_WB in X_WBs])
    travelled = distances_along(p_WBset)
    fraction = (travelled / max(travelled[-1], 1e-9))[:, None]
    first, last = _ROUTE_HEIGHTS
    p_WBset[:, 2:] += (1.0 - fraction) * first + fraction * last
    half = _ROUTE_WIDTH / 2.0 * left_W
    vertices = np.concatenate([p_WBset + half, p_WBset - half])
    left = np.arange(len(X_WBs) - 1)
    right = left + len(X_WBs)
    triangles = np.concatenate(
        [
            np.column_stack([left, right, right + 1]),
            np.column_stack([left, right + 1, left + 1]),
        ]
    )
    surface = TriangleSurface(vertices, triangles.astype(np.int32))
    _draw_mesh(meshcat, path, surface, Rgba(*ROUTE_RGB))
    meshcat.SetProperty(f"{path}/<object>", "castShadow", False)


def height_rgb(z: np.ndarray) -> np.ndarray:
    """Returns sRGB colours (N, 3) for points at heights (N,) [m]."""
    lowest, highest = POINT_HEIGHTS
    level = np.clip((z - lowest) / (highest - lowest), 0.0, 1.0)
    return scale_rgb(np.round(level * (_NUM_COLORS - 1)) / (_NUM_COLORS - 1))


def scale_rgb(level: np.ndarray) -> np.ndarray:
    """Returns sRGB colours (N, 3) of points for levels (N,) from 0 to 1."""
    # Only pages need colour maps, and the import takes a moment.
    from matplotlib import colormaps

    # A map without the greens, greys and browns of a city.
    return colormaps["plasma"](0.05 + 0.9 * level)[:, :3]


def set_view(meshcat: Meshcat, lower: np.ndarray, upper: np.ndarray) -> None:
    """Lights a scene as by day; sets a view from the south and above.

    Args:
        meshcat: Meshcat's server with the scene.
        lower, upper: (3,) least and greatest coordinates that the view shows
            [m].
    """
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    background = "/Background/<object>"
    meshcat.SetProperty(background, "top_color", _SKY_RGB)
    # The horizon is between the two.
    meshcat.SetProperty(background, "bottom_color", _WHITE[:3])
    _set_lights(meshcat, lower, upper)
    center = (lower + upper) / 2.0
    reach = float(np.linalg.norm((upper - lower)[:2])) / 2.0
    # The default camera sees only 100 m far.
    meshcat.SetCamera(
        Meshcat.PerspectiveCamera(fov=50.0, near=0.5, far=20.0 * reach + 500.0)
    )
    # The camera is south of the middle and looks north.
    target = np.array([center[0], center[1] - 0.15 * reach, lower[2]])
    meshcat.SetCameraPose(
        target + np.array([-0.35, -1.05, 0.85]) * max(reach, 10.0) * 1.5, target
    )


def _set_lights(meshcat: Meshcat, lower: np.ndarray, upper: np.ndarray) -> None:
    # These lamps are near the origin and would light one block only.
    for lamp in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", _SKYLIGHT)
    sun = "/Lights/FillLight/<object>"
    meshcat.SetProperty(sun, "intensity", _SUNLIGHT)
    # The sun shines towards the origin, and casts shadows in a box along its
    # rays. The box must contain the whole view.
    low = np.array([*(lower[:2] - _SHADOW_MARGIN), lower[2] - 10.0])
    high = np.array([*(upper[:2] + _SHADOW_MARGIN), upper[2] + _SHADOW_HEIGHT])
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8)
    right = np.cross([0.0, 0.0, 1.0], _SUN_W)
    right /= np.linalg.norm(right)
    up = np.cross(_SUN_W, right)
    across, along, toward = np.array([right, up, _SUN_W]) @ corners
    distance = toward.max() + 10.0
    meshcat.SetProperty(sun, "position", list(distance * _SUN_W))
    for name, value in {
        "camera.left": across.min(),
        "camera.right": across.max(),
        "camera.bottom": along.min(),
        "camera.top": along.max(),
        "camera.near": 1.0,
        "camera.far": distance - toward.min() + 10.0,
        "mapSize.x": _SHADOW_PIXELS,
        "mapSize.y": _SHADOW_PIXELS,
        "normalBias": 0.3,
    }.items():
        meshcat.SetProperty(sun, f"shadow.{name}", float(value))
    meshcat.SetProperty(sun, "castShadow", True)


def _draw_mesh(
    meshcat: Meshcat,
    path: str,
    surface: TriangleSurface,
    colours: Rgba | np.ndarray,
) -> None:
    """Draws a mesh with one colour, or with sRGB colours (N, 3) of vertices."""
    # Browsers have vertices in single precision, but not transforms.
    p_GO = np.round(surface.p_GVset[:1], -5).sum(axis=0)
    if p_GO.any():
        meshcat.SetTransform(path, RigidTransform(p_GO))
    vertices = _columns(_on_grid(surface.p_GVset - p_GO))
    triangles = _columns(surface.triangles, np.int32)
    if isinstance(colours, Rgba):
        meshcat.SetTriangleMesh(path, vertices, triangles, colours)
        return
    rgb = _columns(_linear_light(colours))
    meshcat.SetTriangleColorMesh(path, vertices, triangles, rgb)
    # Drake's default, light grey, would darken the colours.
    meshcat.SetProperty(path, "color", _WHITE)


def _linear_light(srgb: np.ndarray) -> np.ndarray:
    """Returns colours of vertices in linear light, for the page.

    Meshcat takes only the colour of a whole object as sRGB.
    """
    return srgb**_GAMMA


def _on_grid(positions: np.ndarray) -> np.ndarray:
    return np.round(positions / _VERTEX_GRID) * _VERTEX_GRID


def _columns(rows: np.ndarray, dtype: DTypeLike = float) -> np.ndarray:
    """Returns an array as (3, N) in Fortran order, which Drake requires."""
    return np.asfortranarray(rows.T, dtype=dtype)
