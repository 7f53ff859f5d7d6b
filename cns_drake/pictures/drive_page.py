"""Makes a web page of a drive through a city; the page needs no server."""

import base64
from collections.abc import Iterator, Mapping, Sequence
import contextlib
from dataclasses import replace
from html import escape, unescape
import logging
from pathlib import Path
import re
from typing import NamedTuple
import zlib

import numpy as np
from pydrake import geometry
from pydrake.geometry import FrameId, Meshcat, MeshcatParams
from pydrake.math import RigidTransform

from cns_drake.pictures import meshcat_drawing as drawing
from cns_drake.pictures.city_parts import (
    ColouredPart,
    compare_parts,
    greatest_changes,
)
from cns_drake.pictures.drive_record import DriveRecord, ScanRecord
from cns_drake.pictures.page_panel import (
    ShownStages,
    fill_template,
    make_panel,
    read_template,
)
from cns_drake.scene import PerceptionGeometry, World, read_perception_geometry
from evaluation.base import InputError, read_text, write_text

Parts = Mapping[str, Sequence[ColouredPart]]

# Greatest size of a page [bytes].
_MOST_BYTES = 20_000_000
# Traffic gets a pose only every so many frames, which keeps pages small. In the
# tightest turns at 10 m/s, the error between these frames is 0.1 m.
_TRAFFIC_INTERVAL = 5
# Number of changes that can be jumped to.
_MOST_CHANGES = 5


def make_drive_page(
    drive: DriveRecord,
    world: World,
    parts: tuple[Parts, Parts],
    shown: ShownStages,
    title: str,
) -> str:
    """Returns the HTML of a page with the city, the drive and its scans.

    The page has layers, which can be switched on and off:

    - `/city/<class>`: the structures that both stages have, in their own
      colours,
    - `/before/<class>`, `/after/<class>`: what only the earlier or only the
      later of two stages has: whole structures, and the upper parts of
      structures that are higher in one of them,
    - `/vehicle/<body>`, `/moving/<body>`: the moving bodies,
    - `/route`: a ribbon along the route,
    - `/scans`: the LiDAR points of the last three seconds, coloured by height,
      intensity, class or change.

    The page has every point of the scans that it has. If not all scans fit,
    they are evenly spaced, and the page says so. A scan is decoded when the
    play head comes near.

    The page opens at the first of the greatest changes beside the route, and
    has buttons that jump to these. A divider across the picture has the earlier
    stage on its left, where what will be gone is outlined in violet, and the
    later stage on its right, where what is new is outlined in red.

    The camera is behind and above the car. It rises where a building would hide
    the car, and sees the car through whatever else is in between. Panels show
    the title, the sensors, the switches, which are also the legend, the images
    of cameras, and plots of the speed and the IMU. On a phone, the panels are
    one sheet.

    Args:
        drive: what is shown of the drive.
        world: world of the stage.
        parts: the structures of the stage, and those of the other stage, as
            `read_parts` returns them.
        shown: the stage, and the other stage with which it is compared, if any.
        title: title of the page.
    """
    with _without_port_message():
        meshcat = geometry.Meshcat(MeshcatParams(host="127.0.0.1", port=0))
    sides = _draw_city(meshcat, parts, shown)
    if len(drive.X_WBs) > 1:
        drawing.draw_route(meshcat, "/route", drive.X_WBs)
    _animate(meshcat, drive, world)
    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    changes = greatest_changes(*parts, p_WBset, _MOST_CHANGES)
    drawing.set_view(meshcat, p_WBset.min(axis=0), p_WBset.max(axis=0))
    start, scene, end = _static_parts(meshcat, title)
    module = f'<script type="module">{read_template("drive.js")}</script>'

    def panel(scans: ScanRecord) -> str:
        return make_panel(
            title, replace(drive, scans=scans), sides, changes, shown
        )

    rest = start, panel(drive.scans), scene, module, end
    free = _MOST_BYTES - sum(map(len, rest))
    # Base64 has four bytes for three.
    scans = drive.scans.within(3 * free // 4)
    elements = (
        f'<script type="text/plain" class="scan"'
        f' data-time="{scan.frame * drive.period:.3f}"'
        f' data-origin="{scan.origin[0]},{scan.origin[1]},{scan.origin[2]}"'
        f' data-grid="{scan.grid:g}">'
        f"{base64.b64encode(scan.data).decode()}</script>\n"
        for scan in scans.scans
    )
    return "".join([start, panel(scans), scene, *elements, module, end])


class OtherPage(NamedTuple):
    """The page of another drive in the same city.

    Attributes:
        title: its title.
        html: its text.
    """

    title: str
    html: str


def read_drive_page(path: Path, city: str) -> OtherPage:
    """Reads the page of a drive through a city.

    Args:
        path: the file.
        city: name of the city's map, or of the world's file.

    Raises:
        InputError: the file is not the page of a drive through this city.
    """
    html = read_text(path)
    title = re.search(r"<h1>(.*?)</h1>", html)
    there = re.search(r'<header class="panel" data-city="(.*?)">', html)
    if title is None or there is None:
        raise InputError(f"{path}: not the page of a drive")
    if unescape(there[1]) != city:
        raise InputError(
            f"{path}: a drive through {unescape(there[1])}, not {city}"
        )
    return OtherPage(unescape(title[1]), html)


def make_pair_page(first: OtherPage, second: OtherPage) -> str:
    """Returns a page of two drives side by side, each at the other's place."""
    return fill_template(
        "pair.html",
        titles=(first.title, second.title),
        pages=[
            base64.b64encode(zlib.compress(one.html.encode(), 1)).decode()
            for one in (first, second)
        ],
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
    meshcat: geometry.Meshcat, parts: tuple[Parts, Parts], shown: ShownStages
) -> set[str]:
    """Draws static structures; returns which of `before`, `after` exist."""
    difference = compare_parts(*parts)
    drawing.draw_parts(meshcat, "/city", difference.common)
    drawn = set()
    for here, changed in (
        (True, difference.additional),
        (False, difference.missing),
    ):
        if changed:
            name = "before" if here != shown.is_earlier else "after"
            drawn.add(name)
            drawing.draw_parts(meshcat, f"/{name}", changed)
            meshcat.SetProperty(f"/{name}", "visible", here)
    return drawn


def _animate(
    meshcat: geometry.Meshcat, drive: DriveRecord, world: World
) -> None:
    """Draws moving bodies, and animates them over the drive."""
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
    # The script of the page lets it wait until there are points.
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


def _static_parts(meshcat: Meshcat, title: str) -> tuple[str, str, str]:
    """Returns the start of the page of a scene, the scene, and the end.

    The page is Drake's page with compressed commands, so that a city takes a
    third of the space. Browsers have been able to decompress such commands
    since 2023. The title is plain text.

    HTML between the start and the scene is visible while the scene loads. A
    JavaScript module between the scene and the end runs when the page is ready.
    In this module, `commands` is a JavaScript promise of the scene's commands.
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
    start, library = _split(
        _replace(
            head,
            "<title>Drake MeshCat</title>",
            f"<title>{escape(title)}</title>\n  {viewport}",
        ),
        "<body>",
    )
    scene, end = _split(rest, "</body>")
    return f"{start}<body>\n", library + _QUEUE + scene, f"\n</body>{end}"


def save_meshcat_page(meshcat: Meshcat, path: Path | str) -> None:
    """Saves a Meshcat scene as a web page that opens without a server.

    Args:
        meshcat: the server with the scene.
        path: HTML file to write.

    Raises:
        InputError: the page cannot be written.

    Example:
        from cns_drake import save_meshcat_page

        save_meshcat_page(meshcat, "scene.html")
    """
    write_text(Path(path), "".join(_static_parts(meshcat, "Meshcat")))


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
    return new.join(_split(html, old))


def _split(html: str, mark: str) -> tuple[str, str]:
    if html.count(mark) != 1:
        raise RuntimeError(f"Drake's Meshcat page must have exactly one {mark}")
    before, _, after = html.partition(mark)
    return before, after
