from .embree import load as load
from .embree_scene import EmbreeScene as EmbreeScene
from .known_poses import NOTHING_KNOWN as NOTHING_KNOWN
from .known_poses import KnownPoses as KnownPoses
from .moving_groups import EVERYWHERE as EVERYWHERE
from .moving_groups import Ball as Ball
from .ray_casting_scene import (
    RayCastingScene as RayCastingScene,
)
from .ray_casting_scene import SceneHits as SceneHits
from .ray_casting_scene import (
    SurfaceFrames as SurfaceFrames,
)
from .ray_groups import Motion as Motion
from .ray_groups import (
    group_geometries as group_geometries,
)
from .rays import rotate as rotate
