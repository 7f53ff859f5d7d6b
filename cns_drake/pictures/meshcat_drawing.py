"""Drawing a city, a route and scans into a Meshcat scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import DTypeLike
from pydrake.geometry import FrameId, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform
from pydrake.perception import BaseField, Fields, PointCloud

from cns_drake.scene.perception_geometry import PerceptionGeometry
from cns_drake.scene.semantics import CLASS_RGB
from cns_drake.scene.structure_table import StructureTable
from cns_drake.scene.surface_merging import merge_surfaces

# Vertices are put on a grid of 4 mm, which nobody sees: the zeros at the end
# of each float compress well.
_VERTEX_GRID = 2.0**-8

_START_RGB = np.array([1.00, 0.10, 0.10])
_END_RGB = np.array([0.10, 0.30, 1.00])
_ROUTE_WIDTH = 1.2
# The ribbon rises on its way [m], so that where a route passes a second time
# its later part lies on top.
_ROUTE_HEIGHTS = (0.2, 0.7)

_MARKER_HEIGHT = 7.0
_MARKER_RADIUS = 2.5
_MARKER_RGBA = Rgba(1.0, 0.75, 0.0)

_POINT_SIZE = 0.22
# Colours of points repeat over this range of heights above the map's zero.
_LOW, _HIGH = 0.0, 25.0
_NUM_COLORS = 64

_DEFAULT_RGB = (0.7, 0.7, 0.7)


def draw_structures(
    meshcat: Meshcat,
    path: str,
    geometries: Iterable[PerceptionGeometry],
    calc_X_WF: Callable[[FrameId], RigidTransform],
    structures: StructureTable,
    rgba: Rgba | None = None,
) -> None:
    """Draws structures as one mesh for each class, `<path>/<class>`.

    Args:
        meshcat: where to draw.
        path: the layer's path.
        geometries: what to draw.
        calc_X_WF: gives the pose of a geometry's frame in the world.
        structures: gives the class of every structure.
        rgba: colour of all of it; by default each class has its own.
    """
    by_class: dict[str, list[PerceptionGeometry]] = {}
    for geometry in geometries:
        semantic_class = structures[geometry.structure].semantic_class
        by_class.setdefault(semantic_class, []).append(geometry)
    for semantic_class, members in sorted(by_class.items()):
        color = rgba or Rgba(*CLASS_RGB[semantic_class])
        _draw_merged(
            meshcat, f"{path}/{semantic_class}", members, calc_X_WF, color
        )


def draw_body(
    meshcat: Meshcat, path: str, geometries: Iterable[PerceptionGeometry]
) -> None:
    """Draws the geometry of one frame in that frame, in its own colours."""
    by_color: dict[tuple, list[PerceptionGeometry]] = {}
    for geometry in geometries:
        rgb = geometry.rgb or _DEFAULT_RGB
        by_color.setdefault(rgb, []).append(geometry)
    for k, (rgb, members) in enumerate(by_color.items()):
        _draw_merged(
            meshcat,
            f"{path}/{k}",
            members,
            lambda frame_id: RigidTransform(),
            Rgba(*rgb),
        )


def draw_marker(meshcat: Meshcat, path: str) -> None:
    """Draws an arrow that points down at the origin, to be seen from afar."""
    meshcat.SetObject(
        path,
        MeshcatCone(height=_MARKER_HEIGHT, a=_MARKER_RADIUS, b=_MARKER_RADIUS),
        _MARKER_RGBA,
    )


def draw_route(
    meshcat: Meshcat, path: str, X_WBs: Sequence[RigidTransform]
) -> None:
    """Draws a route as a ribbon on the ground, red (start) to blue (end).

    Args:
        meshcat: where to draw.
        path: the route's path.
        X_WBs: poses along the route; its width lies along y of B.
    """
    p_WBset = np.array([X_WB.translation() for X_WB in X_WBs])
    left_W = np.array([X_WB.rotation().matrix()[:, 1] for X_WB in X_WBs])
    step = np.linalg.norm(np.diff(p_WBset, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(step)])
    fraction = (travelled / max(travelled[-1], 1e-9))[:, None]
    first, last = _ROUTE_HEIGHTS
    p_WBset[:, 2:] += (1.0 - fraction) * first + fraction * last
    half = _ROUTE_WIDTH / 2.0 * left_W
    vertices = np.concatenate([p_WBset + half, p_WBset - half])
    rgb = (1.0 - fraction) * _START_RGB + fraction * _END_RGB
    left = np.arange(len(X_WBs) - 1)
    right = left + len(X_WBs)
    triangles = np.concatenate(
        [
            np.column_stack([left, right, right + 1]),
            np.column_stack([left, right + 1, left + 1]),
        ]
    )
    meshcat.SetTriangleColorMesh(
        path,
        _columns(_on_grid(vertices)),
        _columns(triangles, np.int32),
        _columns(_linear(np.concatenate([rgb, rgb]))),
    )


def draw_points(meshcat: Meshcat, path: str, p_WRset: np.ndarray) -> None:
    """Draws points coloured by their height.

    Args:
        meshcat: where to draw.
        path: the path of the points.
        p_WRset: (N, 3) positions in the world [m].
    """
    # Only pages need colour maps, and the import takes a moment.
    from matplotlib import colormaps

    level = np.clip((p_WRset[:, 2] - _LOW) / (_HIGH - _LOW), 0.0, 1.0)
    level = np.round(level * (_NUM_COLORS - 1)) / (_NUM_COLORS - 1)
    cloud = PointCloud(len(p_WRset), Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = _on_grid(p_WRset).T
    # The darkest end of the colour map is hard to tell from asphalt.
    rgb = _linear(colormaps["turbo"](0.1 + 0.9 * level)[:, :3])
    cloud.mutable_rgbs()[:] = np.round(255.0 * rgb).T
    meshcat.SetObject(path, cloud, point_size=_POINT_SIZE)


def set_view(meshcat: Meshcat, lower: np.ndarray, upper: np.ndarray) -> None:
    """Lights a scene by day and looks at it from the air, from the south.

    Args:
        meshcat: the scene.
        lower: (3,) least coordinates of what shall be in view [m].
        upper: (3,) greatest coordinates of what shall be in view [m].
    """
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    # These lamps hang near the origin and would light one block only.
    for lamp in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    for light, intensity in (("AmbientLight", 1.5), ("FillLight", 2.6)):
        path = f"/Lights/{light}/<object>"
        meshcat.SetProperty(path, "intensity", intensity)
    # In the axes of three.js: x east, y up, z south.
    meshcat.SetProperty(
        "/Lights/FillLight/<object>", "position", [-0.8, 1.0, 0.35]
    )
    background = "/Background/<object>"
    meshcat.SetProperty(background, "top_color", [0.55, 0.70, 0.88])
    meshcat.SetProperty(background, "bottom_color", [0.90, 0.93, 0.96])
    center = (lower + upper) / 2.0
    reach = float(np.linalg.norm((upper - lower)[:2])) / 2.0
    # The default camera sees 100 m far.
    meshcat.SetCamera(
        Meshcat.PerspectiveCamera(fov=50.0, near=0.5, far=20.0 * reach + 500.0)
    )
    target = np.array([center[0], center[1], lower[2]])
    meshcat.SetCameraPose(
        target + np.array([-0.35, -1.05, 0.85]) * max(reach, 10.0) * 1.5,
        target,
    )


def _draw_merged(
    meshcat: Meshcat,
    path: str,
    geometries: Sequence[PerceptionGeometry],
    calc_X_TF: Callable[[FrameId], RigidTransform],
    rgba: Rgba,
) -> None:
    surface = merge_surfaces(geometries, calc_X_TF)
    meshcat.SetTriangleMesh(
        path,
        _columns(_on_grid(surface.p_GVset)),
        _columns(surface.triangles, np.int32),
        rgba,
    )


def _linear(srgb: np.ndarray) -> np.ndarray:
    """Returns colours of vertices and points as the page wants them.

    Unlike the colour of a whole object they are taken as linear light.
    """
    return srgb**2.2


def _on_grid(positions: np.ndarray) -> np.ndarray:
    return np.round(positions / _VERTEX_GRID) * _VERTEX_GRID


def _columns(rows: np.ndarray, dtype: DTypeLike = float) -> np.ndarray:
    """Returns the (3, N) array, in Fortran's order, that Drake wants."""
    return np.asfortranarray(rows.T, dtype=dtype)
