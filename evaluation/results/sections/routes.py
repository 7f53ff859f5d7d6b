"""The section with each drive's route on its map from above."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import io

from markupsafe import Markup
from matplotlib import image
import numpy as np

from evaluation.base import distances_along
from evaluation.drives import sample_frames
from evaluation.results.page_frame import PageSection, page_section, rendered
from evaluation.results.sections.camera_images import CameraImages
from evaluation.results.sections.point_rendering import (
    OrthographicView,
    Picture,
    colour_by_height,
    render,
)

# The view from above is coloured like a plan: streets pale, walls dark.
_GROUND = (226, 229, 232)
_HIGHEST = (72, 88, 112)
_FROM_ABOVE = OrthographicView(
    azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=2.5
)
# Margin of a view from above around the route [m].
_MARGIN = 60.0
# Quality of compressed pictures, from 0 to 100.
_WEBP_QUALITY = 75
# Between the points of a drawn route [m].
_ROUTE_STEP = 2.0
# Number of arrow heads on a drawn route.
_NUM_ARROWS = 12
# Size of the marks of start and end, as a part of the picture.
_MARK = 0.016
# Distance of the scale bar from the edges, as a part of the picture.
_INSET = 0.03
# Length of the scale bar [m].
_BAR_LENGTH = 50.0


@dataclass(frozen=True)
class PageDrive:
    """A drive as the page shows it.

    Attributes:
        frames: (K,) frames that are places or queries, increasing.
        X_WS: (K, 4, 4) poses of the sensor at these frames.
        route: (M, 2) the path of the sensor from above [m].
        thumbnails: K reduced scans (see `evaluation.maps.thumbnails`).
        view: the map from above, as a WebP file.
        extent: left, right, bottom and top of the view [m].
        images: images of the drive's camera at the frames, if the drive has a
            camera.
        name: name of the drive.
    """

    name: str
    frames: np.ndarray
    X_WS: np.ndarray
    route: np.ndarray
    thumbnails: list[np.ndarray]
    view: bytes
    extent: tuple[float, float, float, float]
    images: CameraImages | None = None


def make_page_drive(
    name: str,
    points: np.ndarray,
    X_WS: np.ndarray,
    frames: Sequence[int],
    thumbnails: list[np.ndarray],
    images: CameraImages | None = None,
) -> PageDrive:
    """Returns a drive as the page shows it.

    Args:
        name: name of the drive.
        points: (P, 3) cloud of the drive's map in W [m].
        X_WS: (N, 4, 4) poses of the LiDAR at all frames.
        frames: numbers of the K frames that are places or queries.
        thumbnails: K reduced scans, one for each of these frames.
        images: images of the drive's camera at these frames, if the drive has a
            camera.
    """
    positions = X_WS[:, :3, 3]
    view = _top_view(points, positions)
    stream = io.BytesIO()
    image.imsave(
        stream, view.image, format="webp", pil_kwargs={"quality": _WEBP_QUALITY}
    )
    chosen = np.array(frames, dtype=np.int64)
    return PageDrive(
        name=name,
        frames=chosen,
        X_WS=X_WS[chosen],
        route=positions[sample_frames(positions, _ROUTE_STEP), :2],
        thumbnails=thumbnails,
        view=stream.getvalue(),
        extent=view.extent,
        images=images,
    )


def routes_section(
    drives_of_maps: Mapping[str, Iterable[PageDrive]], pages: Mapping[str, str]
) -> PageSection:
    """Returns the section with all routes.

    Args:
        drives_of_maps: name of a map -> its drives.
        pages: name of a drive -> address of the web page of its recording.
            Drives can be absent.
    """
    return page_section(
        "routes",
        "Maps",
        "the drives",
        drives_of_maps=drives_of_maps,
        pages=pages,
        picture=_route_picture,
        bar_length=round(_BAR_LENGTH),
    )


def _top_view(points: np.ndarray, positions: np.ndarray) -> Picture:
    """Returns a picture of a route's surroundings from above, x to the right.

    Args:
        points: (P, 3) cloud in W [m].
        positions: (N, 3) positions of the sensor along the route in W [m].
    """
    low, high = positions[:, :2].min(axis=0), positions[:, :2].max(axis=0)
    near = (
        (points[:, :2] >= low - _MARGIN) & (points[:, :2] <= high + _MARGIN)
    ).all(axis=1)
    if not near.any():
        near[:] = True
    shown = points[near]
    rgb = colour_by_height(shown[:, 2], _GROUND, _HIGHEST)
    return render(shown, rgb, _FROM_ABOVE)


def _route_picture(drive: PageDrive) -> Markup:
    """Returns a drive's route on its map from above, as an SVG element.

    Arrow heads show its direction, and numbers its kilometres. One unit is one
    metre; the x axis is directed to the right, the y axis downwards. The map's
    picture is an element `image` with the id `view-<name of the drive>`, which
    the query browser uses as well.
    """
    left, right, bottom, top = drive.extent
    width, height = right - left, top - bottom
    size = _MARK * max(width, height)
    data = base64.b64encode(drive.view).decode("ascii")
    route = drive.route * [1.0, -1.0]
    (x0, y0), (x1, y1) = route[0], route[-1]
    end, base = right - _INSET * width, -bottom - _INSET * height
    mark = [[x0, y0 - size], [x0 - size, y0 + size], [x0 + size, y0 + size]]
    arrows = []
    for k in np.linspace(0, len(route) - 1, _NUM_ARROWS + 1).astype(int)[1:-1]:
        ahead = route[min(k + 1, len(route) - 1)] - route[max(k - 1, 0)]
        length = np.linalg.norm(ahead)
        if length > 0.0:
            along = size * ahead / length
            side = 0.7 * np.array([-along[1], along[0]])
            arrows.append(
                route[k] + np.array([along, -along + side, -along - side])
            )
    travelled = distances_along(route)
    kilometres = [
        (number, _coordinates(route[np.searchsorted(travelled, 1e3 * number)]))
        for number in range(1, int(travelled[-1] // 1000) + 1)
    ]
    return rendered(
        "route.svg",
        name=drive.name,
        box=_coordinates([left, -top, width, height]),
        image=f"data:image/webp;base64,{data}",
        route=_point_list(route),
        arrows=map(_point_list, arrows),
        kilometres=kilometres,
        size=f"{2.5 * size:.1f}",
        start=_point_list(np.array(mark)),
        end=_coordinates([x1 - size, y1 - size, 2 * size]),
        bar=_coordinates([end - _BAR_LENGTH, end, base]),
    )


def _point_list(line: np.ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _coordinates(values: Iterable[float]) -> list[str]:
    return [f"{value:.2f}" for value in values]
