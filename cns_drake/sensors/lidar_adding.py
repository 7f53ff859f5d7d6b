"""Adding a LiDAR to a diagram, without pydantic for one's own patterns."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
import math
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, TypeVar
import warnings

import numpy as np
from pydrake import geometry
from pydrake.geometry import FrameId, GeometryId, Rgba, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, RigidBody, WeldJoint
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LinearSystem

from cns_drake.scene import anchored_frames as find_anchored_frames
from cns_drake.scene import geometry_port
from cns_drake.sensors.carriers import (
    body_and_pose,
    check_in_diagram,
    check_new_sensor,
    check_unused_names,
    find_motion,
)
from cns_drake.sensors.lidar.beams import BeamPattern
from cns_drake.sensors.lidar.lidar import Lidar
from cns_drake.sensors.lidar.measurement import IDEAL, MeasurementModel
from cns_drake.sensors.lidar.seen_geometry import Place, Structures
from evaluation.base import check_type, of_type

if TYPE_CHECKING:
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns

_VIEW_COLOR = Rgba(0.9, 0.2, 0.1, 1.0)
# Ending of the name of the system that chooses a LiDAR's random numbers.
_DRAW = "noise_draw"
# The port of a plant and a LiDAR with the velocities of bodies.
_VELOCITIES = "body_spatial_velocities"
# Period of a system that never changes its state [s].
_NEVER = 1e9


def add_lidar(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    body: RigidBody | Frame | FrameId,
    X_PB: RigidTransform,
    pattern: BeamPattern | str | Path,
    *,
    name: str = "lidar",
    rate: float | None = None,
    capture_offset: float = 0.0,
    output_delay: float = 0.0,
    causal: bool = False,
    motion_distortion: bool = False,
    motion: System | None = None,
    moving_bodies: Mapping[FrameId, int] | None = None,
    range_noise: float = 0.0,
    dropout: float = 0.0,
    seed: int = 0,
    measurement: MeasurementModel | None = None,
    returns: CalibratedReturns | str | None = "ideal",
    role: Role = Role.kPerception,
    unseen: Collection[Place] | None = None,
    structures: Structures | None = None,
    anchored_frames: Collection[FrameId] | None = None,
    num_threads: int = 1,
) -> Lidar:
    """Adds a LiDAR to a diagram and connects it to the SceneGraph.

    If this function fails, nothing was added.

    Args:
        builder: builder of a diagram with `scene_graph`.
        scene_graph: the SceneGraph to scan.
        body: the carrier P: a body of a finalized plant that is registered with
            `scene_graph`, a frame that is fixed on such a body, or a FrameId
            that any other source has registered with `scene_graph`. A frame on
            a body keeps its pose in the model, even if a Context gives the
            frame another pose. Drake's cameras behave in the same way.
        X_PB: pose of the sensor's body B in P, as in Drake's RgbdSensor. The
            frame S of the measurements coincides with B.
        pattern: beams of the LiDAR, the name of a preset, or the file of a data
            sheet. With a name or file, a revolution takes as long as the data
            sheet states, or 1 / `rate` if that is shorter.
        name: name of the system, and of the LiDAR's frame and topics in a
            recording.
        rate: scans per second of a discrete LiDAR, which takes a scan once per
            period and holds it; by default the LiDAR is continuous.
        capture_offset: time of a discrete LiDAR's first periodic scan [s].
        output_delay: time from a scan of a discrete LiDAR to its appearance on
            the ports [s], less than 1 / `rate`.
        causal: whether a scan is the revolution that ends at the time of the
            output; by default the revolution starts at that time.
        motion_distortion: whether the LiDAR and all other bodies of its plant
            keep moving during a revolution (see `Lidar`). Bodies of other
            plants and frames of other sources stay where they are at the time
            of the output.
        motion: source of the bodies' velocities for motion distortion; by
            default the plant.
        moving_bodies: frame -> index of its body in the LiDAR's port
            `body_spatial_velocities`, which you then connect yourself. With
            `motion_distortion` alone, this function connects the port, for all
            bodies of the plant.
        range_noise: standard deviation of the Gaussian errors of ranges [m]; 0
            for calibrated returns, which have range errors of their own.
        dropout: probability that a return is lost; 0 for calibrated returns.
        seed: seed of noise, dropout and returns that are `calibrated`. Random
            numbers depend on the seed, the name and the number of the frame,
            and differ after each `SetRandomContext` of the Diagram. A
            model of noise or returns with a `sensor_name` uses the
            `sensor_name` instead of the name.
        measurement: model of noise, losses and rounding, instead of
            `range_noise`, `dropout` and `seed`.
        returns: `ideal` (or None), `calibrated` by the data sheet of a preset,
            or a `CalibratedReturns`.
        role: role of the geometry that the LiDAR sees.
        unseen: bodies, frames and geometries that the LiDAR does not see; by
            default its body and all bodies that are welded to it, except the
            world. A FrameId stands only for its own geometry.
        structures: table of labels and instance ids; see `GeometryView`.
        anchored_frames: frames that never move; by default those of the plant's
            bodies that are welded to the world.
        num_threads: number of threads that share the rays.

    Returns:
        The system, with the ports `scan`, `point_cloud_S`, `point_cloud_W`,
        `X_WS` and `scan_time`, and the methods `EvalGeometryIds`,
        `EvalInstances` and `CastRays` of a Context.

    Raises:
        RuntimeError: the plant is not finalized, or not registered with the
            SceneGraph; or the SceneGraph, or the source of the motion, is not
            in the diagram.
        TypeError: an argument is of the wrong type, or unknown.
        ValueError: there is no preset of that name, the name of the LiDAR is
            taken or empty, the noise is out of range or given twice, motion
            distortion needs a body, calibrated returns need a preset or a data
            sheet, or another argument is out of range.
        InputError: the file cannot be read, or is no data sheet.

    Warns:
        UserWarning: the SceneGraph has no geometry that the LiDAR could see, or
            at this `rate` a revolution has fewer beams than in the data sheet.

    Example:
        from cns_drake import add_lidar

        lidar = add_lidar(builder, scene_graph, body, X_PB, "os1-64", rate=10)
        builder.ExportOutput(lidar.GetOutputPort("scan"), "scan")
    """
    if not isinstance(scene_graph, SceneGraph):
        raise TypeError(
            f"scene_graph: {type(scene_graph).__name__} is not a SceneGraph; "
            "AddMultibodyPlantSceneGraph returns one beside the plant"
        )
    check_in_diagram(builder, scene_graph, "scene_graph")
    check_type("X_PB", X_PB, RigidTransform)
    check_new_sensor(builder, name, parts=(_DRAW,))
    if not isinstance(body, FrameId):
        body, X_PB = body_and_pose(body, X_PB)
    unit = pattern if isinstance(pattern, str | Path) else None
    if unit is not None:
        # Imported here: patterns of the caller's own need no data sheets.
        from cns_drake.sensors.lidar_config import (
            make_beam_pattern,
            revolution_at_rate,
        )

        pattern = make_beam_pattern(unit, revolution_at_rate(unit, rate))
    if not isinstance(pattern, BeamPattern):
        raise TypeError(
            f"pattern: {pattern!r} is neither a BeamPattern nor the name of a "
            "preset or a file"
        )
    model = _returns_model(returns, unit, seed, name)
    if model is not None and unit is not None:
        from cns_drake.sensors.lidar_config import aimed

        pattern = aimed(pattern, model.sheet)
    check_type("measurement", measurement, MeasurementModel, NoneType)
    noise = MeasurementModel(
        range_noise=range_noise, dropout=dropout, seed=seed
    )
    measurement = _noise_model(
        measurement, noise, is_calibrated=model is not None
    )
    for argument, places in (
        ("body", [body]),
        ("unseen", unseen),
        ("anchored_frames", anchored_frames),
        ("moving_bodies", moving_bodies),
    ):
        for place in places if isinstance(places, Collection) else ():
            _check_place(argument, place, scene_graph)
    velocities: list[OutputPort] = []
    if isinstance(body, RigidBody):
        plant = body.GetParentPlant()
        frame_id = plant.GetBodyFrameIdOrThrow(body.index())
        if unseen is None:
            unseen = _welded_to(body)
        if anchored_frames is None:
            anchored_frames = find_anchored_frames(plant)
        if motion_distortion:
            moving_bodies = _body_frames(plant)
            velocities = find_motion(builder, motion, body, _VELOCITIES)
    else:
        frame_id = body
        if motion_distortion:
            raise ValueError(
                "motion distortion needs a body of a plant, which has its "
                "velocity; a frame of another source does not"
            )
    lidar = Lidar(
        frame_id,
        X_PB,
        pattern,
        measurement=_with_name(measurement, name),
        returns=model,
        causal=causal,
        rate=rate,
        capture_offset=capture_offset,
        output_delay=output_delay,
        moving_bodies=moving_bodies,
        role=role,
        unseen=unseen,
        structures=structures,
        anchored_frames=() if anchored_frames is None else anchored_frames,
        num_threads=num_threads,
    )
    # Adds a port to a SceneGraph, or fails.
    geometry_port(scene_graph, lidar.role)
    _warn_of_no_geometry(scene_graph, lidar.role)
    systems = [builder.AddNamedSystem(name, lidar)]
    connect_lidar(builder, scene_graph, lidar)
    if lidar.is_random:
        draw = builder.AddNamedSystem(f"{name}_{_DRAW}", _make_noise_draw())
        systems.append(draw)
        builder.Connect(
            draw.get_output_port(), lidar.GetInputPort("noise_draw")
        )
    try:
        for port in velocities:
            builder.Connect(port, lidar.GetInputPort(_VELOCITIES))
    except RuntimeError:  # A port of the caller's system has another type.
        for system in systems:
            builder.RemoveSystem(system)
        raise
    return lidar


def _make_noise_draw() -> LinearSystem:
    """Returns a system whose output is 0, or random by `SetRandomContext`.

    Drake lets no system that is written in Python take part in
    `SetRandomContext`.
    """
    constant = LinearSystem(
        A=np.eye(1),
        B=np.zeros((1, 0)),
        C=np.eye(1),
        D=np.zeros((1, 0)),
        time_period=_NEVER,
    )
    constant.configure_random_state(np.eye(1))
    return constant


def add_lidar_view(
    builder: DiagramBuilder,
    lidar: Lidar,
    meshcat: geometry.Meshcat,
    *,
    period: float | None = None,
    point_size: float = 0.05,
) -> geometry.MeshcatPointCloudVisualizer:
    """Adds a live view of a LiDAR's scans in Meshcat to a diagram.

    Points are shown in the world frame. The path of the points in Meshcat is
    the LiDAR's name.

    Args:
        builder: builder of a diagram with the LiDAR.
        lidar: the LiDAR.
        meshcat: server that shows the points.
        period: time between two shown scans [s]; by default that between two
            scans of a discrete LiDAR, or the duration of a revolution.
        point_size: size of a point [m].

    Raises:
        TypeError: an argument is of another type.
        ValueError: the LiDAR has a view already, or the period is negative.

    Example:
        from cns_drake import add_lidar_view

        add_lidar_view(builder, lidar, meshcat)
    """
    check_type("lidar", lidar, Lidar)
    check_type("meshcat", meshcat, geometry.Meshcat)
    name = lidar.get_name()
    check_unused_names(builder, f"{name}_view")
    if period is None:
        period = (lidar.samples or lidar.pattern).period
    if not 0.0 <= of_type(period, float, "period") < math.inf:
        # Drake would end the process.
        raise ValueError(f"period: {period!r} is not a time from 0 s on")
    of_type(point_size, float, "point_size")
    view = builder.AddNamedSystem(
        f"{name}_view",
        geometry.MeshcatPointCloudVisualizer(meshcat, name, period),
    )
    view.set_default_rgba(_VIEW_COLOR)
    view.set_point_size(point_size)
    builder.Connect(lidar.positions_W_output_port(), view.cloud_input_port())
    return view


def connect_lidar(
    builder: DiagramBuilder, scene_graph: SceneGraph, lidar: Lidar
) -> None:
    """Connects a LiDAR's inputs to a SceneGraph."""
    query = scene_graph.get_query_output_port()
    builder.Connect(query, lidar.query_object_input_port())
    listed = geometry_port(scene_graph, lidar.role)
    builder.Connect(listed, lidar.GetInputPort("geometry"))


def _returns_model(
    returns: CalibratedReturns | str | None,
    unit: str | Path | None,
    seed: int,
    name: str,
) -> CalibratedReturns | None:
    """Returns the model of calibrated returns, None for ideal returns.

    The arguments are the same as for `add_lidar`; `unit` is None for a pattern
    that is given by neither the name of a preset nor a file.

    Raises:
        ValueError: calibrated returns need a preset, or the seed is given
            twice.
    """
    if returns is None or returns == "ideal":
        return None
    from cns_drake.sensors.returns.calibrated import CalibratedReturns

    if returns == "calibrated" and unit is not None:
        return CalibratedReturns.of_preset(unit, seed=seed, sensor_name=name)
    if not isinstance(returns, CalibratedReturns):
        raise ValueError(
            f"returns: {returns!r}: give 'ideal', 'calibrated' with the "
            "name of a preset as pattern, or CalibratedReturns"
        )
    if seed:
        raise ValueError("seed: CalibratedReturns has its own; leave it out")
    return _with_name(returns, name)


def _noise_model(
    given: MeasurementModel | None,
    noise: MeasurementModel,
    *,
    is_calibrated: bool,
) -> MeasurementModel:
    """Returns the model of noise, losses and rounding beside the returns.

    Args:
        given: argument `measurement` of `add_lidar`.
        noise: model with the arguments `range_noise`, `dropout` and `seed`.
        is_calibrated: whether the returns have noise of their own.

    Raises:
        ValueError: the noise is given twice.
    """
    if is_calibrated:
        if noise.is_random or (given is not None and given.is_random):
            raise ValueError(
                "range_noise, dropout, measurement: calibrated returns have "
                "noise of their own; leave these out"
            )
    elif noise != IDEAL:
        if given is None:
            return noise
        raise ValueError(
            "measurement: give either it or range_noise, dropout and seed"
        )
    return given or IDEAL


_Model = TypeVar("_Model", MeasurementModel, "CalibratedReturns")


def _with_name(model: _Model, name: str) -> _Model:
    """Returns a model with the LiDAR's name, unless the model has a name."""
    return model if model.sensor_name else replace(model, sensor_name=name)


def _check_place(argument: str, place: object, scene_graph: SceneGraph) -> None:
    """Checks that a body, frame or geometry belongs to a SceneGraph.

    Raises:
        RuntimeError: it does not.
    """
    if isinstance(place, RigidBody | Frame):
        _check_registered(argument, place.GetParentPlant(), scene_graph)
    elif isinstance(place, FrameId | GeometryId):
        try:
            scene_graph.model_inspector().GetName(place)
        except RuntimeError:
            raise RuntimeError(
                f"{argument}: this SceneGraph has no {type(place).__name__} "
                f"{place.get_value()}"
            ) from None


def _check_registered(
    argument: str, plant: MultibodyPlant, scene_graph: SceneGraph
) -> None:
    """Checks that a plant is registered with a SceneGraph.

    Raises:
        RuntimeError: the plant is not registered with this SceneGraph.
    """
    source = plant.get_source_id()
    inspector = scene_graph.model_inspector()
    if source is None or not inspector.SourceIsRegistered(source):
        raise RuntimeError(
            f"{argument}: its plant is not registered with this SceneGraph; "
            "make both by AddMultibodyPlantSceneGraph, or call "
            "plant.RegisterAsSourceForSceneGraph(scene_graph)"
        )


def _warn_of_no_geometry(scene_graph: SceneGraph, role: Role) -> None:
    """Warns the caller of `add_lidar` if the LiDAR has nothing to see."""
    if scene_graph.model_inspector().NumGeometriesWithRole(role) == 0:
        warnings.warn(
            f"the SceneGraph holds no geometry of {role}: so far the LiDAR "
            "has nothing to see. RegisterVisualGeometry of a plant gives the "
            "perception role.",
            stacklevel=3,
        )


def _body_frames(plant: MultibodyPlant) -> dict[FrameId, int]:
    """Returns the index of each body with a SceneGraph frame, by this frame."""
    frames = map(
        plant.GetBodyFrameIdIfExists,
        map(BodyIndex, range(plant.num_bodies())),
    )
    return {frame: k for k, frame in enumerate(frames) if frame is not None}


def _welded_to(body: RigidBody) -> list[RigidBody]:
    """Returns a body and all bodies that are welded to it.

    Bodies that are connected only through the world do not count.
    """
    plant = body.GetParentPlant()
    world = plant.world_body().index()
    neighbours: dict[int, list[RigidBody]] = {}
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if isinstance(joint, WeldJoint):
            ends = joint.parent_body(), joint.child_body()
            for end, other in (ends, ends[::-1]):
                neighbours.setdefault(int(end.index()), []).append(other)
    welded: dict[int, RigidBody] = {}
    rest = [] if body.index() == world else [body]
    while rest:
        nearest = rest.pop()
        if int(nearest.index()) in welded or nearest.index() == world:
            continue
        welded[int(nearest.index())] = nearest
        rest += neighbours.get(int(nearest.index()), [])
    return list(welded.values())
