"""A single scan of any SDF world from any pose."""

from collections.abc import Callable, Iterable
import io
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import World, load_world
from cns_drake.sensors import (
    BeamPattern,
    Lidar,
    LidarSection,
    WeatherConfig,
    connect_lidar,
    make_lidar_model,
)
from evaluation.base import (
    InputError,
    check_writable,
    completing,
    doing,
    encode_bin,
    encode_pcd,
    make_folder,
)


def scan(
    world: Path | str,
    X_WS: RigidTransform,
    lidar: LidarSection | None = None,
    *,
    weather: WeatherConfig | None = None,
    seed: int = 0,
    model_paths: Iterable[Path] = (),
    output: Path | str | None = None,
    on_note: Callable[[str], None] = lambda note: None,
) -> np.ndarray:
    """Takes one LiDAR scan of an SDF world, as `cns-drake scan`.

    Args:
        world: SDF file.
        X_WS: pose of the LiDAR in the world.
        lidar: the LiDAR; its mounting pose has no effect. By default the preset
            `cns`, whose coordinates are not rounded.
        weather: weather of calibrated returns; by default clear.
        seed: seed of the random numbers.
        model_paths: folders with the world's model:// files.
        output: file for the scan, see `save_scan`; by default none is written.
        on_note: called with notes about how the world was read.

    Returns:
        Structured array (N,) of `POINT_DTYPE`, in the LiDAR's frame S.

    Raises:
        InputError: the world cannot be read, or the file cannot be written.
        ValueError: the pose is not finite.

    Example:
        from pydrake.math import RigidTransform

        from cns_drake import scan

        points = scan("hall.sdf", RigidTransform([0.0, 0.0, 1.6]))
    """
    if output is not None:
        output = Path(output)
        check_ending(output)
        check_writable(output)
    world = Path(world)
    doing(f"reading {world.name}")
    loaded = load_world(world, model_paths=list(model_paths))
    for text in loaded.notes:
        on_note(text)
    lidar = lidar or LidarSection(resolution=0.0)
    model = make_lidar_model(lidar, "lidar", seed, weather)
    doing("casting rays")
    points = scan_world(loaded, X_WS, **model._asdict())
    if output is not None:
        save_scan(points, output)
    return points


def scan_world(
    world: World,
    X_WS: RigidTransform,
    pattern: BeamPattern,
    **options: Any,
) -> np.ndarray:
    """Returns one LiDAR scan of a world in its initial state.

    Args:
        world: the world.
        X_WS: pose of the LiDAR in the world.
        pattern: directions and ranges of the LiDAR's beams.
        options: further arguments of `Lidar`.

    Returns:
        Structured array (N,) of `POINT_DTYPE`, in the LiDAR's frame S.
    """
    lidar, context = _stationary_lidar(world, X_WS, pattern, **options)
    return lidar.GetOutputPort("scan").Eval(context)


def still_scene(
    world: World, X_WS: RigidTransform, pattern: BeamPattern
) -> RayCastingScene:
    """Returns a scene for ray casting: a world in its initial state.

    Args:
        world: the world.
        X_WS: pose in the world near which rays will start. Rays must start
            within a few kilometres of this pose.
        pattern: directions and ranges of a LiDAR's beams.
    """
    lidar, context = _stationary_lidar(world, X_WS, pattern)
    return lidar.EvalScene(context)


def _stationary_lidar(
    world: World,
    X_WS: RigidTransform,
    pattern: BeamPattern,
    **options: Any,
) -> tuple[Lidar, Context]:
    """Returns a LiDAR at a fixed pose in a world, and its Context."""
    if not np.isfinite(X_WS.GetAsMatrix34()).all():
        raise ValueError("X_WS: not finite")
    lidar = Lidar(
        world.scene_graph.world_frame_id(),
        X_WS,
        pattern,
        structures=world.structures,
        anchored_frames=world.anchored_frames(),
        **options,
    )
    plant = world.plant
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", world.scene_graph)
    # The models keep their initial state.
    positions = plant.GetPositions(plant.CreateDefaultContext())
    source = builder.AddNamedSystem("position", ConstantVectorSource(positions))
    to_pose = builder.AddNamedSystem(
        "geometry_pose", MultibodyPositionToGeometryPose(plant)
    )
    builder.AddNamedSystem("lidar", lidar)
    builder.Connect(source.get_output_port(), to_pose.get_input_port())
    builder.Connect(
        to_pose.get_output_port(),
        scene_graph.get_source_pose_port(plant.get_source_id()),
    )
    connect_lidar(builder, scene_graph, lidar)
    context = builder.Build().CreateDefaultContext()
    return lidar, lidar.GetMyContextFromRoot(context)


def check_ending(path: Path) -> None:
    """Checks that `save_scan` knows the format of a file from its ending.

    Raises:
        InputError: the ending is not .pcd, .bin or .npy.
    """
    if path.suffix not in _ENCODERS:
        raise InputError(
            f"{path}: unknown ending '{path.suffix}'; use one of "
            f"{', '.join(_ENCODERS)}"
        )


def save_scan(scan: np.ndarray, path: Path) -> None:
    """Saves x, y, z and intensity of a scan to a file.

    The ending of the file name sets the format: `.bin` is KITTI's format
    (float32 x y z intensity), `.npy` is an array (N, 4) of the same numbers,
    and `.pcd` is a binary PCD file.

    Args:
        scan: structured array (N,) with these four fields.
        path: the file.

    Raises:
        InputError: the file has another ending or cannot be written.
    """
    check_ending(path)
    make_folder(path.parent)
    with completing(path) as part:
        part.write_bytes(_ENCODERS[path.suffix](scan))


def _encode_npy(scan: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.frombuffer(encode_bin(scan), "<f4").reshape(-1, 4))
    return stream.getvalue()


_ENCODERS = {".bin": encode_bin, ".npy": _encode_npy, ".pcd": encode_pcd}
