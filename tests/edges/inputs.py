"""What the programs read: small files, the same each time.

Nothing here imports the project, so that a change of its insides changes none
of these files.
"""

import os
import sys

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.layered_scans import seen_from, town
from helpers.mesh_texts import (
    collada_text,
    gltf_text,
    obj_text,
    ply_text,
    stl_text,
)
from helpers.small_city import write_small_city
from helpers.small_cityjson import write_blocks
from helpers.small_opendrive import (
    TWO_LANES,
    cubic,
    geometry,
    lane,
    road,
    section,
    straight,
    turn,
    write_roads,
)
from helpers.small_osm import OsmWriter
import numpy as np
import yaml

_NORTH = {"road": "north", "direction": "forward", "lane": 1}
# A drive along the north of the small city, 110 m.
_DRIVE = {
    "map": ".",
    "stage": "02",
    "title": "Around the north",
    "route": [_NORTH | {"start": 10.0, "end": 120.0}],
    "speeds": {"cruise": 8.0},
}
_LIDAR = {"preset": "vlp-16", "columns": 360}
_RECORDINGS = {
    "plain": {},
    "rain_and_traffic": {
        "lidars": {"lidar": _LIDAR | {"returns": "calibrated"}},
        "weather": {"rain": 20.0},
        "traffic": {"fcd": "trace.xml"},
    },
    "queues": {"lidars": {"lidar": _LIDAR}, "traffic": {"queues": True}},
    "ride_and_camera": {
        "lidars": {"lidar": _LIDAR},
        "ride": {"roughness": "D"},
        "cameras": {"front": {"width": 64, "height": 48, "rate": 10.0}},
    },
}
_EXPERIMENT = {
    "about": "What do missing houses cost?",
    "maps": ["town"],
    "database": {"stage": ["last", "first"]},
    "tasks": ["place", "pose", "change"],
    "methods": ["scan-context++", "solid", "layered-overlap", "ring++", "btc"],
    "protocol": {"base": "random-yaw", "query_spacing": 8.0},
}

# File that a trap writes if it runs.
SPRUNG = "sprung"
_TRAP = f"""
with open(__file__.rpartition("/")[0] + "/{SPRUNG}", "w"):
    raise ImportError
"""
# Modules that the programs and their processes import.
_MODULES = (*sys.stdlib_module_names, "cns_drake", "evaluation", "worlds",
            "matplotlib", "numba", "numpy", "open3d", "pydrake",
            "yaml")  # fmt: skip


def write_traps(folder):
    """Writes modules and settings that no program may read."""
    for name in _MODULES:
        (folder / f"{name}.py").write_text(_TRAP)
    (folder / ".numba_config.yaml").write_text("{{{")
    if not (folder / "matplotlibrc").exists():
        os.mkfifo(folder / "matplotlibrc")


def write_city(folder):
    """Writes the small city with a drive, as `town`."""
    world = write_small_city(folder / "town")
    (world / "sequence_02.yaml").write_text(yaml.safe_dump(_DRIVE))


def write_sequences(folder):
    """Writes a short drive through each stage of the small city."""
    for stage in ("01", "02"):
        values = _DRIVE | {"stage": stage, "lidars": {"lidar": _LIDAR}}
        values["route"] = [_NORTH | {"start": 10.0, "end": 60.0}]
        path = folder / "town" / f"sequence_{stage}.yaml"
        path.write_text(yaml.safe_dump(values))


# Archetypes, with width, depth and height [m].
_BUILDINGS = """
art_deco_tower 25 21 102, balcony_flats 15 13 19, banded_tower 22 19 55,
barn 10 9 9, brick_block 14 12 23, bungalow 11 10 5, car_park 28 24 22,
chapel 13 11 18, church 28 34 50, corner_building 20 17 30,
corner_store 11 10 9, court_block 31 26 23, detached_house 11 10 8,
elevated_station 20 17 12, gallery_flats 17 14 25, garden_flats 17 14 13,
gas_station 25 21 7, glass_skyscraper 28 24 130, grid_tower 22 19 65,
hotel 28 24 47, kiosk_row 8 7 5, mill 20 17 18, museum 36 30 21,
observation_tower 22 19 97, office 20 17 25, park_pavilion 7 6 6,
parking_deck 34 28 18, podium_tower 36 30 76, row_house 6 6 10,
school 28 24 11, semi_detached 13 11 8, shop_house 8 7 11, shop_strip 10 9 7,
shopping_hall 39 33 16, slab_tower 20 17 54, sports_hall 25 21 11,
supermarket 28 24 9, terrace 11 10 9, town_hall 25 21 29,
unfinished_tower 22 19 33, walk_up 13 11 13, waterfront_hall 25 21 12
"""
_OBJECTS = """
advertising_panel advertising_pillar basketball_hoop bench bicycle
bicycle_rack bollard box_planter box_truck brick_pallets bus bus_shelter
cabinet cafe_table city_car concrete_barrier container estate excavator
flag_poles flower_bed fountain garage garden_wall hatchback hedge hoarding
hydrant kiosk lamp_post lamp_post_curved lamp_post_curved_double
lamp_post_double lantern lime_tree litter_bin low_shrub market_stall
newspaper_boxes obelisk palm parking_meter pedestrian_light phone_box
picket_fence pickup picnic_table pine pipe_stack plane_tree poplar
portable_toilet post_box railing recycling_bins round_planter saloon shrub
sign_direction sign_rectangular sign_round sign_stop sign_street_name
sign_triangular site_cabin site_fence skip slide soil_heap spruce statue
stone_bench suv swing ticket_machine tower_crane traffic_cones traffic_light
traffic_light_post van willow young_tree
"""
_ONE_ROAD = """
defaults: {lanes: [1, 1], lane_width: 3.5, sidewalk: 2.5, kerb_height: 0.15,
           speed_limit: 13.9}
junctions:
  west: {position: [-40, -40], kerb_radius: 6, dead_end: true}
  east: {position: [500, -40], kerb_radius: 6, dead_end: true}
roads:
  south: {start: west, end: east}
"""


def write_kinds(folder):
    """Writes a city, `kinds`, with two buildings and an object of each kind.

    In its first stage the first building is lower, and the second one a site if
    it is large enough.
    """
    buildings, lower, sites = [], {}, {}
    for row, text in enumerate(_BUILDINGS.replace("\n", " ").split(",")):
        name, *sizes = text.split()
        width, depth, height = map(float, sizes)
        for k in (0, 1):
            # The second one is larger, and turned.
            building = {
                "archetype": name,
                "at": [60.0 * (row % 8), 120.0 * (row // 8) + 60.0 * k],
                "size": [width + 2.0 * k, depth + k],
                "height": height + 1.5 * k,
                "yaw_deg": 90.0 * k,
            }
            buildings.append(building)
            one = f"{name}_{k + 1:03d}"
            grows = {"height": round(0.55 * height, 1), "structures": [one]}
            is_site = k and min(width, depth) >= 18.0
            (sites if is_site else lower)[one] = grows
    objects = [
        {"object": name, "at": [12.0 * (k % 40), 720.0 + 25.0 * (k // 40)]}
        for k, name in enumerate(_OBJECTS.split())
    ]
    plan = {
        "seed": 7,
        "bounds": [-100, -100, 560, 850],
        "cars": {"saloon": 1},
        "street": {"lamp": "lantern"},
        "districts": [
            {
                "name": "field",
                "ground": "lawn",
                "buildings": buildings,
                "objects": objects,
            }
        ],
    }
    stages = {
        "01": {"story": "low", "lower": lower, "sites": sites},
        "02": {"story": "all of it"},
    }
    (folder / "kinds").mkdir()
    for file, values in (("city", plan), ("stages", {"stages": stages})):
        text = yaml.safe_dump(values, sort_keys=False)
        (folder / "kinds" / f"{file}.yaml").write_text(text)
    (folder / "kinds" / "roads.yaml").write_text(_ONE_ROAD)


def write_scenarios(folder):
    """Writes a file for each recording, of the drive through the city."""
    write_trace(folder / "trace.xml")
    for name, more in _RECORDINGS.items():
        values = _DRIVE | {"map": "town", "name": name} | more
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(values))
    return tuple(_RECORDINGS)


def write_trace(path):
    """Writes 2 s of traffic as SUMO does: near the drive, and far away.

    A bus drives off ahead of the car, a car comes towards it and disappears, a
    bicycle turns; one person walks faster and faster, one stands.
    """
    rows = ["<fcd-export>"]
    for k in range(21):
        t = 0.1 * k
        rows.append(f'<timestep time="{t:.2f}">')
        users = [
            ("vehicle", "bus", "bus", 2.0, 38.0 + t * t, 0.0),
            ("vehicle", "bike", "bicycle", 2.0 + t, 60.0 + t**1.5, 20.0 * t),
            ("vehicle", "far", "truck", 30.0 + 9.0 * t, 3.0, 84.0),
            ("person", "walks", "", 6.0, 20.0 + t + 0.2 * t * t, 0.0),
            ("person", "stands", "", -6.0, 25.0, 100.0),
        ]
        if k < 5:
            users.append(("vehicle", "c", "", -2.0, 30.0 - 8.0 * t, 180.0))
        rows += [
            f'<{kind} id="{name}" type="{type_name}" x="{x:.3f}" y="{y:.3f}"'
            f' angle="{angle:.2f}"/>'
            for kind, name, type_name, x, y, angle in users
        ]
        rows.append("</timestep>")
    path.write_text("\n".join([*rows, "</fcd-export>", ""]))


def write_experiment(folder):
    text = yaml.safe_dump(_EXPERIMENT)
    (folder / "houses.yaml").write_text(text)


def write_drives(folder):
    """Writes recordings `before`, `after` and `control`."""
    for name, scans, X_WBs in _drives():
        write_recording(folder / name, list(map(make_scan, scans)), X_WBs)


def write_kitti_drives(folder):
    """Writes the drives `before` and `after` as sequences 00 and 01 of KITTI.

    The poses are of a camera 0.3 m ahead of the LiDAR, and 0.1 m below it.
    """
    X_CS = np.array(
        [[0, -1, 0, 0], [0, 0, -1, -0.1], [1, 0, 0, -0.3], [0, 0, 0, 1.0]]
    )
    (folder / "poses").mkdir()
    for number, (_, scans, X_WBs) in enumerate(list(_drives())[:2]):
        sequence = folder / "sequences" / f"{number:02d}"
        (sequence / "velodyne").mkdir(parents=True)
        for i, scan in enumerate(scans):
            intensity = np.random.default_rng(i).uniform(size=len(scan))
            rows = np.c_[scan, intensity].astype("<f4")
            rows.tofile(sequence / "velodyne" / f"{i:06d}.bin")
        X_WCs = np.array(X_WBs) @ np.linalg.inv(X_CS)
        X_C0Cs = np.linalg.inv(X_WCs[0]) @ X_WCs
        for path, rows in (
            (folder / "poses" / f"{number:02d}.txt", X_C0Cs[:, :3]),
            (sequence / "times.txt", 0.1 * np.arange(len(scans))),
        ):
            np.savetxt(path, rows.reshape(len(scans), -1))
        row = " ".join(map(str, X_CS[:3].ravel()))
        (sequence / "calib.txt").write_text(f"Tr: {row}\n")


def write_streets(folder):
    """Writes recordings `old` and `new`, 500 m and 600 m of a street.

    Of every three towns along the way, the second is another one in `new`.
    """
    for name, side, number in (("old", 0.0, 26), ("new", 2.0, 31)):
        seeds = [k + 50 * (k % 3 == 1 and name == "new") for k in range(15)]
        scans, X_WBs = _drive(seeds, side, 20.0 * np.arange(number), number)
        write_recording(folder / name, list(map(make_scan, scans)), X_WBs)


def _drives():
    """Yields name, scans and poses of three drives, 23 scans along 110 m each.

    Of four towns along the way, the second is another one in `after`, and the
    fourth in `control`, so that no two pairs give the same numbers.
    """
    for name, side, seeds in (
        ("before", 0.0, (1, 2, 3, 4)),
        ("after", 1.0, (1, 5, 3, 4)),
        ("control", 1.0, (1, 2, 3, 6)),
    ):
        yield name, *_drive(seeds, side, 5.0 * np.arange(23), len(name))


def _drive(seeds, side, xs, seed):
    """Returns scans and poses of a drive along the x axis.

    Args:
        seeds: of the towns along the way, every 45 m.
        side: y of the drive [m].
        xs: of the scans [m].
        seed: selects the points of the scans.
    """
    parts = [
        town(one, number=25) + np.array([45.0 * k - 10.0, 0.0, 0.0])
        for k, one in enumerate(seeds)
    ]
    points = np.concatenate(parts)
    scans, X_WBs = [], []
    for i, x in enumerate(xs.tolist()):
        yaw = 0.02 * i
        rng = np.random.default_rng([i, seed])
        near = points[np.hypot(points[:, 0] - x, points[:, 1]) < 50.0]
        chosen = rng.permutation(len(near))[:6000]
        scan = seen_from(near[chosen], yaw, x, side)
        scans.append(scan + rng.normal(scale=0.01, size=scan.shape))
        X_WBs.append(yaw_pose(x, side, 0.0, yaw))
    return scans, X_WBs


def write_worlds(folder):
    """Writes worlds of SDF and of URDF; returns the names of their files.

    Both have a ground, a box and a prism; in SDF the prism stands there once
    in each format of meshes.
    """
    meshes = {
        "prism.obj": obj_text(),
        "prism.gltf": gltf_text()[0],
        "prism.stl": stl_text(),
        "prism.ply": ply_text(),
        "prism.dae": collada_text(),
    }
    for name, text in meshes.items():
        (folder / name).write_text(text)
    models = "".join(
        f'<model name="{name[6:]}"><static>true</static><pose>{6 * np.cos(k)}'
        f" {6 * np.sin(k)} 0 0 0 0.3</pose><link name='link'>"
        f"<visual name='mesh'><geometry><mesh><uri>{name}</uri></mesh>"
        "</geometry></visual></link></model>"
        for k, name in enumerate(meshes)
    )
    (folder / "meshes.sdf").write_text(
        '<sdf version="1.9"><world name="meshes"><model name="ground">'
        "<static>true</static><link name='link'><visual name='plane'><geometry>"
        "<plane><normal>0 0 1</normal></plane></geometry></visual>"
        "<visual name='box'><pose>-5 0 1 0 0 0</pose><geometry><box>"
        "<size>1 3 2</size></box></geometry></visual></link></model>"
        f"{models}</world></sdf>"
    )
    visuals = "".join(
        f"<visual name='{name}'><origin xyz='{xyz}' rpy='0 0 0.3'/><geometry>"
        f"{shape}</geometry></visual>"
        for name, xyz, shape in (
            ("ground", "0 0 -0.5", "<box size='100 100 1'/>"),
            ("box", "-5 0 1", "<box size='1 3 2'/>"),
            ("pole", "0 -4 2", "<cylinder radius='0.2' length='4'/>"),
            ("mesh", "6 0 0", "<mesh filename='prism.obj'/>"),
        )
    )
    (folder / "yard.urdf").write_text(
        f"<robot name='yard'><link name='world'/><link name='yard'>{visuals}"
        "</link><joint name='fixed' type='fixed'><parent link='world'/>"
        "<child link='yard'/></joint></robot>"
    )
    return "meshes.sdf", "yard.urdf"


def write_maps(folder):
    """Writes two maps with labels at random, some of which are true."""
    rng = np.random.default_rng(3)
    kept = rng.uniform(0.0, 9.0, (300, 3))
    for side, change in (("A", 2), ("B", 3)):
        own = rng.uniform(0.0, 9.0, (100, 3))
        points = np.concatenate([kept, own]).round(4)
        labels = np.repeat([1, change], [300, 100]).astype(np.uint8)
        (folder / "maps" / side).mkdir(parents=True)
        rows = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
        (folder / "maps" / side / "map.ply").write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
            "property double x\nproperty double y\nproperty double z\n"
            f"end_header\n{rows}\n"
        )
        np.save(folder / "maps" / side / "truth.npy", labels)


# Of a quarter of OpenStreetMap: tags of houses, of nodes beside the streets, of
# ways and of grounds.
_HOUSES = """
building=apartments building:levels=5 roof:shape=flat roof:colour=#aa3322
building=house building:levels=2 roof:shape=gabled roof:levels=1
building=house height=9 roof:shape=hipped roof:height=3 building:colour=red
building=retail building:levels=3 shop=bakery building:material=brick
building=office height=24 roof:shape=pyramidal start_date=1931
building=church height=18 roof:shape=gabled amenity=place_of_worship
building=industrial height=8 roof:shape=skillion min_height=2
building=garages building:levels=1 end_date=1970
building=yes roof:shape=gabled roof:orientation=across roof:material=metal
building=hotel building:levels=6 start_date=late+1960s
building=school building:levels=3 roof:shape=hipped start_date=C19
building=demolished start_date=1900
"""
_NODES = """
highway=street_lamp amenity=bench;direction=90 amenity=waste_basket
amenity=post_box amenity=bicycle_parking highway=bus_stop highway=stop
emergency=fire_hydrant barrier=bollard man_made=street_cabinet
advertising=column natural=tree;height=9 natural=tree;leaf_type=needleleaved
natural=tree;species=Betula;diameter_crown=5 traffic_sign=DE:274
amenity=recycling vending=parking_tickets highway=give_way
"""
_AREAS = """
landuse=grass natural=water leisure=playground landuse=forest natural=sand
amenity=parking highway=pedestrian;area=yes leisure=pitch;surface=clay
landuse=construction natural=scrub leisure=garden man_made=pier
"""


def _tags_of(text, separator=" "):
    """Returns keys and values of OpenStreetMap; a space of a value is +."""
    pairs = (pair.split("=") for pair in text.split(separator))
    return {k.replace(":", "__"): v.replace("+", " ") for k, v in pairs}


def write_quarter_osm(folder):
    """Writes a quarter with some of what an import builds."""
    osm = OsmWriter()
    ring = [(-90, -60), (90, -60), (90, 60), (-90, 60), (-90, -60)]
    osm.way(
        ring, highway="residential", sidewalk="both", parking__right="lane",
        maxspeed="30", name="Ring",
    )  # fmt: skip
    osm.way(
        [(-90, 0), (-20, 0), (0, 0), (90, 0)], highway="tertiary", lanes="2",
        cycleway="track", parking__both="lane",
    )  # fmt: skip
    osm.way([(0, -60), (0, 60)], highway="living_street", oneway="yes")
    osm.node(0, 0, highway="crossing", crossing="zebra")
    osm.node(-40, 0, highway="crossing", crossing="traffic_signals")
    osm.way([(-60, -50), (-60, -8)], highway="footway", width="2.5")
    osm.way([(20, 10), (40, 55)], highway="cycleway")
    # Through a building, a wall and a hedge, and over all of them.
    osm.box(-64, -40, 14, 9, building="yes", height="9")
    passage = [(-57, -60), (-57, -45), (-57, -25), (-57, -8)]
    osm.way(passage, highway="service", tunnel="building_passage")
    gate = osm.node(-30, -30)
    osm.way_of([osm.node(-30, -50), gate, osm.node(-30, -10)], barrier="wall")
    osm.way_of([osm.node(-45, -30), gate, osm.node(-10, -30)], highway="path")
    osm.way([(10, -50), (50, -50)], barrier="hedge", height="1.2", width="1")
    osm.way([(10, -45), (50, -45)], barrier="fence", fence_type="chain_link")
    osm.way([(60, -45), (85, -45)], natural="tree_row", height="8")
    osm.way([(-120, 30), (120, 30)], highway="footway", bridge="yes", layer="1")
    for k, text in enumerate(_HOUSES.strip().splitlines()):
        x = (-84, -62, -36, 8, 27, 46, 65)[k % 7]
        y = 12 if k < 7 else -28
        osm.box(x, y, 12 + k % 4, 10, **_tags_of(text))
    whole = osm.box(-80, 36, 24, 20, building="yes")
    osm.box(-80, 36, 10, 20, building__part="yes", building__levels="4")
    osm.relation({"": [whole]}, type="site")
    hole, outer = osm.box(44, 40, 8, 8), osm.box(38, 36, 20, 18)
    osm.relation(
        {"outer": [outer], "inner": [hole]}, type="multipolygon",
        building="residential", building__levels="4",
    )  # fmt: skip
    for k, text in enumerate(_NODES.split()):
        osm.node(-84 + 9.5 * k, -5.5 if k % 2 else 5.5, **_tags_of(text, ";"))
    for k, text in enumerate(_AREAS.split()):
        osm.box(-110 + 20 * k, 75, 15, 12, **_tags_of(text, ";"))
    osm.way([(-40, -100), (40, -100)], natural="coastline")
    osm.write(folder / "quarter.osm")


def write_blocks_cityjson(folder):
    write_blocks(folder / "blocks.json")


_THINGS = """<signals>
<signal id="1" s="20" t="-6" zOffset="2" type="206" dynamic="no"
 orientation="+"/><signal id="2" s="30" t="6" zOffset="4" type="1000001"
 dynamic="yes" orientation="-"/><signal id="3" s="40" t="-1" zOffset="5"
 type="274" dynamic="no"/></signals><objects>
<object id="1" type="building" s="50" t="20" zOffset="0" hdg="0"><outline>
<cornerLocal u="-5" v="-4" z="0" height="9"/>
<cornerLocal u="5" v="-4" z="0" height="8"/>
<cornerLocal u="5" v="4" z="1" height="9"/></outline></object>
<object id="2" type="barrier" s="60" t="-12" zOffset="0"><outlines><outline
 closed="false"><cornerRoad s="60" t="-12" dz="0" height="1"/>
<cornerRoad s="80" t="-12" dz="0" height="1"/>
<cornerRoad s="80" t="-13" dz="0" height="1"/></outline></outlines></object>
<object id="3" type="pole" s="90" t="7" zOffset="0" radius="0.1" height="5"/>
<object id="4" type="crosswalk" s="90" t="0" length="4" width="7"/>
<object id="5" type="barrier" s="0" t="8" zOffset="0" length="0.2" width="0.2"
 height="1"><repeat s="100" length="20" distance="0" tStart="8" tEnd="9"/>
</object><object id="6" type="tree" s="110" t="9" zOffset="0" radius="2"
 height="8"/></objects>"""


def write_network_opendrive(folder):
    """Writes streets about a junction, a bend, a slope, a bridge and things."""
    arc = '<arc curvature="0.025"/>'
    spiral = '<spiral curvStart="0" curvEnd="0.02"/>'
    marks = (
        '<roadMark sOffset="0" type="broken" color="white" width="0.12"/>'
        '<roadMark sOffset="60" type="solid solid" color="yellow"'
        ' width="0.12"/>'
    )
    lanes = (
        section(
            0.0,
            lane(3, "sidewalk", 2.0),
            lane(2, "parking", 2.2),
            lane(1, "driving", 3.5, more=marks),
            lane(-1, "driving", 3.5, (60.0, 3.5, -0.005)),
            lane(-2, "shoulder", (0.0, 1.5), (40.0, 0.0)),
            lane(-3, "sidewalk", 2.0),
        ),
    )
    two = (section(0.0, *TWO_LANES),)
    hill = cubic("elevation", 0, 0.0, 0.0, 0.0, 0.0, "s") + cubic(
        "elevation", 30, 0.0, 0.04, 0.0, 0.0, "s"
    )
    roll = cubic("superelevation", 0, 0.0, 0.001, 0, 0, "s")
    above = cubic("elevation", 0, 7.0, key="s")
    bend = geometry(0.0, 162.0, 0.0, 0.0, 40.0 * np.pi / 2, arc)
    curve = geometry(0.0, -12.0, 0.0, np.pi, 50.0, spiral)
    line = geometry(0.0, 12.0, 0.0, 0.0, 150.0, "<line/>")
    north = geometry(0.0, 0.0, 12.0, np.pi / 2, 100.0, "<line/>")
    write_roads(
        folder / "network.xodr",
        road("1", 150.0, [line], lanes, more=_THINGS),
        road("2", 40.0 * np.pi / 2, [bend], two, lateral=roll),
        straight("3", 202, 40, 202, 160),
        road("4", 50.0, [curve], two),
        road("5", 100.0, [north], two, elevation=hill),
        straight("6", 60, -60, 60, 60, elevation=above, more=(
            '<objects><bridge id="b" s="0" length="120" type="concrete"/>'
            "</objects>"
        )),
        '<junction id="7"/>',
        straight("11", -12, 0, 12, 0, junction="7",
                 lanes=(lane(-1, "driving", 3.5),)),
        straight("12", 12, 0, -12, 0, junction="7",
                 lanes=(lane(-1, "driving", 3.5),)),
        turn("13", 12, 0, np.pi, 12, -np.pi / 2, junction="7"),
        turn("14", 0, 12, -np.pi / 2, 12, np.pi / 2, junction="7"),
    )  # fmt: skip
