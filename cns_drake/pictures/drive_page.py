"""A drive through a city as one web page that opens without a server."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
import contextlib
from dataclasses import dataclass, field
import logging

import numpy as np
from pydrake.geometry import (
    FrameId,
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    Rgba,
    Role,
)
from pydrake.math import RigidTransform

from cns_drake.pictures.meshcat_drawing import (
    draw_body,
    draw_marker,
    draw_points,
    draw_route,
    draw_structures,
    set_view,
)
from cns_drake.pictures.static_page import make_static_page
from cns_drake.scene.perception_geometry import (
    PerceptionGeometry,
    read_perception_geometry,
)
from cns_drake.scene.world import World

_ABSENT = "/stage_difference/absent"
_ADDITIONAL = "/stage_difference/additional"
_ABSENT_RGBA = Rgba(0.85, 0.05, 0.15, 0.5)
_ADDITIONAL_RGBA = Rgba(0.10, 0.60, 0.65)

# How far above the vehicle's origin the arrow's tip is [m].
_MARKER_ALTITUDE = 3.0


@dataclass(frozen=True)
class Drive:
    """What happened during a drive.

    Attributes:
        period: time between frames [s].
        X_WBs: pose of the vehicle at each frame.
        X_WFs: for each moving geometry frame F, its pose at each frame.
        scans: frame index and (N, 3) positions in the world [m] of the
            scans to show.
    """

    period: float
    X_WBs: list[RigidTransform] = field(default_factory=list)
    X_WFs: dict[FrameId, list[RigidTransform]] = field(default_factory=dict)
    scans: list[tuple[int, np.ndarray]] = field(default_factory=list)


def make_drive_page(
    drive: Drive,
    world: World,
    *,
    other_stage: World | None = None,
    title: str = "cns-drake",
) -> str:
    """Returns a page with the city, the drive and its scans.

    The layers of the page, each to be switched in its Scene panel and on
    when it opens:

    - `/city/<class>`: the structures of the stage, coloured by class,
    - `/vehicle/<body>`, `/moving/<body>`: what moves, as it moved,
    - `/route`: a ribbon from red (start) to blue (end),
    - `/scans/<k>`: LiDAR points coloured by height, as soon as measured,
    - `/stage_difference/absent/<class>`: what the other stage has and this
      one lacks, translucent red,
    - `/stage_difference/additional/<class>`: what this stage has and the
      other one lacks; teal, and not in `/city` as well.

    Args:
        drive: what happened.
        world: the stage, with the vehicle.
        other_stage: the stage to show the difference to.
        title: of the page.
    """
    with _quiet():
        meshcat = Meshcat(MeshcatParams(host="localhost", port=0))
    _draw_city(meshcat, world, other_stage)
    if len(drive.X_WBs) > 1:
        draw_route(meshcat, "/route", drive.X_WBs)
    _animate(meshcat, drive, world)
    p_WBset = np.array([X_WB.translation() for X_WB in drive.X_WBs])
    set_view(meshcat, p_WBset.min(axis=0), p_WBset.max(axis=0))
    return make_static_page(meshcat, title)


def moving_frames(world: World) -> tuple[FrameId, ...]:
    """Returns the frames with visible geometry that may move."""
    inspector = world.scene_graph.model_inspector()
    frames = (
        inspector.GetFrameId(geometry_id)
        for geometry_id in inspector.GetAllGeometryIds(Role.kPerception)
    )
    anchored = world.anchored_frames()
    return tuple(f for f in dict.fromkeys(frames) if f not in anchored)


def _draw_city(
    meshcat: Meshcat, world: World, other_stage: World | None
) -> None:
    """Draws what stands still, and how that differs from another stage."""
    own = _by_structure(world)
    other = own if other_stage is None else _by_structure(other_stage)
    common = own.keys() & other.keys()
    more, less = own.keys() - common, other.keys() - common
    _draw_layer(meshcat, "/city", world, own, common)
    _draw_layer(meshcat, _ADDITIONAL, world, own, more, _ADDITIONAL_RGBA)
    if other_stage is not None:
        _draw_layer(meshcat, _ABSENT, other_stage, other, less, _ABSENT_RGBA)


def _draw_layer(
    meshcat: Meshcat,
    path: str,
    stage: World,
    by_structure: Mapping[str, Sequence[PerceptionGeometry]],
    names: Set[str],
    rgba: Rgba | None = None,
) -> None:
    if names:
        draw_structures(
            meshcat,
            path,
            [
                geometry
                for name, group in by_structure.items()
                if name in names
                for geometry in group
            ],
            _anchored_poses(stage),
            stage.structures.completed(names),
            rgba,
        )


def _animate(meshcat: Meshcat, drive: Drive, world: World) -> None:
    """Draws what moves and the scans, and plays them over the drive."""
    animation = MeshcatAnimation(frames_per_second=1.0 / drive.period)
    inspector = world.scene_graph.model_inspector()
    for path, frame_id in _moving_paths(world, drive.X_WFs).items():
        draw_body(
            meshcat,
            path,
            read_perception_geometry(inspector, frame_id.__eq__),
        )
        _move(meshcat, animation, path, drive.X_WFs[frame_id])
    draw_marker(meshcat, "/vehicle/marker")
    X_BM = RigidTransform([0.0, 0.0, _MARKER_ALTITUDE])
    X_WMs = [X_WB @ X_BM for X_WB in drive.X_WBs]
    _move(meshcat, animation, "/vehicle/marker", X_WMs)
    for k, (frame, p_WRset) in enumerate(drive.scans):
        path = f"/scans/{k:03d}"
        draw_points(meshcat, path, p_WRset)
        if frame > 0:
            animation.SetProperty(0, path, "visible", False)
            animation.SetProperty(frame, path, "visible", True)
    animation.set_autoplay(True)
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopOnce)
    animation.set_clamp_when_finished(True)
    meshcat.SetAnimation(animation)


def _move(
    meshcat: Meshcat,
    animation: MeshcatAnimation,
    path: str,
    X_WFs: Sequence[RigidTransform],
) -> None:
    meshcat.SetTransform(path, X_WFs[0])
    for frame, X_WF in enumerate(X_WFs):
        animation.SetTransform(frame, path, X_WF)


def _moving_paths(
    world: World, frame_ids: Iterable[FrameId]
) -> dict[str, FrameId]:
    """Returns the layer of each moving frame."""
    paths = {}
    for frame_id in frame_ids:
        body = world.plant.GetBodyFromFrameId(frame_id)
        path = f"/moving/{body.scoped_name()}".replace("::", "/")
        if body.model_instance() == world.vehicle:
            path = f"/vehicle/{body.name()}"
        paths[path] = frame_id
    return paths


def _by_structure(world: World) -> dict[str, list[PerceptionGeometry]]:
    """Returns what never moves, by the structure that it belongs to."""
    by_structure: dict[str, list[PerceptionGeometry]] = {}
    for geometry in read_perception_geometry(
        world.scene_graph.model_inspector(),
        world.anchored_frames().__contains__,
    ):
        by_structure.setdefault(geometry.structure, []).append(geometry)
    return by_structure


def _anchored_poses(world: World) -> Callable[[FrameId], RigidTransform]:
    plant = world.plant
    context = plant.CreateDefaultContext()

    def calc_X_WF(frame_id: FrameId) -> RigidTransform:
        body = plant.GetBodyFromFrameId(frame_id)
        return plant.EvalBodyPoseInWorld(context, body)

    return calc_X_WF


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps Drake from announcing a port that nobody shall open."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)
