"""Makes a web page of a drive through a city, which needs no server."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence, Set
import contextlib
from dataclasses import dataclass, field, replace
from importlib import resources
import logging
import math

import numpy as np
from pydrake import geometry
from pydrake.geometry import FrameId, MeshcatParams
from pydrake.math import RigidTransform

from cns_drake.pictures import meshcat_drawing as drawing
from cns_drake.pictures.city_parts import Part, compare_parts, read_parts
from cns_drake.pictures.static_page import make_static_page
from cns_drake.scene.perception_geometry import (
    PerceptionGeometry,
    read_perception_geometry,
)
from cns_drake.scene.world import World

Rgb = tuple[float, float, float]

# Kind of change -> its colour, and its text in the legend.
CHANGE_RGB: dict[str, Rgb] = {
    "absent": (0.86, 0.08, 0.20),
    "lower": (0.96, 0.50, 0.05),
    "additional": (0.60, 0.42, 0.92),
}
_CHANGES = {
    "absent": "not here, but in {other}",
    "lower": "higher in {other}",
    "additional": "not in {other}, or lower there",
}
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
# Greatest number of samples in a plot; more would not be visible.
_MAX_SAMPLES = 400
# Size of a plot in units of its own, which the page stretches.
_PLOT_WIDTH = 400.0
_PLOT_HEIGHT = 20.0
# Unit -> least range of a plot. A smaller one would magnify noise.
_LEAST_RANGE = {"km/h": 10.0, "m/s²": 2.0, "deg/s": 10.0}
# Possible distances of the times on the scale [s].
_TIME_STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800)


@dataclass(frozen=True)
class DriveRecord:
    """The record of a drive of F frames; most lists have one entry per frame.

    Attributes:
        period: time between frames [s].
        X_WBs: poses of the vehicle.
        X_WFs: id of a geometry frame that moves -> its poses.
        scans: the scans to show: index of the frame, and positions (N, 3) of
            the points in W [m].
        speeds: forward speed of the vehicle [m/s].
        specific_forces_I: specific force in the IMU's frame I [m/s^2].
        angular_velocities_I: angular velocity w_WI_I [rad/s].
        num_points: number of points in each scan as measured.
        limbs: the parts of each moving object other than the vehicle: id of the
            object's root frame -> {id of each of its geometry frames: constant
            pose in the root frame}. The root frame is the frame whose poses are
            recorded.
        names: id of an object's root frame -> name of the object in the page.
        images: name of a camera -> the images to show: index of the frame, and
            JPEG.
    """

    period: float
    X_WBs: list[RigidTransform] = field(default_factory=list)
    X_WFs: dict[FrameId, list[RigidTransform]] = field(default_factory=dict)
    scans: list[tuple[int, np.ndarray]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    specific_forces_I: list[np.ndarray] = field(default_factory=list)
    angular_velocities_I: list[np.ndarray] = field(default_factory=list)
    num_points: list[int] = field(default_factory=list)
    limbs: dict[FrameId, dict[FrameId, RigidTransform]] = field(
        default_factory=dict
    )
    names: dict[FrameId, str] = field(default_factory=dict)
    images: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)


@dataclass(frozen=True)
class ShownStages:
    """The stages that the page of a drive shows.

    Attributes:
        other: a stage with which the stage of the drive is compared; None to
            show no differences.
        other_name: name of this other stage.
        stage: name of the stage of the drive; None if the drive has no map.
        stages: names of all stages of the map, the earliest first.
    """

    other: World | None = None
    other_name: str = "the other stage"
    stage: str | None = None
    stages: Sequence[str] = ()


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
        script=_read_template("drive.js"),
    )


def make_panel(
    title: str, drive: DriveRecord, changes: Set[str], shown: ShownStages
) -> str:
    """Returns the HTML of the page's title, switches, legend and plots.

    Args:
        title: title of the page.
        drive: record of the drive.
        changes: kinds of change that the page shows, keys of `CHANGE_RGB`.
        shown: the stages of the city that the page shows.
    """
    # Only pages need templates, and the import takes a moment.
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    length = np.linalg.norm(np.diff(p_WBset, axis=0), axis=1).sum()
    duration = (len(p_WBset) - 1) * drive.period
    minutes, seconds = divmod(round(duration), 60)
    took = f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
    lowest, highest = drawing.POINT_HEIGHTS
    environment = Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.from_string(_read_template("panel.html")).render(
        style=Markup(_read_template("drive.css")),
        title=title,
        facts=f"{length / 1000.0:.2f} km in {took}",
        points=_gradient(drawing.height_rgb(np.linspace(lowest, highest, 9))),
        heights=f"{lowest:g} to {highest:g} m",
        route=_hex(drawing.ROUTE_RGB),
        colours={name: _hex(rgb) for name, rgb in CHANGE_RGB.items()},
        changes={
            name: words.format(other=shown.other_name)
            for name, words in _CHANGES.items()
            if name in changes
        },
        shown_points=_shown_points(drive),
        plots=motion_plots(drive),
        times=_time_scale(duration),
        traffic=bool(drive.names),
        cameras={
            name: [
                (f"{k * drive.period:.2f}", base64.b64encode(jpeg).decode())
                for k, jpeg in images
            ]
            for name, images in drive.images.items()
        },
        stage=shown.stage,
        stages=shown.stages,
    )


@dataclass(frozen=True)
class Plot:
    """A curve over the time of the drive, as the page's template draws it.

    Attributes:
        name: title of the plot.
        unit: unit of the values: `km/h`, `m/s²` or `deg/s`.
        values: values to display as text, at evenly spaced times of the drive.
        points: the points of the curve, in the format of SVG.
        ticks: labels of the scale, and their positions from the top, as shares
            of the height.
    """

    name: str
    unit: str
    values: str
    points: str
    ticks: Sequence[tuple[str, float]]

    @classmethod
    def of(cls, name: str, unit: str, values: np.ndarray) -> Plot:
        """Returns the plot of values over the time of a drive.

        Args:
            name: title of the plot.
            unit: unit of the values: `km/h`, `m/s²` or `deg/s`.
            values: (F,) values, one for each of the drive's F frames, which are
                evenly spaced in time.
        """
        count = min(len(values), _MAX_SAMPLES)
        frames = np.linspace(0, len(values) - 1, count).round().astype(int)
        values = values[frames]
        low, high = min(values.min(), 0.0), max(values.max(), 0.0)
        missing = max(_LEAST_RANGE[unit] - (high - low), 0.0)
        if low < 0.0:  # Zero stays within the plot.
            low -= missing / 2.0
            missing /= 2.0
        high += missing
        x = np.linspace(0.0, _PLOT_WIDTH, count)
        y = _PLOT_HEIGHT * (high - values) / (high - low)
        return cls(
            name,
            unit,
            # Adding 0.0 removes the sign of a negative zero.
            ",".join(f"{value:.1f}" for value in values.round(1) + 0.0),
            " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True)),
            _scale(low, high),
        )


def _scale(low: float, high: float) -> list[tuple[str, float]]:
    """Returns ticks for zero, and for a round value above and below it.

    Values outside of the range are left out. Each tick has its place as a share
    of the height, from the top.
    """
    reach = max(-low, high)
    power = 10.0 ** math.floor(math.log10(reach))
    step = max(k * power for k in (1, 2, 5) if k * power <= reach)
    return [
        (f"{value:g}", (high - value) / (high - low))
        for value in (-step, 0.0, step)
        if low <= value <= high
    ]


def _time_scale(duration: float) -> list[tuple[str, float]]:
    """Returns at most seven round times of a drive, and their shares of it."""
    step = next((s for s in _TIME_STEPS if duration <= 6 * s), 3600)
    return [
        (f"{t // 60}:{t % 60:02d}", t / max(duration, 1.0))
        for t in range(0, int(duration) + 1, step)
    ]


def _shown_points(drive: DriveRecord) -> str:
    """Returns a sentence that says which part of the points the page shows."""
    if not drive.num_points:
        return ""
    most = max(len(p_WRset) for _, p_WRset in drive.scans)
    return (
        f"Shown: {len(drive.scans)} of {len(drive.X_WBs)} scans, up to "
        f"{most:,} of {max(drive.num_points):,} points"
    )


def motion_plots(drive: DriveRecord) -> list[Plot]:
    """Returns the plots of the speed and the IMU.

    A drive with fewer than two frames has no plots.
    """
    if len(drive.speeds) < 2:
        return []
    forces = np.array(drive.specific_forces_I)
    turns = np.rad2deg(drive.angular_velocities_I)
    return [
        Plot.of("Speed", "km/h", 3.6 * np.array(drive.speeds)),
        Plot.of("IMU, forward", "m/s²", forces[:, 0]),
        Plot.of("IMU, left", "m/s²", forces[:, 1]),
        Plot.of("IMU, turn", "deg/s", turns[:, 2]),
    ]


def moving_frames(world: World) -> tuple[FrameId, ...]:
    """Returns the geometry frames of a world that may move.

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
    meshcat: geometry.Meshcat, name: str, parts: Sequence[Part]
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
    for one in read_perception_geometry(inspector, led.__contains__):
        leading, X_FL = led[one.frame_id]
        drawn[leading].append(replace(one, X_FG=X_FL @ one.X_FG))
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
    drawing.draw_marker(meshcat, "/vehicle/marker")
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


def _read_template(name: str) -> str:
    folder = resources.files("cns_drake.pictures") / "page_template"
    return (folder / name).read_text(encoding="utf-8")


def _gradient(colours: Sequence[np.ndarray] | np.ndarray) -> str:
    return f"linear-gradient(90deg, {', '.join(map(_hex, colours))})"


def _hex(rgb: Rgb | np.ndarray) -> str:
    return "#" + "".join(f"{round(255.0 * value):02x}" for value in rgb)
