"""Makes a web page of a drive through a city; the page needs no server."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
import contextlib
from dataclasses import replace
from html import escape
import logging
from pathlib import Path
import re
import zlib

import numpy as np
from pydrake import geometry
from pydrake.geometry import FrameId, Meshcat, MeshcatParams
from pydrake.math import RigidTransform

from cns_drake.base import write_text
from cns_drake.pictures import meshcat_drawing as drawing
from cns_drake.pictures.city_parts import (
    ColouredPart,
    compare_parts,
    read_parts,
)
from cns_drake.pictures.drive_record import DriveRecord
from cns_drake.pictures.page_panel import (
    CHANGE_RGB,
    ShownStages,
    make_panel,
    read_template,
)
from cns_drake.scene import PerceptionGeometry, World, read_perception_geometry

# Opacity of absent structures. They are hidden behind present ones, and cast no
# shadow.
_OPACITY = 0.45
_UNREAL = {
    "castShadow": False,
    "material.polygonOffset": True,
    "material.polygonOffsetFactor": 1.0,
    "material.polygonOffsetUnits": 4.0,
}
# Traffic gets a pose only every so many frames, which keeps pages small. In the
# tightest turns at 10 m/s, the error between these frames is 0.1 m.
_TRAFFIC_INTERVAL = 5
_ALONE = ShownStages()


def make_drive_page(
    drive: DriveRecord,
    world: World,
    shown: ShownStages = _ALONE,
    title: str = "cns-drake",
) -> str:
    """Returns the HTML of a page with the city, the drive and its scans.

    The page has layers, which can be switched on and off:

    - `/city/<class>`: the structures of the stage in their own colours,
    - `/vehicle/<body>`, `/moving/<body>`: the moving bodies,
    - `/route`: a ribbon along the route,
    - `/scans/<k>`: LiDAR points coloured by height; each point appears at the
      time of its measurement,
    - `/stage_difference/additional/<class>`: parts of the city that are missing
      or lower in the other stage; they are not in `/city`,
    - `/stage_difference/absent/<class>`: structures that exist only in the
      other stage, translucent red, off when the page opens,
    - `/stage_difference/lower/<class>`: upper parts, in the other stage, of
      structures that are lower in this stage, translucent orange, off when the
      page opens.

    A panel shows the title, the stage and the switches, which are also the
    legend. The switches let the camera follow the car, hide layers, and show
    the change (additional parts in violet). Other panels show the images of
    cameras. Below the time line are plots of the speed and the IMU. On a phone,
    the panels are one sheet, which is folded when the page opens.

    Args:
        drive: what is shown of the drive.
        world: world of the stage.
        shown: the stage, and the other stage with which it is compared, if any.
        title: title of the page.
    """
    with _without_port_message():
        meshcat = geometry.Meshcat(MeshcatParams(host="127.0.0.1", port=0))
    changes = _draw_city(meshcat, world, shown.other)
    if len(drive.X_WBs) > 1:
        drawing.draw_route(meshcat, "/route", drive.X_WBs)
    _animate(meshcat, drive, world)
    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    drawing.set_view(meshcat, p_WBset.min(axis=0), p_WBset.max(axis=0))
    return make_static_page(
        meshcat,
        title,
        body=make_panel(title, drive, changes, shown),
        script=read_template("drive.js"),
    )


def moving_frames(world: World) -> tuple[FrameId, ...]:
    """Returns those geometry frames of a world that can move.

    Frames without geometry that a LiDAR can see are left out.
    """
    inspector = world.scene_graph.model_inspector()
    frames = (
        inspector.GetFrameId(geometry_id)
        for geometry_id in inspector.GetAllGeometryIds(
            geometry.Role.kPerception
        )
    )
    anchored = world.anchored_frames()
    return tuple(f for f in dict.fromkeys(frames) if f not in anchored)


def _draw_city(
    meshcat: geometry.Meshcat, world: World, other_stage: World | None
) -> set[str]:
    """Draws static structures; returns the kinds of change that exist."""
    own = read_parts(world)
    other = own if other_stage is None else read_parts(other_stage)
    difference = compare_parts(own, other)
    drawing.draw_parts(meshcat, "/city", difference.common)
    drawing.draw_parts(
        meshcat, "/stage_difference/additional", difference.additional
    )
    _draw_missing(meshcat, "absent", difference.absent)
    _draw_missing(meshcat, "lower", difference.lower)
    return {name for name in CHANGE_RGB if getattr(difference, name)}


def _draw_missing(
    meshcat: geometry.Meshcat, name: str, parts: Sequence[ColouredPart]
) -> None:
    """Draws parts that only the other stage has; they are hidden at first."""
    if not parts:
        return
    path = f"/stage_difference/{name}"
    drawing.draw_parts(
        meshcat, path, parts, geometry.Rgba(*CHANGE_RGB[name], _OPACITY)
    )
    for semantic_class in {part.semantic_class for part in parts}:
        for key, value in _UNREAL.items():
            meshcat.SetProperty(f"{path}/{semantic_class}/<object>", key, value)
    meshcat.SetProperty(path, "visible", False)


def _animate(
    meshcat: geometry.Meshcat, drive: DriveRecord, world: World
) -> None:
    """Draws moving bodies and scans, and animates them over the drive."""
    animation = geometry.MeshcatAnimation(frames_per_second=1.0 / drive.period)
    # Frame of each limb -> the frame that leads it, and the pose of the limb in
    # it.
    led = {frame: (frame, RigidTransform()) for frame in drive.X_WFs}
    for leading, X_FLs in drive.limbs.items():
        led |= {limb: (leading, X_FL) for limb, X_FL in X_FLs.items()}
    drawn: dict[FrameId, list[PerceptionGeometry]] = {
        frame: [] for frame in drive.X_WFs
    }
    inspector = world.scene_graph.model_inspector()
    for shape in read_perception_geometry(inspector, led.__contains__):
        leading, X_FL = led[shape.frame_id]
        drawn[leading].append(replace(shape, X_FG=X_FL @ shape.X_FG))
    for leading, geometries in drawn.items():
        path = _path(world, drive, leading)
        drawing.draw_body(meshcat, path, geometries)
        X_WFs = drive.X_WFs[leading]
        meshcat.SetTransform(path, X_WFs[0])
        # The page interpolates between these frames.
        interval = _TRAFFIC_INTERVAL if leading in drive.limbs else 1
        last = len(X_WFs) - 1
        for frame in {*range(0, last, interval), last}:
            animation.SetTransform(frame, path, X_WFs[frame])
    # The script of the page places it.
    drawing.draw_marker(meshcat)
    for k, (frame, p_WRset) in enumerate(drive.scans):
        path = f"/scans/{k:03d}"
        drawing.draw_points(meshcat, path, p_WRset)
        if frame > 0:
            animation.SetProperty(0, path, "visible", False)
            animation.SetProperty(frame, path, "visible", True)
    animation.set_autoplay(True)
    animation.set_loop_mode(geometry.MeshcatAnimation.LoopMode.kLoopOnce)
    animation.set_clamp_when_finished(True)
    meshcat.SetAnimation(animation)


def _path(world: World, drive: DriveRecord, frame_id: FrameId) -> str:
    """Returns the layer that contains a moving frame."""
    if frame_id in drive.names:
        return f"/moving/{drive.names[frame_id]}"
    body = world.plant.GetBodyFromFrameId(frame_id)
    if body.model_instance() == world.vehicle:
        return f"/vehicle/{body.name()}"
    return f"/moving/{body.scoped_name()}".replace("::", "/")


@contextlib.contextmanager
def _without_port_message() -> Iterator[None]:
    """Stops Drake from printing the address of a port that is not for users."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)


# Level of compression. Higher levels take many times as long for a few percent.
_LEVEL = 4
# Bytes per row: the size of a vertex or of a triangle. Rows differ little from
# the row before, and the differences compress well.
_ROW = 12

# The form in which Meshcat.StaticHtml() embeds each of its commands.
_COMMAND = re.compile(
    r'fetch\("data:application/octet-binary;base64,([A-Za-z0-9+/=]*)"\)\s*'
    r"\.then\(res => res\.arrayBuffer\(\)\)\s*"
    r"\.then\(buffer => viewer\.handle_command_bytearray\("
    r"new Uint8Array\(buffer\)\)\);"
)

# Commands run one after the other. Drake's page runs all at once, so that a
# command could overtake a larger one that it needs.
_QUEUE = """
    // Undoes what `filter_rows` did in Python.
    function unfilterRows(planes, length) {
      const bytes = new Uint8Array(planes.length);
      for (let column = 0, at = 0; column < ROW; ++column) {
        let value = 0;
        for (let k = column; k < bytes.length; k += ROW) {
          value = (value + planes[at++]) & 255;
          bytes[k] = value;
        }
      }
      return bytes.subarray(0, length);
    }
    let commands = Promise.resolve();
    function enqueue(data, filteredLength) {
      commands = commands
          .then(() => fetch("data:application/octet-binary;base64," + data))
          .then(res => new Response(res.body.pipeThrough(
              new DecompressionStream("deflate"))).arrayBuffer())
          .then(buffer => new Uint8Array(buffer))
          .then(bytes => viewer.handle_command_bytearray(
              filteredLength ? unfilterRows(bytes, filteredLength) : bytes));
    }
""".replace("ROW", str(_ROW))


def make_static_page(
    meshcat: Meshcat, title: str, *, body: str = "", script: str = ""
) -> str:
    """Returns a Meshcat scene as a web page that needs no server.

    The page is Drake's page with compressed commands, so that a city takes a
    third of the space. Browsers have been able to decompress such commands
    since 2023.

    Args:
        meshcat: the server with the scene.
        title: title of the page, plain text.
        body: HTML that precedes the scene and is visible while the scene loads.
        script: JavaScript module that runs when the page is ready. In this
            module, `commands` is a JavaScript promise of the scene's commands.
    """
    html = meshcat.StaticHtml()
    first = _COMMAND.search(html)
    if first is None:
        raise RuntimeError(
            "this version of Drake writes Meshcat pages in another form; use "
            "the version in pyproject.toml"
        )
    head = html[: first.start()]
    rest = _COMMAND.sub(_compressed, html[first.start() :])
    viewport = '<meta name="viewport" content="width=device-width">'
    head = _replace(
        head,
        "<title>Drake MeshCat</title>",
        f"<title>{escape(title)}</title>\n  {viewport}",
    )
    head = _replace(head, "<body>", f"<body>\n{body}")
    module = f'<script type="module">{script}</script>'
    rest = _replace(rest, "</body>", f"{module}\n</body>")
    return head + _QUEUE + rest


def save_meshcat_page(
    meshcat: Meshcat, path: Path | str, title: str = "Meshcat"
) -> None:
    """Saves a Meshcat scene as a web page that opens without a server.

    Args:
        meshcat: the server with the scene.
        path: HTML file to write.
        title: title of the page, plain text.

    Raises:
        InputError: the page cannot be written.

    Example:
        from cns_drake import save_meshcat_page

        save_meshcat_page(meshcat, "scene.html")
    """
    write_text(Path(path), make_static_page(meshcat, title))


def filter_rows(data: bytes) -> bytes:
    """Returns bytes rearranged so that they compress well.

    The bytes are taken as rows of equal length; the last row is padded with
    zeros. Each byte is replaced by its difference from the byte above. The
    result contains the first bytes of all rows, then the second bytes, and so
    on.
    """
    padded = np.frombuffer(data + bytes(-len(data) % _ROW), np.uint8)
    rows = padded.reshape(-1, _ROW)
    difference = np.diff(rows, axis=0, prepend=np.zeros((1, _ROW), np.uint8))
    return difference.T.tobytes()


def _compressed(command: re.Match) -> str:
    raw = base64.b64decode(command[1])
    plain, filtered = (
        base64.b64encode(zlib.compress(data, _LEVEL)).decode()
        for data in (raw, filter_rows(raw))
    )
    if len(filtered) < len(plain):
        return f'    enqueue("{filtered}", {len(raw)});'
    return f'    enqueue("{plain}");'


def _replace(html: str, old: str, new: str) -> str:
    if html.count(old) != 1:
        raise RuntimeError(f"Drake's Meshcat page must have exactly one {old}")
    return html.replace(old, new)
