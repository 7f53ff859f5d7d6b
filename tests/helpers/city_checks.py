"""Properties of the structures of every city."""

import numpy as np
import pytest
import shapely
from shapely.strtree import STRtree

from worlds.shapes import part_mesh

# Only parts below this height take ground [m].
HEADROOM = 2.4
# Parts may reach this far outside a footprint: plinths, pilasters, steps.
OVERHANG = 0.36


def is_ground(structure) -> bool:
    return "ground" in structure.tags


def check_no_structure_stands_in_another(standing):
    footprints = [s.footprint_W.buffer(-0.01) for s in standing]
    for i, j in STRtree(footprints).query(footprints, "intersects").T:
        if i < j:
            pytest.fail(f"{standing[i].name} stands in {standing[j].name}")


def check_no_structure_stands_in_a_lane(standing, network):
    lanes = network.areas.lane_area
    shapely.prepare(lanes)
    for structure in standing:
        footprint = structure.footprint_W.buffer(-0.01)
        assert not lanes.intersects(footprint), structure.name


# Nothing floats higher above the ground, and nothing stands higher or deeper
# than on it [m]. Among things on slopes one side is sunk in.
FLOATS = 0.02
SUNK_IN = 0.5


def check_things_stand_on_the_ground(structures):
    """Casts rays down from all feet onto the ground, with Open3D.

    No kind of thing hangs free: signs and lights have posts, cranes a base.
    """
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    for structure in structures:
        if is_ground(structure):
            for part in structure.model.parts:
                mesh = part_mesh(part, structure.model.meshes)
                p, triangles = mesh.vertices, mesh.triangles()
                scene.add_triangles(
                    p.astype(np.float32), triangles.astype(np.uint32)
                )
    things = [s for s in structures if not is_ground(s)]
    feet = [_feet(thing) for thing in things]
    p_WFs = np.concatenate(feet)
    # From 1 m above, so that a bridge does not count for what is below it, and
    # twice, as one ray may pass a slit of a millimetre.
    gaps = np.full(len(p_WFs), np.inf)
    for aside in (0.0, 0.004):
        down = np.tile([aside, aside, -1.0], (len(p_WFs), 1))
        rays = np.concatenate([p_WFs + np.array([0.0, 0.0, 1.0]), down], axis=1)
        hits = scene.cast_rays(open3d.core.Tensor(rays.astype(np.float32)))
        gaps = np.minimum(gaps, hits["t_hit"].numpy() - 1.0)
    ends = np.cumsum([len(foot) for foot in feet])
    for thing, below in zip(things, np.split(gaps, ends[:-1]), strict=True):
        # The first is the thing's own frame, which lies on the ground.
        origin = below[0]
        assert -SUNK_IN < origin < FLOATS, f"{thing.name} {origin:.3f}"
        assert max(below) < FLOATS, f"{thing.name} {max(below):.3f}"


def _feet(structure) -> np.ndarray:
    """Returns the frame and the lowest vertices of a structure, in W."""
    model = structure.model
    p = np.concatenate(
        [part_mesh(part, model.meshes).vertices for part in model.parts]
    )
    bottom = p[:, 2].min()
    low = p[p[:, 2] < bottom + 0.001]
    return np.array([structure.p_WP(q) for q in [(0.0, 0.0, 0.0), *low]])


def check_nothing_low_reaches_far_out_of_its_footprint(standing, network):
    """Tests of footprints rely on this.

    Triangles that cross head height are cut there; only vertices and these cuts
    are compared.
    """
    lanes = network.areas.lane_area
    shapely.prepare(lanes)
    for structure in standing:
        low = [
            _low_points(part, structure.model.meshes)
            for part in structure.model.parts
        ]
        points = np.concatenate(low)
        allowed = structure.model.footprint.buffer(OVERHANG)
        shapely.prepare(allowed)
        inside = shapely.contains_xy(allowed, points[:, 0], points[:, 1])
        assert inside.all(), f"{structure.name} {points[~inside][0]}"
        c, s = np.cos(structure.yaw), np.sin(structure.yaw)
        x, y, _ = structure.xyz
        xy = points[:, :2] @ np.array([[c, s], [-s, c]]) + (x, y)
        in_lane = shapely.contains_xy(lanes, xy[:, 0], xy[:, 1])
        assert not in_lane.any(), f"{structure.name} {xy[in_lane][0]}"


def _low_points(part, meshes) -> np.ndarray:
    """Returns where a part's edges are below head height, in S.

    An awning may hang at head height.
    """
    mesh = part_mesh(part, meshes)
    p, triangles = mesh.vertices, mesh.triangles()
    points = [p[p[:, 2] < HEADROOM - 1e-6]]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = p[triangles[:, i]], p[triangles[:, j]]
        cut = (a[:, 2] - HEADROOM) * (b[:, 2] - HEADROOM) < -1e-9
        a, b = a[cut], b[cut]
        u = (HEADROOM - a[:, 2]) / (b[:, 2] - a[:, 2])
        points.append(a + u[:, None] * (b - a))
    return np.concatenate(points)
