from cns_drake.ray_casting.embree import load as load
from cns_drake.ray_casting.embree_hierarchy import (
    EmbreeHierarchy as EmbreeHierarchy,
)
from cns_drake.ray_casting.embree_primitives import SOLID as SOLID
from cns_drake.ray_casting.embree_primitives import merge_first as merge_first
from cns_drake.ray_casting.embree_primitives import merge_second as merge_second
from cns_drake.ray_casting.known_poses import NOTHING_KNOWN as NOTHING_KNOWN
from cns_drake.ray_casting.known_poses import KnownPoses as KnownPoses
from cns_drake.ray_casting.moving_groups import EVERYWHERE as EVERYWHERE
from cns_drake.ray_casting.moving_groups import Ball as Ball
from cns_drake.ray_casting.ray_casting_scene import (
    RayCastingScene as RayCastingScene,
)
from cns_drake.ray_casting.ray_casting_scene import SceneHits as SceneHits
from cns_drake.ray_casting.ray_casting_scene import (
    SurfaceFrames as SurfaceFrames,
)
from cns_drake.ray_casting.ray_groups import Motion as Motion
from cns_drake.ray_casting.ray_groups import (
    group_geometries as group_geometries,
)
from cns_drake.ray_casting.rays import rotate as rotate
