"""Where no snow falls: below roofs and bridges, but not below low things."""

from helpers.transient_town import WORLD, box_shape, visual
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
import shapely

from cns_drake.scenarios.transient_config import TransientConfig
from cns_drake.scene.world import load_world
from cns_drake.transient.changing import change_world
from cns_drake.transient.ground_surface import (
    from_above,
    triangle_corners,
    upwardness,
)
from cns_drake.transient.standing import read_standing

DEPTH = 0.25
DRIVE = shapely.LineString([(-18, 0), (18, 0)])
# Poses of a roof, a bridge and a table, and their sizes.
ROOF, BRIDGE, TABLE = (
    (9.0, 8.0, 3.1, 0.0, 0.0, 0.4),
    (-8.0, -9.0, 5.0, 0.0, 0.0, -0.2),
    (12.0, -9.0, 1.0),
)
SIZES = {"roof": (6, 4, 0.2), "bridge": (9, 5, 0.6), "table": (3, 3, 0.1)}


@pytest.fixture(scope="module")
def snowy(tmp_path_factory):
    """What stands after a snowfall on a lawn of 40 m with four things."""
    folder = tmp_path_factory.mktemp("yard")
    visuals = [
        visual("lawn/plate", box_shape(40, 40, 1), 0, 0, -0.5),
        visual("roof/plate", box_shape(*SIZES["roof"]), *ROOF),
        visual("bridge/deck", box_shape(*SIZES["bridge"]), *BRIDGE),
        visual("table/plate", box_shape(*SIZES["table"]), *TABLE),
        visual("house/body", box_shape(6, 6, 7), -10, 10, 3),
    ]
    X_WRoof = RigidTransform(RollPitchYaw(*ROOF[3:]), ROOF[:3])
    for k, (x, y) in enumerate(((-2, -1), (2, -1), (2, 1), (-2, 1))):
        foot = (X_WRoof @ [x, y, -1.6])[:3]
        shape = box_shape(0.2, 0.2, 3)
        visuals.append(visual(f"roof/post_{k}", shape, *foot))
    (folder / "yard.sdf").write_text(
        WORLD.format(origin="0 0 0 0 0 0", visuals="".join(visuals))
    )
    (folder / "structures.csv").write_text(
        "instance,name,class\n1,lawn,terrain\n2,roof,other-structure\n"
        "3,bridge,sidewalk\n4,table,other-object\n5,house,building\n"
    )
    world = load_world(folder / "yard.sdf")
    lanes = DRIVE.buffer(1.0)
    config = TransientConfig(snow=DEPTH)
    return read_standing(change_world(world, config, DRIVE, lanes))


def snow_on(thing):
    """The area of the snow on a thing, seen from above."""
    corners = np.concatenate(
        [
            triangle_corners(part)
            for part in thing.parts
            if part.name.endswith("snow")
        ]
    )
    return shapely.unary_union(
        from_above(corners[upwardness(corners) > 0.5]), grid_size=1e-4
    )


def outline(size, pose):
    X_WG = RigidTransform(RollPitchYaw(*(pose[3:] or (0, 0, 0))), pose[:3])
    x, y = size[0] / 2, size[1] / 2
    return shapely.Polygon(
        [
            (X_WG @ [sx * x, sy * y, 0])[:2]
            for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
    )


@pytest.mark.parametrize(("name", "pose"), [("roof", ROOF), ("bridge", BRIDGE)])
def test_no_snow_lies_below(snowy, name, pose):
    below = outline(SIZES[name], pose)
    lawn = snow_on(snowy["lawn"])
    # Triangles along the edge are as long as 0.7 m.
    assert lawn.intersection(below.buffer(-0.7)).area < 1e-6
    # Outside, snow lies up to the edge.
    assert below.buffer(2.0).difference(below.buffer(0.7)).difference(
        lawn
    ).area == pytest.approx(0.0, abs=1e-3)


def test_snow_lies_everywhere_else(snowy):
    lawn = snow_on(snowy["lawn"])
    covered = sum(outline(SIZES[n], p).area for n, p in (
        ("roof", ROOF), ("bridge", BRIDGE)))  # fmt: skip
    # Below the table, too: it leaves no headroom.
    assert lawn.contains(outline(SIZES["table"], TABLE))
    assert lawn.area == pytest.approx(40 * 40 - covered, abs=8.0)
    for name in ("roof", "house", "table"):
        thing = snowy[name]
        top = max(
            part.p_WPs[:, 2].max()
            for part in thing.parts
            if not part.name.endswith("snow")
        )
        assert thing.p_WPs[:, 2].max() == pytest.approx(top + DEPTH, abs=2e-3)
