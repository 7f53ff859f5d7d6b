"""Small files that declare much: none costs much memory or time.

Each row of `WAYS` is a way in: the smallest file that was found to stand for
the most, and the reader that gets it. A reader finishes, or refuses the file in
one line that names it, within a limit of memory and of CPU time. The system
enforces both limits, in a process for each row.

A reader that a package's door offers, a data set, a source of maps or a format
of clouds or meshes without a row makes `test_every_reader_has_a_way` fail.
"""

import ast
from collections.abc import Callable
import contextlib
from dataclasses import dataclass
import importlib
import json
import multiprocessing
import os
from pathlib import Path
import re
import resource
import signal
import struct
import sys
import time
import traceback
import zipfile
import zlib

from helpers.door_contract import listed
import numpy as np
import pytest
import zstandard

ROOT = Path(__file__).parents[3]
# A way in is small [bytes].
SMALL = 1_000_000
MEMORY = 1 << 30
CPU_S = 60


@dataclass(frozen=True)
class Way:
    """A way in.

    Attributes:
        readers: names of the readers that get the file.
        make: writes the file into a folder.
        use: reads it.
        place: text that a refusal contains: the file or the field.
        memory: memory beyond that of the libraries [bytes].
    """

    name: str
    readers: tuple[str, ...]
    make: Callable[[Path], object]
    use: Callable[[Path], object]
    place: str
    memory: int = MEMORY


WAYS: dict[str, Way] = {}


def way(name, place, *readers, use, memory=MEMORY):
    """Adds a row; the decorated function writes its file."""

    def add(make):
        assert name not in WAYS
        WAYS[name] = Way(name, readers, make, use, place, memory)
        return make

    return add


def base(name):
    def use(folder):
        import evaluation.base

        (file,) = folder.iterdir()
        return getattr(evaluation.base, name)(file)

    return use


def at_door(door, name, file, *arguments):
    def use(folder):
        module = __import__(door, fromlist=[name])
        return getattr(module, name)(folder / file, *arguments)

    return use


# --- YAML

LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join([f'*{chr(97 + k)}'] * 10)}]\n"
    for k in range(12)
)
# Readers of YAML files of their own; the file is refused before its fields
# count.
YAML = {
    "worlds.city.load_plan": (),
    "worlds.city.load_stages": ((),),
    "worlds.roads.load_road_network": (),
    "cns_drake.scenarios.load_scenario": (),
    "cns_drake.pictures.load_views": (),
    "evaluation.lidar_sheets.read_sheet": (),
    "evaluation.lidar_sheets.find_sheet": (),
    "worlds.ageing.read_rates": (),
    "cns_drake.motion.load_suspension_rates": (),
    "evaluation.study.load_experiment": (),
    "evaluation.base.read_yaml": (),
}


def all_yaml(folder):
    from evaluation.base import InputError

    faults = []
    for reader, arguments in YAML.items():
        door, name = reader.rsplit(".", 1)
        try:
            at_door(door, name, "x.yaml", *arguments)(folder)
        except InputError as error:
            faults.append(str(error))
    assert len(faults) == len(YAML), faults
    raise InputError(max(faults, key=lambda fault: "x.yaml" not in fault))


@way("yaml: aliases of aliases", "x.yaml", *YAML, use=all_yaml)
def _(folder):
    (folder / "x.yaml").write_text(LAUGHS)


@way("yaml: nested", "x.yaml", *YAML, use=all_yaml)
def _(folder):
    (folder / "x.yaml").write_text("a: " + "[" * 200_000)


@way("yaml: merged", "x.yaml", *YAML, use=all_yaml)
def _(folder):
    rows = (f"a{k}: &a{k} {{<<: *a{k - 1}, k{k}: 1}}" for k in range(1, 2000))
    (folder / "x.yaml").write_text("\n".join(["a0: &a0 {k: 1}", *rows]))


for _name, _text in {
    "underscores": "1" + "_" * 200_000 + "x",
    "zeros": "0" * 200_000 + "x",
    "digits": "1" * 200_000,
    "an exponent": "1.0e+" + "9" * 200_000,
}.items():

    @way(
        f"yaml: a word of {_name}", "x.yaml", "evaluation.base.parse_yaml",
        use=base("read_yaml"),
    )  # fmt: skip
    def _(folder, text=_text):
        (folder / "x.yaml").write_text(f"a: {text}\n")


@way(
    "yaml: unknown fields", "x.yaml", "cns_drake.scenarios.load_scenario",
    use=at_door("cns_drake.scenarios", "load_scenario", "x.yaml"),
)  # fmt: skip
def _(folder):
    fields = ", ".join(f"k{k}: 1" for k in range(900))
    copies = ", ".join(f"z{k}: *q" for k in range(500))
    text = f"title: t\nlidars: {{q: &q {{{fields}}}, {copies}}}\n"
    (folder / "x.yaml").write_text(text)


# --- Counts in YAML

FACTORS = {
    "methods": """
methods:
  solid:
    ranges: {from: 1, to: 10000, count: 10000}
    elevations: {from: 1, to: 10000, count: 10000}
""",
    "factors": """
both:
  years: {from: 0, to: 199, count: 200}
  seed: {from: 0, to: 9999, count: 10000}
methods: [solid]
""",
    "seeds": """
both: {seed: {from: 1, to: 2000, count: 2000}}
seeds: {from: 1, to: 10000, count: 10000}
methods: [solid]
""",
    "methods of conditions": """
both: {seed: {from: 1, to: 10000, count: 10000}}
methods: {solid: {ranges: {from: 1, to: 1000, count: 1000}}}
""",
    "spread": "seeds: {from: 1, to: 1000000000, count: 1000000000}\n",
    "cases": "cases:\n"
    + "".join(
        f"  c{k}: {{query: {{seed: {{from: 0, to: 99, count: 100}}}}}}\n"
        for k in range(300)
    )
    + "methods: [solid]\n",
}
for _name, _text in FACTORS.items():

    @way(
        f"experiment: {_name}", "x.yaml", "evaluation.study.load_experiment",
        use=at_door("evaluation.study", "load_experiment", "x.yaml"),
    )  # fmt: skip
    def _(folder, text=_text):
        (folder / "x.yaml").write_text(text)


def parse_changes(folder):
    from evaluation.base import parse_changes

    return parse_changes([(folder / "x.txt").read_text()])


@way(
    "experiment: an option", "both.years", "evaluation.base.parse_changes",
    use=parse_changes,
)  # fmt: skip
def _(folder):
    (folder / "x.txt").write_text(f"both.years={'[' * 100_000}")


SHEETS = {
    "columns": "rings_deg: [[10, -10, 512]]\ncolumns: 100000000\n",
    "rings": "rings_deg: [[10, -10, 1000000000]]\ncolumns: 100\n",
    "period": "pattern: rosette\nperiod: 1.0e+9\n",
}
for _name, _text in SHEETS.items():

    @way(
        f"sheet: {_name}", "x.yaml", "evaluation.lidar_sheets.read_sheet",
        use=at_door("evaluation.lidar_sheets", "read_sheet", "x.yaml"),
    )  # fmt: skip
    def _(folder, text=_text):
        text += "ranges: [1, 100]\nsource: a test\n"
        (folder / "x.yaml").write_text(text)


def lay_out(folder):
    from worlds.city import make_city

    return len(make_city(folder / "m").structures)


CITIES = {
    "far": ("roads", "[100, 10]", "[1.0e+7, 10]"),
    "lanes": ("roads", "lanes: [1, 1]", "lanes: [100000000, 1]"),
    "bounds": ("plan", "[-60, -110, 160, 130]", "[-1.0e7, -1.0e7, 1e7, 1e7]"),
    "scatter": ("plan", "spacing: 8", "spacing: 0.0001"),
    "size": ("plan", "size: [16, 14], height: 20",
             "size: [1.0e+5, 1.0e+5], height: 1.0e+6"),
    "rows": ("plan", "width: [14, 18]", "width: [0.001, 0.001]"),
}  # fmt: skip
for _name, _change in CITIES.items():

    @way(
        f"city: {_name}", "m", "worlds.city.load_plan",
        "worlds.roads.load_road_network", use=lay_out,
    )  # fmt: skip
    def _(folder, change=_change):
        from helpers.small_city import write_small_city

        kind, old, new = change
        world = write_small_city(folder / "m")
        file = world / {"roads": "roads.yaml", "plan": "city.yaml"}[kind]
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new))


def plan(folder):
    from cns_drake.scenarios import load_scenario, plan_drive

    return plan_drive(load_scenario(folder / "x.yaml"))


BOX = (
    '<visual name="v"><geometry><box><size>90 90 1</size></box></geometry>'
    "</visual>"
)
SCENARIOS = {
    "far waypoints": ("way", "40,60", "9e6,900000"),
    "slow": ("scenario", "cruise: 6.0", "cruise: 1.0e-7"),
    "lazy": ("scenario", "acceleration: 1.5", "acceleration: 1.0e-9"),
    "imu": ("scenario", "imu: {}", "imu: {rate: 1.0e+9}"),
    "camera": ("scenario", "cameras: {}",
               "cameras: {c: {width: 100000, height: 100000}}"),
    "cameras": (
        "scenario",
        "cameras: {}",
        "cameras: {"
        + ", ".join(f"c{k}: {{width: 4096, height: 4096}}" for k in range(40))
        + "}",
    ),
    "lidars": (
        "scenario",
        "lidars: {}",
        "lidars: {"
        + ", ".join(f"l{k}: {{preset: os1-128}}" for k in range(400))
        + "}",
    ),
    "traffic": ("scenario", "traffic: {}", "traffic: {vehicles: 2000000000}"),
    "frames": ("scenario", "frames: 2", "frames: 2000000000"),
}  # fmt: skip
for _name, _change in SCENARIOS.items():

    @way(
        f"scenario: {_name}", "x.yaml" if _name != "far waypoints" else "t.csv",
        "cns_drake.scenarios.load_scenario", "worlds.shapes.read_waypoints",
        "worlds.shapes.load_waypoint_path",
        use=plan,
    )  # fmt: skip
    def _(folder, change=_change):
        kind, old, new = change
        way_text = "x,y\n-10,5\n40,5\n40,60\n"
        text = (
            "title: t\nworld: w.sdf\nwaypoints: t.csv\nspeeds: {cruise: 6.0,"
            " longitudinal_acceleration: 1.5, lateral_acceleration: 1.5}\n"
            "imu: {}\ncameras: {}\nlidars: {}\ntraffic: {}\nframes: 2\n"
        )
        assert old in (way_text if kind == "way" else text)
        if kind == "way":
            way_text = way_text.replace(old, new)
        else:
            text = text.replace(old, new)
        for empty in ("imu", "cameras", "lidars", "traffic"):
            text = text.replace(f"{empty}: {{}}\n", "")
        (folder / "w.sdf").write_text(sdf(BOX))
        (folder / "t.csv").write_text(way_text)
        (folder / "x.yaml").write_text(text)


# --- CSV


def read_tables(folder):
    from evaluation.base import read_records, read_rows
    from evaluation.recognition import read_overlaps
    from worlds.shapes import load_structure_table

    file = folder / "x.csv"
    read_rows(file)
    read_records(file, ())
    read_overlaps(file, np.arange(3), np.arange(3))
    return load_structure_table(file)


TABLES = ("evaluation.base.read_rows", "evaluation.base.read_records",
          "evaluation.base.parse_rows", "evaluation.recognition.read_overlaps",
          "worlds.shapes.load_structure_table",
          "worlds.shapes.read_materials")  # fmt: skip


@way("csv: columns", "x.csv", *TABLES, use=read_tables)
def _(folder):
    (folder / "x.csv").write_text("a," * 400_000 + "\n")


@way("csv: an open quote", "x.csv", *TABLES, use=read_tables)
def _(folder):
    (folder / "x.csv").write_text('a\n"' + "x\n" * 200_000)


@way(
    "csv: an instance", "x.csv", *TABLES,
    use=at_door("worlds.shapes", "load_structure_table", "x.csv"),
)  # fmt: skip
def _(folder):
    text = f"instance,name,class\n{10**17},a,building\n"
    (folder / "x.csv").write_text(text)


@way(
    "csv: results of many methods", "x.csv", "evaluation.results.Results",
    use=lambda folder: _results(folder),
)  # fmt: skip
def _(folder):
    (folder / "x.csv").write_text("task,metric\n" + "a,b\n" * 200_000)


def _results(folder):
    from evaluation.results import Results

    return Results.read(folder / "x.csv")


# --- Archives and arrays


def npz(path, *members, size=None):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)


def npy_header(shape, kind="<f4"):
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}"
    text = text.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def weigh(folder):
    from evaluation.methods import make_method

    return make_method("bevplace", {"weights": folder / "w.npz"})


WEIGHTS = (
    "evaluation.base.read_npz",
    "evaluation.methods.make_method",
)


def first_array():
    from evaluation.methods.bevplace import SHAPES

    return next(iter(SHAPES))


for _name, _header in {
    "a shape": npy_header((10**12,)),
    "no size": npy_header((10**15,), "|V0"),
    "objects": npy_header((10,), "|O"),
}.items():

    @way(f"npz: {_name}", "w.npz", *WEIGHTS, use=weigh)
    def _(folder, header=_header):
        npz(folder / "w.npz", (f"{first_array()}.npy", header + bytes(64)))


@way("npz: zeros", "w.npz", *WEIGHTS, use=weigh)
def _(folder):
    data = npy_header((45_000_000,)) + bytes(180_000_000)
    npz(folder / "w.npz", (f"{first_array()}.npy", data))


@way(
    "recorded traffic", "w.npz", "cns_drake.traffic.read_recorded",
    use=at_door("cns_drake.traffic", "read_recorded", "w.npz"),
)  # fmt: skip
def _(folder):
    data = npy_header((5, 1_000_000, 30), "<i2") + bytes(300_000_000)
    npz(folder / "w.npz", ("vehicles.npy", data))


@way("npz: more than declared", "w.npz", *WEIGHTS, use=weigh)
def _(folder):
    import bz2

    packer, zeros = bz2.BZ2Compressor(), bytes(1 << 24)
    data = b"".join(packer.compress(zeros) for _ in range(16)) + packer.flush()
    name = f"{first_array()}.npy".encode()
    head = struct.pack(
        "<HHHHHIIIHH", 46, 0, 12, 0, 33, 0, len(data), 100, len(name), 0
    )
    local = b"PK\x03\x04" + head + name + data
    central = b"PK\x01\x02" + struct.pack("<H", 46) + head
    central += struct.pack("<HHHII", 0, 0, 0, 0, 0) + name
    end = struct.pack("<HHHHIIH", 0, 0, 1, 1, len(central), len(local), 0)
    (folder / "w.npz").write_bytes(local + central + b"PK\x05\x06" + end)


def read_json(folder):
    from evaluation.base import parse_json, read_bytes, value_errors

    file = folder / "x.json"
    with value_errors(file):
        return parse_json(read_bytes(file))


for _name, _text in {
    "nested": '{"a":' * 100_000,
    "closed": "[" * 200_000 + "]" * 200_000,
    "an open string": '"' + '\\"' * 400_000,
    "digits": "1" * 900_000,
}.items():

    @way(
        f"json: {_name}", "x.json", "evaluation.base.parse_json", use=read_json
    )
    def _(folder, text=_text):
        (folder / "x.json").write_text(text)


# --- XML

XML = {"evaluation.base.read_elements": (), "cns_drake.traffic.read_fcd": ()}


def all_xml(folder):
    from cns_drake.traffic import read_fcd
    from evaluation.base import read_elements

    file = folder / "x.xml"
    read_elements(file)
    return read_fcd(file, lambda: lambda places: places)


for _name, _text in {
    "entities": '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;">]>'
    "<a>&b;</a>",
    "nested": "<a>" * 200_000,
    "comments": "<a>" + "<!--" * 200_000,
    "attributes": "<a " + " ".join(f'k{k}=""' for k in range(80_000)) + "/>",
}.items():

    @way(f"xml: {_name}", "x.xml", *XML, use=all_xml)
    def _(folder, text=_text):
        (folder / "x.xml").write_text(text)


# --- Clouds


def cloud(file):
    def use(folder):
        from evaluation.change import map_source
        from evaluation.clouds import read_blocks, read_cloud

        list(read_blocks(folder / file))
        read_cloud(folder / file)
        return map_source(folder / file)

    return use


CLOUDS = ("evaluation.clouds.read_blocks", "evaluation.clouds.read_cloud")


def pcd(fields, sizes, kinds, counts, points, data, body=b""):
    head = (
        f"VERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {kinds}\n"
        f"COUNT {counts}\nWIDTH {points}\nHEIGHT 1\nPOINTS {points}\n"
        f"DATA {data}\n"
    )
    return head.encode() + body


PAD = ("x y z pad", "4 4 4 1", "F F F U")
XYZ = ("x y z", "4 4 4", "F F F", "1 1 1")
for _name, _data in {
    "field": pcd(*PAD, "1 1 1 200000000", 2, "ascii", b"1 2 3 4\n" * 2),
    "field of none": pcd(*PAD, "1 1 1 2000000000", 0, "binary"),
    "points": pcd(*XYZ, 4_000_000_000, "binary", bytes(120)),
    "rows": pcd(*XYZ, 4_000_000_000, "ascii", b"1 2 3\n"),
    "packed": pcd(
        *XYZ, 1 << 28, "binary_compressed",
        struct.pack("<II", 100, (12 << 28) & 0xFFFFFFFF) + bytes(100),
    ),
    "far points": pcd(*XYZ, 2, "ascii", b"-9e6 -9e6 0\n9e6 9e6 9e6\n"),
}.items():  # fmt: skip

    @way(f"pcd: {_name}", "x.pcd", *CLOUDS, "cloud .pcd", use=cloud("x.pcd"))
    def _(folder, data=_data):
        (folder / "x.pcd").write_bytes(data)


PLY = (
    b"ply\nformat %s 1.0\nelement vertex %d\nproperty float x\n"
    b"property float y\nproperty float z\nelement face %d\n"
    b"property list uchar int vertex_indices\nend_header\n"
)
for _name, _data in {
    "points": PLY % (b"binary_little_endian", 10**9, 0) + bytes(120),
    "rows": PLY % (b"ascii", 10**9, 10**9) + b"1 2 3\n",
}.items():

    @way(f"ply: {_name}", "x.ply", *CLOUDS, "cloud .ply", use=cloud("x.ply"))
    def _(folder, data=_data):
        (folder / "x.ply").write_bytes(data)


def labels(folder):
    from evaluation.clouds import read_npy

    return read_npy(folder / "x.npy")


for _name, _header in {
    "a shape": npy_header((10**10, 3)),
    "no size": npy_header((10**10, 3), "|V0"),
    "objects": npy_header((10, 3), "|O"),
}.items():
    for _use in (cloud("x.npy"), labels):

        @way(
            f"npy: {_name}, {'labels' if _use is labels else 'cloud'}",
            "x.npy", *CLOUDS, "cloud .npy", "evaluation.clouds.read_npy",
            "evaluation.map_update.read_labels",
            "evaluation.map_update.read_truth",
            use=_use,
        )  # fmt: skip
        def _(folder, header=_header):
            (folder / "x.npy").write_bytes(header + bytes(64))


@way(
    "bin", "x.bin", *CLOUDS, "cloud .bin",
    use=cloud("x.bin"),
)  # fmt: skip
def _(folder):
    # A length that the disk does not have.
    with open(folder / "x.bin", "wb") as stream:
        stream.truncate(SMALL - 8)


@way(
    "map update", "map.ply", "evaluation.map_update.read_session",
    "evaluation.map_update.read_pair",
    use=at_door("evaluation.map_update", "read_pair", "m"),
)  # fmt: skip
def _(folder):
    for side in "AB":
        (folder / "m" / side).mkdir(parents=True)
        data = PLY % (b"binary_little_endian", 10**9, 0) + bytes(120)
        (folder / "m" / side / "map.ply").write_bytes(data)


# --- Images


def png(width, height, mode=0, rows=9):
    def chunk(kind, data):
        checksum = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + checksum

    packer, row = zlib.compressobj(9), bytes(1 + width * (3 if mode else 1))
    data = b"".join(packer.compress(row) for _ in range(rows))
    head = struct.pack(">IIBBBBB", width, height, 8, mode, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (chunk(b"IHDR", head), chunk(b"IDAT", data + packer.flush()),
         chunk(b"IEND", b""))
    )  # fmt: skip


def show(folder):
    from evaluation.base import to_jpeg, user_errors, value_errors
    from evaluation.results.sections.camera_images import open_image

    file = folder / "x.png"
    with user_errors(file), value_errors(file):
        return to_jpeg(open_image(file.read_bytes()))


@way("image: large", "x.png", use=show)
def _(folder):
    (folder / "x.png").write_bytes(png(9000, 9000, 2))


@way("image: as large as allowed", "x.png", use=show)
def _(folder):
    (folder / "x.png").write_bytes(png(5700, 5700, 2, 5700))


@way("image: declared", "x.png", use=show)
def _(folder):
    (folder / "x.png").write_bytes(png(65_535, 65_535))


# --- Worlds and meshes


def sdf(visuals):
    return (
        '<sdf version="1.9"><world name="w"><model name="m"><static>true'
        f'</static><link name="l">{visuals}</link></model></world></sdf>'
    )


def world(file="w.sdf"):
    def use(folder):
        from cns_drake.scene import load_world, read_perception_geometry

        world = load_world(folder / file)
        return len(
            read_perception_geometry(world.scene_graph.model_inspector())
        )

    return use


WORLDS = ("cns_drake.scene.load_world",
          "cns_drake.scene.read_geometry",
          "cns_drake.scene.read_perception_geometry")  # fmt: skip


@way("sdf: includes of includes", "w.sdf", *WORLDS, "world .sdf", use=world())
def _(folder):
    head = '<sdf version="1.9"><model name="m">'
    text = f'{head}<link name="l">{BOX}</link></model></sdf>'
    for k in range(15):
        (folder / f"m{k}.sdf").write_text(text)
        text = head + "</model></sdf>".join(
            [
                "".join(
                    f"<include><name>i{j}</name><uri>m{k}.sdf</uri></include>"
                    for j in range(4)
                ),
                "",
            ]
        )
    (folder / "w.sdf").write_text(
        '<sdf version="1.9"><world name="w"><include><uri>m14.sdf</uri>'
        "</include></world></sdf>"
    )


def prepared(folder):
    from pydrake.math import RigidTransform

    from cns_drake.ray_casting import RayCastingScene
    from cns_drake.scene import load_world, read_perception_geometry

    world = load_world(folder / "w.sdf")
    inspector = world.scene_graph.model_inspector()
    return RayCastingScene(
        read_perception_geometry(inspector),
        {inspector.world_frame_id(), *world.anchored_frames()},
        lambda frame: RigidTransform(),
    )


@way("sdf: spheres", "w.sdf", *WORLDS, use=prepared)
def _(folder):
    shape = "<geometry><sphere><radius>1</radius></sphere></geometry>"
    text = "".join(
        f'<visual name="{k}"><pose>{9 * k} 0 0 0 0 0</pose>{shape}</visual>'
        for k in range(8000)
    )
    (folder / "w.sdf").write_text(sdf(text))


@way("sdf: one name", "w.sdf", *WORLDS, use=world())
def _(folder):
    (folder / "w.sdf").write_text(sdf(BOX * 6000))


@way("sdf: a long number", "w.sdf", *WORLDS, use=world())
def _(folder):
    number = f"<pose>{'1' * 400_000}x 0 0 0 0 0</pose>"
    text = BOX.replace("<geometry>", f"{number}<geometry>")
    (folder / "w.sdf").write_text(sdf(text))


@way("sdf: a mesh at many scales", "m.obj", *WORLDS, use=world())
def _(folder):
    (folder / "w.sdf").write_text(
        sdf(
            "".join(
                f'<visual name="v{k}"><geometry><mesh><scale>1 1 {1 + k / 7}'
                "</scale><uri>m.obj</uri></mesh></geometry></visual>"
                for k in range(2000)
            )
        )
    )
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 60_000
    (folder / "m.obj").write_text(text)


@way("urdf", "m.obj", *WORLDS, "world .urdf", use=world("w.urdf"))
def _(folder):
    (folder / "w.urdf").write_text(
        '<robot name="r"><link name="l"><visual><geometry><mesh'
        ' filename="m.obj" scale="1e300 1 1"/></geometry></visual></link>'
        "</robot>"
    )
    (folder / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")


def mesh(file):
    def use(folder):
        uri = f"<uri>{file}</uri>"
        (folder / "w.sdf").write_text(
            sdf(
                f'<visual name="v"><geometry><mesh>{uri}</mesh></geometry>'
                "</visual>"
            )
        )
        return world()(folder)

    return use


@way("obj: a polygon", "m.obj", *WORLDS, "mesh .obj", use=mesh("m.obj"))
def _(folder):
    angles = np.linspace(0.0, 6.28, 30_000)
    text = "".join(
        f"v {np.cos(t) * (5 + k % 2):.3f} {np.sin(t) * (5 + k % 2):.3f} 0\n"
        for k, t in enumerate(angles)
    )
    text += f"f {' '.join(map(str, range(1, 30_001)))}\n"
    (folder / "m.obj").write_text(text)


@way("obj: a long number", "m.obj", *WORLDS, "mesh .obj", use=mesh("m.obj"))
def _(folder):
    (folder / "m.obj").write_text(f"v {'1' * 400_000}x 0 0\nf 1 1 1\n")


@way("obj: materials", "m.obj", *WORLDS, "mesh .obj", use=mesh("m.obj"))
def _(folder):
    text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (folder / "m.obj").write_text(text)
    (folder / "m.mtl").write_text(
        "newmtl a\nmap_Kd " + "a" * 200_000 + " b c\n" + "\n" * 200_000
    )


def gltf(nodes, count=3):
    place = {"buffer": 0, "byteLength": 36}
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count,
                       "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [place],
        "buffers": [{"byteLength": 36, "uri": "m.bin"}],
    }  # fmt: skip


_DOUBLED = [{"children": [k + 1, k + 1]} for k in range(32)]
for _ending in (".gltf", ".glb"):
    for _name, _values in {
        "accessor": gltf([{"mesh": 0}], 4_000_000_000),
        "nodes of nodes": gltf([*_DOUBLED, {"mesh": 0}]),
    }.items():

        @way(
            f"glTF: {_name} ({_ending})", f"m{_ending}", *WORLDS,
            f"mesh {_ending}", use=mesh(f"m{_ending}"),
        )  # fmt: skip
        def _(folder, ending=_ending, values=_values):
            triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
            buffer = triangle.tobytes()
            if ending == ".gltf":
                (folder / "m.bin").write_bytes(buffer)
                (folder / "m.gltf").write_text(json.dumps(values))
                return
            values = {**values, "buffers": [{"byteLength": 36}]}
            text = json.dumps(values).encode()
            text += b" " * (-len(text) % 4)
            size = 12 + 8 + len(text) + 8 + len(buffer)
            (folder / "m.glb").write_bytes(
                struct.pack("<4sII", b"glTF", 2, size)
                + struct.pack("<II", len(text), 0x4E4F534A) + text
                + struct.pack("<II", len(buffer), 0x004E4942) + buffer
            )  # fmt: skip


@way("ply: a mesh", "m.ply", *WORLDS, "mesh .ply", use=mesh("m.ply"))
def _(folder):
    data = PLY % (b"binary_little_endian", 4 * 10**8, 4 * 10**8) + bytes(99)
    (folder / "m.ply").write_bytes(data)


@way("stl: facets", "m.stl", *WORLDS, "mesh .stl", use=mesh("m.stl"))
def _(folder):
    data = bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)
    (folder / "m.stl").write_bytes(data)


@way("dae: nodes of nodes", "m.dae", *WORLDS, "mesh .dae", use=mesh("m.dae"))
def _(folder):
    nodes = '<node id="n0"><instance_geometry url="#g"/></node>' + "".join(
        f'<node id="n{k}">{f"""<instance_node url="#n{k - 1}"/>""" * 2}</node>'
        for k in range(1, 33)
    )
    (folder / "m.dae").write_text(
        '<?xml version="1.0"?><COLLADA'
        ' xmlns="http://www.collada.org/2005/11/COLLADASchema"'
        ' version="1.4.1"><asset><unit name="meter" meter="1"/></asset>'
        '<library_geometries><geometry id="g"><mesh><source id="p">'
        '<float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array>'
        '<technique_common><accessor source="#pa" count="3" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/>'
        '<param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
        '<triangles count="1"><input semantic="VERTEX" source="#v"'
        ' offset="0"/><p>0 1 2</p></triangles></mesh></geometry>'
        f"</library_geometries><library_nodes>{nodes}</library_nodes>"
        '<library_visual_scenes><visual_scene id="s"><node id="r">'
        '<instance_node url="#n32"/></node></visual_scene>'
        "</library_visual_scenes><scene>"
        '<instance_visual_scene url="#s"/></scene></COLLADA>'
    )


@way(
    "a mesh of a city", "m.obj", "worlds.shapes.read_mesh",
    use=at_door("worlds.shapes", "read_mesh", "m.obj"),
)  # fmt: skip
def _(folder):
    (folder / "m.obj").write_text("v 1 2 3\n" * 100_000)


# --- Cities of other programs


def imported(file):
    def use(folder):
        from worlds.imports import ImportOptions, import_city

        return import_city(folder / file, folder / "out", ImportOptions())

    return use


def osm_ways(folder, *ways):
    from helpers.small_osm import OsmWriter

    osm = OsmWriter()
    osm.way([(-60, 0), (60, 0)], highway="residential")
    osm.box(10, 10, 20, 20, building="yes")
    for points, tags in ways:
        osm.way(points, **tags)
    osm.write(folder / "x.osm")


FAR = [(0, 30), (4_000_000, 30)]
SQUARE = [(0, 40), (18_000, 40), (18_000, 18_000), (0, 18_000), (0, 40)]
OSM = {
    "tree row": (FAR, {"natural": "tree_row"}),
    "street": (FAR, {"highway": "residential"}),
    "lanes": ([(0, 30), (9, 30)], {"highway": "primary", "lanes": "99999999"}),
    "laps": (SQUARE[:4] * 1500, {"highway": "residential"}),
    "zigzag": (
        [(0.05 * k, 30 + 0.3 * (k % 2)) for k in range(10_000)],
        {"barrier": "wall"},
    ),
    "wood": (SQUARE, {"natural": "wood"}),
    "levels": (
        [(0, 40), (900, 40), (900, 900), (0, 900), (0, 40)],
        {"building": "yes", "building__levels": "900000000"},
    ),
}
for _name, _one in OSM.items():

    @way(
        f"osm: {_name}", "x.osm", "source OpenStreetMap",
        "worlds.imports.import_city", use=imported("x.osm"),
    )  # fmt: skip
    def _(folder, one=_one):
        osm_ways(folder, one)


def varint(number):
    data = bytearray()
    while number > 0x7F:
        data.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*data, number])


def message(*fields):
    """A message of Protocol Buffers: of numbers and bytes, with their keys."""
    return b"".join(
        varint(key << 3) + varint(value)
        if isinstance(value, int)
        else varint(key << 3 | 2) + varint(len(value)) + value
        for key, value in fields
    )


def blob(kind, data, count=1):
    packed = zlib.compress(data, 9)
    body = message((2, len(data)), (3, packed))
    header = message((1, kind), (3, len(body)))
    return (len(header).to_bytes(4, "big") + header + body) * count


# Nodes at one place, each id one more than the last.
_MANY = 8_000_000
_NODES = message(
    (1, message((1, b""))),
    (2, message((2, message((1, b"\x02" * _MANY), (8, bytes(_MANY)),
                            (9, bytes(_MANY)))))),
)  # fmt: skip
_PBF_HEAD = blob(
    b"OSMHeader", message((4, b"OsmSchema-V0.6"), (4, b"DenseNodes"))
)
for _name, _data in {
    "nodes": _PBF_HEAD + blob(b"OSMData", _NODES, 30),
    "a length": _PBF_HEAD
    + struct.pack(">I", 20)
    + message((1, b"OSMData"), (3, 2**62)),
}.items():

    @way(
        f"osm: PBF, {_name}", "x.osm.pbf", "source OpenStreetMap",
        use=imported("x.osm.pbf"),
    )  # fmt: skip
    def _(folder, data=_data):
        (folder / "x.osm.pbf").write_bytes(data)


def city_json(folder, *faces, templates=0):
    from helpers.small_cityjson import CityWriter

    city = CityWriter()
    for number, points in enumerate(faces):
        surface = {
            "type": "MultiSurface", "lod": "2",
            "boundaries": [[city.ring(points)]],
        }  # fmt: skip
        city.add(f"b{number}", "Building", surface)
    if templates:
        shape = {
            "type": "MultiSurface", "lod": "2",
            "boundaries": [[[0, 1, 2]]] * 20_000,
        }  # fmt: skip
        city.templates = {
            "templates": [shape],
            "vertices-templates": [[0, 0, 0], [1, 0, 0], [0, 0, 2.0]],
        }
    for number in range(templates):
        place = {
            "type": "GeometryInstance", "template": 0,
            "boundaries": [city.vertex(number, 5.0, 0.0)],
            "transformationMatrix": np.eye(4).ravel().tolist(),
        }  # fmt: skip
        city.add(f"t{number}", "SolitaryVegetationObject", place)
    city.write(folder / "x.json")


CITYJSON = ("source CityJSON",)


@way("CityJSON: far", "x.json", *CITYJSON, use=imported("x.json"))
def _(folder):
    faces = [
        [(x, x, 0), (x + 50, x, 0), (x + 50, x, 30), (x, x, 30)]
        for x in (0.0, 3e6)
    ]
    city_json(folder, *faces)


@way("CityJSON: one ring", "x.json", *CITYJSON, use=imported("x.json"))
def _(folder):
    laps = [(0, 0, 0), (10, 0, 0), (10, 0, 9), (0, 0, 9), (3, 0, 5)] * 2000
    city_json(folder, laps, [(0, 0, 0), (10, 0, 0), (10, 0, 9)])


@way("CityJSON: templates", "x.json", *CITYJSON, use=imported("x.json"))
def _(folder):
    city_json(folder, templates=2000)


def xodr(folder):
    from helpers.internal.opendrive_fuzzing import read_opendrive

    from evaluation.base import reading

    (folder / "x.xodr").rename(folder / "town.xodr")
    with reading(folder / "town.xodr"):  # As `import_city` does.
        return read_opendrive(folder)


REPEAT = (
    '<objects><object id="1" type="pole" s="0" t="5" zOffset="0" width="1"'
    ' length="1" height="1"><repeat s="0" length="300" distance="0.000001"'
    ' tStart="5" tEnd="5" heightStart="1" heightEnd="1" zOffsetStart="0"'
    ' zOffsetEnd="0"/></object></objects>'
)
for _name, _road in {
    "length": (9e7, ""),
    "repeated": (300.0, REPEAT),
}.items():

    @way(f"OpenDRIVE: {_name}", "town.xodr", "source OpenDRIVE", use=xodr)
    def _(folder, road=_road):
        from helpers.small_opendrive import straight, write_roads

        length, more = road
        one = straight("1", 0, 0, length, 0, more=more)
        write_roads(folder / "x.xodr", one)


# --- Drives


def drive(folder):
    from evaluation.change import map_source
    from evaluation.drives import open_drive

    return map_source(open_drive(folder / "drive"))


DRIVES = (
    "evaluation.alignment.open_pair",
    "evaluation.drives.open_drive",
    "evaluation.study.find_recordings",
)


def chunk(size, level=19):
    data = zstandard.ZstdCompressor(level=level).compress(bytes(size))
    body = struct.pack("<QQQII", 0, 0, size, 0, 4) + b"zstd"
    body += struct.pack("<Q", len(data)) + data
    return b"\x06" + struct.pack("<Q", len(body)) + body


@way("mcap: chunks", ".mcap", *DRIVES, "data set mcap",
     "evaluation.drives.read_stamp", use=drive)  # fmt: skip
def _(folder):
    # Records of a type that nobody reads.
    record = b"\x80" + struct.pack("<Q", (1 << 26) - 9)
    data = zstandard.ZstdCompressor(level=19).compress(
        record + bytes((1 << 26) - 9)
    )
    body = struct.pack("<QQQII", 0, 0, 1 << 26, 0, 4) + b"zstd"
    body += struct.pack("<Q", len(data)) + data
    one = b"\x06" + struct.pack("<Q", len(body)) + body
    magic = b"\x89MCAP0\r\n"
    footer = b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0)
    header = b"\x01" + struct.pack("<QII", 8, 0, 0)
    data = magic + header + one * (900_000 // len(one)) + footer + magic
    (folder / "drive").mkdir()
    (folder / "drive" / "a.mcap").write_bytes(data)


@way("mcap: a chunk", ".mcap", *DRIVES, "data set mcap", use=drive)
def _(folder):
    magic = b"\x89MCAP0\r\n"
    body = struct.pack("<QQQII", 0, 0, 2**62, 0, 4) + b"zstd"
    body += struct.pack("<Q", 8) + bytes(8)
    header = b"\x01" + struct.pack("<QII", 8, 0, 0)
    footer = b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0)
    one = b"\x06" + struct.pack("<Q", len(body)) + body
    (folder / "drive").mkdir()
    (folder / "drive" / "a.mcap").write_bytes(
        magic + header + one + footer + magic
    )


def kitti(folder):
    from evaluation.change import map_source
    from evaluation.drives import open_drive, sample_frames

    path = folder / "kitti" / "sequences" / "07"
    drive = open_drive(path)
    sample_frames(drive.X_WS[:, :3, 3], 0.001)
    return map_source(drive)


@way(
    "kitti: far and late", "07", *DRIVES, "data set kitti odometry",
    "evaluation.drives.read_poses", use=kitti,
)  # fmt: skip
def _(folder):
    scans = folder / "kitti" / "sequences" / "07" / "velodyne"
    scans.mkdir(parents=True)
    (folder / "kitti" / "poses").mkdir()
    points = np.array([[1, 2, 3, 0], [90, 2, 3, 0]], "<f4").tobytes()
    rows = []
    for k, x in enumerate((0.0, 9e6)):
        (scans / f"{k:06d}.bin").write_bytes(points)
        rows.append(f"1 0 0 {x} 0 1 0 0 0 0 1 0\n")
    (folder / "kitti" / "poses" / "07.txt").write_text("".join(rows))
    sequence = scans.parent
    (sequence / "times.txt").write_text("0\n9e8\n")
    (sequence / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")


@way("cns", "drive", *DRIVES, "data set cns",
     "evaluation.drives.read_scenario", use=drive)  # fmt: skip
def _(folder):
    from helpers import bent_drive

    from cns_drake.export import export_drive
    from evaluation import open_drive

    source = bent_drive.write_drive(folder / "rec" / "town_07")
    export_drive(open_drive(source), "cns", folder / "all")
    (one,) = (file.parent for file in folder.rglob("scenario.yaml"))
    one.rename(folder / "drive")
    (folder / "drive" / "scenario.yaml").write_text(LAUGHS)


@way("mulran", "drive", *DRIVES, "data set mulran", use=drive)
def _(folder):
    from helpers import mulran_drive

    mulran_drive.write_drive(folder / "drive")
    table = folder / "drive" / "global_pose.csv"
    lines = table.read_text().splitlines()
    lines[1] = "1," + lines[1].partition(",")[2]
    table.write_text("\n".join(lines))


@way("helipr", "drive", *DRIVES, "data set helipr", use=drive)
def _(folder):
    from helpers import helipr_drive

    stamps = helipr_drive.stamps()
    stamps[-1] = 2**62
    helipr_drive.write_drive(folder / "drive", ("Ouster",), stamps_ns=stamps)


@way(
    "nclt", "drive", *DRIVES, "data set nclt", use=drive,
)  # fmt: skip
def _(folder):
    scans = folder / "drive" / "velodyne_sync"
    scans.mkdir(parents=True)
    rows = []
    for stamp in (10**15, 9 * 10**15):
        (scans / f"{stamp}.bin").write_bytes(bytes(80))
        rows.append(f"{stamp},9e6,1e6,0,0,0,0\n")
    (folder / "drive" / "groundtruth_2012-01-08.csv").write_text("".join(rows))


@way("boreas", "drive", *DRIVES, "data set boreas", use=drive)
def _(folder):
    scans = folder / "drive" / "lidar"
    scans.mkdir(parents=True)
    (folder / "drive" / "applanix").mkdir()
    rows = ["GPSTime,easting,northing,altitude,vel_east,vel_north,vel_up,roll,"
            "pitch,heading,angvel_z,angvel_y,angvel_x\n"]  # fmt: skip
    for stamp in (10**15, 9 * 10**15):
        (scans / f"{stamp}.bin").write_bytes(bytes(240))
        rows.append(f"{stamp},9e6,1e6,0,0,0,0,0,0,0,0,0,0\n")
    path = folder / "drive" / "applanix" / "lidar_poses.csv"
    path.write_text("".join(rows))


# --- The tests

HOUSES = ("cns_drake", "evaluation", "worlds")
# Public names that look like readers, and read no file of a user by themselves.
NO_FILES = {
    "evaluation.base.decode_text": "bytes that are in memory",
    "evaluation.base.import_modules": "modules of this project",
    "evaluation.base.read_bytes": "takes what the file has",
    "evaluation.base.read_text": "takes what the file has",
    "evaluation.base.read_only": "an array",
    "evaluation.base.start_python": "modules of this project",
    "worlds.city.start_city": "reads by load_road_network",
    "worlds.shapes.find_u_turn": "a place",
    "cns_drake.motion.load_car_masses": "a shipped model",
    "cns_drake.pictures.read_drive_page": "takes what the file has",
    "cns_drake.scene.find_bus": "an object",
    "cns_drake.simulation.load_drive": "reads by load_world",
    "cns_drake.simulation.load_stage": "reads by load_world",
    "cns_drake.scenarios.load_scenario_world": "reads by load_world",
    "evaluation.drives.find_data_sets": "names of files alone",
    "evaluation.localisation.read_queries": "an open drive",
    "evaluation.methods.find_method": "a name",
    "evaluation.methods.load_method": "runs the user's program",
    "evaluation.recognition.load_metrics": "runs the user's program",
}
_READER = re.compile("(load|read|open|import|parse|find|decode|start)_")


# Functions that unpack or decode a file whole -> modules that may use them.
# Others go through these modules, which bound what is made.
OPENERS = {
    "zipfile.ZipFile": ("evaluation.base.unpacking",),
    # The package's own archive of shipped cities.
    "tarfile.open": ("worlds.maps.shipped",),
    "gzip.open": (),
    "bz2.open": (),
    "lzma.open": (),
    # Only its header is read.
    "np.load": ("evaluation.clouds.npy_files",),
    "np.lib.format.read_array": ("evaluation.base.unpacking",),
    # Films are made of the program's own pictures.
    "Image.open": (
        "evaluation.results.sections.camera_images",
        "cns_drake.simulation.film",
    ),
    "yaml.load": (),
    "yaml.safe_load": (),
    # After `read_yaml` of the same file.
    "yaml.compose": ("worlds.city.generation.generate",),
    "json.load": (),
    "zlib.decompress": (),
    "zstandard.decompress": ("evaluation.base.unpacking",),
    "zstandard.ZstdDecompressor": (),
    "lz4.frame.decompress": (),
    "lz4.frame.LZ4FrameDecompressor": ("evaluation.base.unpacking",),
    # What another process of this program has sent.
    "pickle.load": ("cns_drake.scene.foreign_meshes",),
    "pickle.loads": (
        "evaluation.base.jobs.processes",
        "evaluation.methods.method_check",
    ),
    "osmium.FileProcessor": ("worlds.imports.openstreetmap.reading",),
    "open3d.io.read_triangle_mesh": ("cns_drake.scene.foreign_meshes",),
    "open3d.io.read_triangle_model": ("cns_drake.scene.foreign_meshes",),
}


def offered_readers():
    """All readers that doors offer, and members of families of readers."""
    from cns_drake.scene import mesh_check
    from evaluation.clouds import cloud_files
    from evaluation.drives import data_sets
    from worlds.imports import map_sources

    found = set()
    for package in HOUSES:
        for door in sorted((ROOT / package).glob("*/__init__.pyi")):
            home = f"{package}.{door.parent.name}"
            names = filter(_READER.match, listed(home))
            found |= {f"{home}.{name}" for name in names}
    found |= {f"data set {name}" for name in data_sets()}
    found |= {f"source {one.title}" for one in map_sources()}
    found |= {f"cloud {ending}" for ending in cloud_files._READERS}
    meshes = {*mesh_check._CHECKS, ".dae", ".obj"}
    found |= {f"mesh {ending}" for ending in meshes}
    return found | {"world .sdf", "world .urdf"}


def test_every_reader_has_a_way():
    offered = offered_readers()
    claimed = {name for one in WAYS.values() for name in one.readers}
    assert offered - claimed - NO_FILES.keys() == set()
    assert (NO_FILES.keys() | claimed) - offered == {
        "evaluation.methods.make_method",
        "evaluation.results.Results",
    }


@pytest.mark.slow
def test_archives_are_opened_in_one_place():
    found = {}
    ends = {name.rpartition(".")[2] for name in OPENERS}
    for path in sorted(
        path for house in HOUSES for path in (ROOT / house).rglob("*.py")
    ):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Attribute) or node.attr not in ends:
                continue
            name = ast.unparse(node)
            if name in OPENERS:
                found.setdefault(name, set()).add(module)
    assert {name: set(some) for name, some in OPENERS.items() if some} == found


@pytest.fixture(scope="module")
def attempts(tmp_path_factory):
    """Yields a function that makes an attempt at a way in, in a process."""
    ours, theirs = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    server = context.Process(target=_serve, args=(theirs,), daemon=True)
    server.start()
    theirs.close()

    def attempt(name):
        ours.send((name, str(tmp_path_factory.mktemp("way"))))
        return ours.recv()

    yield attempt
    ours.close()
    server.join()


@pytest.mark.slow
@pytest.mark.sampled(10)
@pytest.mark.parametrize("name", WAYS)
def test_a_small_file_costs_little(attempts, name):
    size, end, message = attempts(name)
    assert size < SMALL
    assert end in ("finished", "refused"), message
    if end == "refused":
        assert message.isprintable(), message
        assert 0 < len(message) < 2100
        assert WAYS[name].place in message


# Modules that readers import when they are used.
_LIBRARIES = (
    "PIL.Image",
    "evaluation.methods.bevplace",
    "evaluation.results.table",
    "matplotlib.figure",
    "osmium",
    "pyproj",
    "shapely",
)


def _serve(pipe):
    """Makes one attempt after the other: the main function of a process."""
    os.environ["OMP_NUM_THREADS"] = "1"
    sys.path.insert(0, str(ROOT / "tests"))
    # An attempt forks this process, so that it need not import anything.
    for name in offered_readers():
        door, _, reader = name.rpartition(".")
        if " " not in name:
            getattr(importlib.import_module(door), reader)
    for module in _LIBRARIES:
        importlib.import_module(module)
    with contextlib.suppress(EOFError):
        while True:
            name, folder = pipe.recv()
            pipe.send(_attempt(WAYS[name], Path(folder)))


def _attempt(one, folder):
    """Returns the size of a way's file, how the attempt ended, and a text."""
    one.make(folder)
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        answer = ("died", "")
        try:
            answer = _read(one, folder)
        finally:
            os.write(writing, json.dumps(answer).encode())
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        text = stream.read()
    _, status = os.waitpid(child, 0)
    if not text:
        number = os.waitstatus_to_exitcode(status)
        return size, "killed", signal.Signals(-number).name
    return (size, *json.loads(text))


def _read(one, folder):
    """Reads a way's file within its limits; returns how this ended."""
    from evaluation.base import InputError

    os.chdir(folder)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    memory = pages * resource.getpagesize() + one.memory
    seconds = int(time.process_time()) + CPU_S
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        one.use(folder)
    except InputError as error:
        return "refused", str(error)
    except BaseException:
        return "failed", traceback.format_exc()[-2000:]
    return "finished", ""
