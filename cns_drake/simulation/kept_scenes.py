"""Ray scenes that a process builds for the processes that are forked from it.

Several drives of a study see the same stage, and building its ray scene takes a
second. A forked process has what was built before, in memory that the processes
share. Embree builds in the calling thread alone: a forked process would lack
other threads.
"""

from __future__ import annotations

from pydrake.geometry import FrameId, Role, SourceId
from pydrake.math import RigidTransform

from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scene.parsed_world import ParsedWorld
from cns_drake.scene.perception_geometry import GeometryReader
from cns_drake.scene.world import World, anchored_frames
from cns_drake.sensors.seen_geometry import BuiltScene

# Greatest number of scenes that a process keeps. The scene of a shipped stage
# takes some 200 MB, and a city has four.
_MOST_KEPT = 4

# A source names the geometry of one parsed world and of no other.
_kept: dict[SourceId, BuiltScene] = {}


def keep_scene(world: ParsedWorld) -> None:
    """Builds the ray scene of a kept world, for the next `take_scene`.

    It does so only if nothing in the world can move.

    Args:
        world: see `kept_worlds.keep_world`; its plant is finalized.

    Raises:
        InputError: a geometry cannot be read.
    """
    plant, inspector = world.plant, world.scene_graph.model_inspector()
    source = plant.get_source_id()
    if source in _kept:
        return
    context = plant.CreateDefaultContext()

    def calc_X_WF(frame: FrameId) -> RigidTransform:
        body = plant.GetBodyFromFrameId(frame)
        return plant.EvalBodyPoseInWorld(context, body)

    reader = GeometryReader(Role.kPerception)
    geometries = reader.read(inspector)
    fixed = anchored_frames(plant) | {inspector.world_frame_id()}
    if any(geometry.frame_id not in fixed for geometry in geometries):
        # Scenes that share what moves would move it for each other.
        return
    scene = RayCastingScene(geometries, fixed, calc_X_WF)
    while len(_kept) >= _MOST_KEPT:
        del _kept[next(iter(_kept))]
    _kept[source] = BuiltScene(reader, scene)


def take_scene(world: World) -> BuiltScene | None:
    """Returns the ray scene that was built of a world, if there is one."""
    return _kept.pop(world.plant.get_source_id(), None)
