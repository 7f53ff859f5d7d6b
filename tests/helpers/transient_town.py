"""A street with parked cars, trees, poles and walls, for tests of change."""

import functools

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely

from cns_drake.scenarios import TransientConfig
from cns_drake.scene import geometry_by_structure, load_world
from cns_drake.transient import change_world
from worlds.shapes import OBJECT_MESHES, Way

_WORLD = """<?xml version="1.0"?>
<sdf version="1.9">
  <world name="street">
    <model name="street">
      <static>true</static>
      <pose>{origin}</pose>
      <link name="street">{visuals}</link>
    </model>
  </world>
</sdf>
"""
_VISUAL = """
        <visual name="{name}">
          <pose>{pose}</pose>
          <geometry>{shape}</geometry>
        </visual>"""
# The street lies turned, away from the origin of the world.
ORIGIN = (30.0, -12.0, 0.4, 0.0, 0.0, 0.35)
X_WT = RigidTransform(RollPitchYaw(*ORIGIN[3:]), ORIGIN[:3])
# The road is 6 m wide, and its lanes leave 0.3 m at the kerbs.
LANES = shapely.Polygon(
    [
        (X_WT @ [x, y, 0])[:2]
        for x, y in ((-99, -2.7), (99, -2.7), (99, 2.7), (-99, 2.7))
    ]
)


def drive_along_street(x_from, x_to):
    """The path of a vehicle, from above, between two x of the town [m]."""
    return Way([(X_WT @ [x, -0.5, 0])[:2] for x in (x_from, x_to)])


DRIVE = drive_along_street(-60, 80)
COLUMNS = 20
# The lawn of a sloping town rises along y by this much per metre.
SLOPE = 0.08
# It rises from this y on [m].
SLOPE_FROM = 4.5


def _numbers(values):
    return " ".join(f"{value:.6g}" for value in values)


def mesh_shape(name, scale=(1, 1, 1)):
    return (
        f"<mesh><uri>{OBJECT_MESHES / name}.obj</uri>"
        f"<scale>{_numbers(scale)}</scale></mesh>"
    )


def box_shape(*size):
    return f"<box><size>{_numbers(size)}</size></box>"


def pole_shape(radius, length):
    return (
        f"<cylinder><radius>{radius}</radius><length>{length}</length>"
        "</cylinder>"
    )


def visual(name, shape, *pose):
    return _VISUAL.format(
        name=name, shape=shape, pose=_numbers([*pose, *[0] * (6 - len(pose))])
    )


def slope_height(y):
    """Returns the height of a sloping lawn at y, in the town's frame [m]."""
    return 0.05 + SLOPE * (y - SLOPE_FROM)


def write_transient_town(folder, *, slopes=False):
    """Writes a world and its table; returns the path of the world.

    Along x: cars side by side at y = 8, cars nose to tail at y = 3, lamps and
    signs at y = 5, trees and shrubs at y = 12, houses beyond.
    """
    rng = np.random.default_rng(3)
    # The farthest structures stay, and with them the coordinates of casting.
    edge = pole_shape(0.1, 1)
    visuals = [
        visual("west/edge", edge, -200, -200),
        visual("east/edge", edge, 200, 200, 40),
        visual("road/plate", box_shape(200, 6, 1), 0, 0, -0.5),
        visual("lawn/plate", box_shape(200, 40, 1), 0, 23, -0.45),
    ]
    rows = {"west": "fence", "east": "fence", "road": "road", "lawn": "terrain"}
    if slopes:
        # A low parking bay, and beyond its kerb the lawn.
        roll = np.arctan(SLOPE)
        c, s = np.cos(roll), np.sin(roll)
        y, z = SLOPE_FROM + 20 * c + 0.5 * s, 0.05 + 20 * s - 0.5 * c
        visuals[-1] = visual("lawn/plate", box_shape(200, 40, 1), 0, y, z, roll)
        visuals.append(visual("bay/plate", box_shape(200, 2, 1), 0, 4, -1))
        rows["bay"] = "parking"
    forms = ("hatchback", "estate", "suv", "van")
    for k in range(COLUMNS):
        form = forms[int(rng.integers(len(forms)))]
        scale = rng.uniform(0.97, 1.03, 3)
        dx, dy, skew = rng.uniform(-1, 1, 3) * (0.1, 0.15, 0.02)
        places = {
            f"car_{k:03d}": (
                2.7 * k + dx,
                8 + dy,
                0.05,
                0,
                0,
                np.pi / 2 + skew,
            ),
            f"car_{k + COLUMNS:03d}": (6.4 * k + dy - 40, 3.2, 0, 0, 0, skew),
        }
        for name, pose in places.items():
            for part in ("body", "trim"):
                shape = mesh_shape(f"{form}_{part}", scale)
                visuals.append(visual(f"{name}/{part}", shape, *pose))
            rows[name] = "car"
        tree = f"tree_{k:03d}"
        tall = rng.uniform(0.8, 1.2, 3)
        for part in ("wood", "crown"):
            shape = mesh_shape(f"lime_tree_a_{part}", tall)
            visuals.append(visual(f"{tree}/{part}", shape, 5 * k, 13.5, 0.05))
        rows[tree] = "vegetation"
        name = f"shrub_{k:03d}"
        shape = mesh_shape("shrub_a", tall)
        visuals.append(visual(f"{name}/leaves", shape, 5 * k + 2.5, 12.5, 0.05))
        rows[name] = "vegetation"
        name = f"lamp_{k:03d}"
        visuals += [
            visual(f"{name}/mast", pole_shape(0.08, 6), 5 * k, 5, 3),
            visual(f"{name}/arm", box_shape(0.1, 1.5, 0.1), 5 * k, 4.3, 6),
        ]
        rows[name] = "pole"
        name = f"sign_{k:03d}"
        visuals.append(
            visual(
                f"{name}/plate", box_shape(0.6, 0.05, 2.4), 5 * k + 2, 5.2, 1
            )
        )
        rows[name] = "traffic-sign"
        if k % 4 == 0:
            name = f"house_{k:03d}"
            shape = box_shape(15, 8, 9)
            visuals.append(visual(f"{name}/body", shape, 5 * k, 24, 4))
            rows[name] = "building"
    return write_world(folder, visuals, rows)


def write_world(folder, visuals, rows, origin=ORIGIN):
    """Writes a world of visuals, and the classes of its structures."""
    text = _WORLD.format(origin=_numbers(origin), visuals="".join(visuals))
    (folder / "street.sdf").write_text(text)
    materials = {"vegetation": "wood=bark", "car": "trim=trim"}
    lines = ["instance,name,class,material"]
    lines += [
        f"{k},{n},{c},{materials.get(c, '')}"
        for k, (n, c) in enumerate(rows.items(), 1)
    ]
    (folder / "structures.csv").write_text("\n".join(lines) + "\n")
    return folder / "street.sdf"


def change_maker(sdf, drive, lanes):
    """Returns a function of switches that changes the town, once for each.

    It returns the world and what stands in it.
    """

    @functools.cache
    def make(**switches):
        config = TransientConfig(**switches)
        world = change_world(load_world(sdf), config, drive, lanes)
        return world, geometry_by_structure(world)

    return make


def in_town(points):
    """Points of the world in the frame of the town, where x is the street."""
    return (X_WT.inverse() @ points.T).T


def new_things(changed, **switches):
    """New structures by name; all others must be unchanged."""
    _, before = changed()
    world, after = changed(**switches)
    for name, thing in before.items():
        assert np.array_equal(thing.p_WPs, after[name].p_WPs)
    fresh = {n: t for n, t in after.items() if n not in before}
    for entry in world.structures:
        expected = tuple(switches)[:1] if entry.name in fresh else ()
        assert entry.causes == expected
    return fresh
