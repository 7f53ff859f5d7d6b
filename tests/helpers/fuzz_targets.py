"""Readers of files, each with valid files to start from."""

import json
from pathlib import Path
import shutil

import numpy as np
import yaml

from cns_drake.export import export_drive
from cns_drake.pictures import load_views
from cns_drake.scenarios import (
    Scenario,
    listed_drives,
    load_scenario,
    plan_drive,
    write_scenarios,
)
from cns_drake.scene import load_world, read_perception_geometry
from cns_drake.sensors import LidarSection, make_pattern
from cns_drake.simulation import scan, simulate
from cns_drake.studies import study_drives
from evaluation import drives
from evaluation.base import Cluster, InputError
from evaluation.base import InputError as ReadingError
from evaluation.clouds import read_cloud
from evaluation.study import Study, load_experiment
from helpers import (
    bent_drive,
    contradictions,
    dataset_folders,
    helipr_drive,
    mulran_drive,
)
from helpers.fuzz_mutations import mutate_osm
from helpers.fuzzing import Target
from helpers.imported_cities import read_city
from helpers.internal.opendrive_fuzzing import read_opendrive, write_opendrive
from helpers.small_city import PLAN, ROADS, STAGES
from helpers.small_cityjson import CityWriter
from helpers.small_map import box_visual, world_text
from helpers.small_osm import write_corner
from worlds.city import load_plan, load_stages, make_city
from worlds.roads import load_road_network, make_lane_path
from worlds.shapes import Route

REFUSALS = (InputError, ReadingError)

_ROUTE = [
    {"road": "north", "direction": "forward", "lane": 1, "start": 5.0},
    {"road": "south", "direction": "forward", "lane": 1, "end": 60.0},
]
_SPEEDS = {
    "cruise": 8.0,
    "longitudinal_acceleration": 1.5,
    "lateral_acceleration": 2.0,
}
_VISUALS = (
    box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (300, 300, 1)),
    box_visual("hall_001/body", (30, 25, 5, 0, 0, 0.3), (20, 12, 10)),
    '<visual name="wedge_001/roof"><pose>5 9 0 0 0 1</pose><geometry><mesh>'
    "<uri>wedge.obj</uri><scale>2 2 2</scale></mesh></geometry><material>"
    "<diffuse>0.5 0.2 0.1 1</diffuse></material></visual>",
    '<visual name="ball"><geometry><sphere><radius>2</radius></sphere>'
    "</geometry></visual>",
    '<visual name="tree_001/trunk"><geometry><cylinder><radius>0.3</radius>'
    "<length>4</length></cylinder></geometry></visual>",
)
_WEDGE = (
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
)
_TABLE = (
    "instance,name,class,label,x,y,z,yaw,tags\n"
    "1,ground,terrain,72,0.0,0.0,0.0,0.0,\n"
    "2,hall_001,building,50,30.0,25.0,0.0,0.3,\n"
    "3,wedge_001,building,50,5.0,9.0,0.0,1.0,\n"
    "4,tree_001,vegetation,70,0.0,0.0,0.0,0.0,\n"
)
_VIEWS = (
    "street: {position: [1, 2, 3], target: [10, 20, 3], fov_y_deg: 60}\n"
    "park: {position: [5.5, 0, 30], target: [0, 0, 0]}\n"
)


def _write_town(folder: Path) -> None:
    """A map with roads, a stage, a table and a drive of its own."""
    (folder / "roads.yaml").write_text(ROADS)
    (folder / "stage_01.sdf").write_text(world_text(_VISUALS))
    (folder / "wedge.obj").write_text(_WEDGE)
    (folder / "structures.csv").write_text(_TABLE)
    (folder / "tour.csv").write_text(
        "x,y,z\n-10,5,0\n40,5,0.5\n40,60,1\n20,90,1\n"
    )
    lidar = {"preset": "vlp-16", "columns": 16, "xyz": [0.1, 0.0, 1.7]}
    drives = {
        "sequence_01": {"map": ".", "stage": "01", "route": _ROUTE},
        "tour": {"world": "stage_01.sdf", "waypoints": "tour.csv"},
    }
    for name, values in drives.items():
        shared = {
            "title": "a tour",
            "speeds": _SPEEDS,
            "lidars": {"lidar": lidar},
            "imu": {"xyz": [-1.0, 0.0, 1.6], "rpy_deg": [0.0, 0.0, 2.0]},
            "frames": 2,
            "seed": 3,
        }
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(values | shared))
    experiment = {
        "maps": str(folder),
        "both": {
            "city": {"missing": {"from": 0.0, "to": 0.5, "count": 2}},
            "route": {"length": 60.0, "seed": [1, 2]},
            "lidars": {"*": {"preset": ["cns", "vlp-16"]}},
        },
        "seeds": [0, 1],
    }
    (folder / "vary.yaml").write_text(yaml.safe_dump(experiment))
    (folder / "views.yaml").write_text(_VIEWS)


def _plan(name: str):
    return lambda folder: plan_drive(load_scenario(folder / f"{name}.yaml"))


def _simulate(folder: Path) -> None:
    """Records a damaged scenario, unless that takes too long."""
    scenario = load_scenario(folder / "sequence_01.yaml")
    if _is_small(scenario):
        simulate(scenario, folder / "out")


def _is_small(scenario: Scenario) -> bool:
    beams = sum(
        len(make_pattern(lidar).d_Sset) for lidar in scenario.lidars.values()
    )
    return beams < 40_000 and (scenario.frames or 1000) < 20


def _vary(folder: Path) -> None:
    experiment = load_experiment(folder / "vary.yaml")
    if len(experiment.conditions) * len(experiment.seeds) < 100:
        run = Study(experiment, folder / "out", "vary.yaml", Cluster(1))
        write_scenarios(study_drives(run), folder / "out" / "scenarios")


def _load_roads(folder: Path) -> None:
    network = load_road_network(folder / "roads.yaml")
    make_lane_path(network, Route.model_validate(_ROUTE), 2.0, "route")
    assert network.areas.carriageway.is_valid


def _list_town(folder: Path) -> None:
    listed_drives([folder])


def _write_city(folder: Path) -> None:
    (folder / "roads.yaml").write_text(ROADS)
    (folder / "city.yaml").write_text(PLAN)
    (folder / "stages.yaml").write_text(STAGES)
    (folder / "views.yaml").write_text(_VIEWS)


def _load_views(folder: Path) -> None:
    for view in load_views(folder / "views.yaml").values():
        view.project(np.eye(3), 96, 54)


def _load_stages(folder: Path) -> None:
    names = ["brick_block_001", "office_001", "tree_001", "tree_002", "rest"]
    stages = load_stages(folder / "stages.yaml", names)
    for stage in stages.stages:
        stages.absent(stage)


def _lay_out(folder: Path) -> None:
    make_city(folder)


def _scan(folder: Path) -> bytes:
    from pydrake.math import RigidTransform

    path = folder / "stage_01.sdf"
    world = load_world(path)
    read_perception_geometry(world.scene_graph.model_inspector())
    points = scan(
        path,
        RigidTransform([0.0, 0.0, 2.0]),
        LidarSection(preset="vlp-16", columns=8),
        output=folder / "out" / "scan.pcd",
    )
    return points.tobytes()


def _write_recording(folder: Path, **options) -> None:
    drive = bent_drive.write_drive(folder / "town_07", **options)
    information = {"version": 8, "storage_identifier": "mcap"}
    (drive / "metadata.yaml").write_text(
        yaml.safe_dump({"rosbag2_bagfile_information": information})
    )


def _read_drive(path: Path):
    """Reads all parts of a drive and returns them."""
    drive = drives.open_drive(path)
    return repr(
        (
            len(drive),
            drive.world_frame,
            drive.stamps_ns.tolist(),
            drive.X_WS.tolist(),
            getattr(drive, "odometry", None),
            getattr(drive, "imu", None),
            drive.scenario,
            drive.instances,
            drive.notes,
            [(scan.dtype, scan.tobytes()) for scan in drive],
        )
    )


def _export(format_name: str):
    def write(folder: Path) -> None:
        drive = bent_drive.write_drive(folder / "rec" / "town_07")
        export_drive(
            drives.open_drive(drive), format_name, folder / format_name
        )
        shutil.rmtree(folder / "rec")

    return write


def _write_clouds(folder: Path) -> None:
    points = dataset_folders.make_points(20)
    dataset_folders.write_pcd(folder / "binary.pcd", points)
    rows = "\n".join(" ".join(map(str, (*p, 0.5))) for p in points.tolist())
    header = (folder / "binary.pcd").read_bytes().split(b"DATA")[0].decode()
    (folder / "text.pcd").write_text(f"{header}DATA ascii\n{rows}\n")
    # LZF may be all literals.
    plain = np.hstack([points, points[:, :1]]).T.astype("<f4").tobytes()
    packed = b"".join(
        bytes([len(plain[k : k + 32]) - 1]) + plain[k : k + 32]
        for k in range(0, len(plain), 32)
    )
    sizes = np.array([len(packed), len(plain)], "<u4").tobytes()
    (folder / "packed.pcd").write_bytes(
        f"{header}DATA binary_compressed\n".encode() + sizes + packed
    )
    for name in ("ascii", "binary_little_endian"):
        head = (
            f"ply\nformat {name} 1.0\nelement vertex 20\nproperty float x\n"
            "property float y\nproperty float z\nend_header\n"
        ).encode()
        text = "\n".join(" ".join(map(str, p)) for p in points.tolist())
        body = text.encode() if name == "ascii" else points.tobytes()
        (folder / f"{name}.ply").write_bytes(head + body)
    (folder / "points.bin").write_bytes(dataset_folders.xyzi(points))
    np.save(folder / "points.npy", points)
    record_type = [("x", "f8"), ("y", "f4"), ("z", "i2"), ("i", "u1")]
    np.save(folder / "records.npy", np.zeros(20, dtype=record_type))


def _read_clouds(folder: Path) -> list[bytes]:
    return [read_cloud(path).tobytes() for path in sorted(folder.glob("*.*"))]


def _write_mulran(folder: Path) -> None:
    mulran_drive.write_drive(folder / "drive")


def _write_helipr(folder: Path) -> None:
    helipr_drive.write_drive(folder / "drive", ("Ouster",))


def _read_subfolder(folder: Path):
    return _read_drive(folder / "drive")


def _write_cityjson(folder: Path) -> None:
    city = CityWriter("2.0")
    city.box("a", 10.0, -5.0, (4.0, 3.0, 2.0), z=0.5)
    city.box("b", 30.0, 8.0, (9.0, 5.0, 6.0), parents=["a"])
    low = {
        "type": "MultiSurface",
        "lod": "1.2",
        "boundaries": [[city.ring([(0, 0, 0), (5, 0, 0), (5, 5, 0)])]],
    }
    place = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [city.vertex(50.0, 5.0, 0.0)],
        "transformationMatrix": np.eye(4).ravel().tolist(),
    }
    solids = {
        "type": "CompositeSolid",
        "lod": "2",
        "boundaries": [[city.box_faces(20.0, 20.0, 0.0, (3.0, 3.0, 3.0))]],
    }
    attributes = {"yearOfConstruction": "1950-03-01", "name": "c"}
    city.add("c", "Building", low, solids, attributes=attributes)
    city.add("tree", "SolitaryVegetationObject", place)
    city.templates = {
        "templates": [{**low, "boundaries": [[[0, 1, 2]]]}],
        "vertices-templates": [[0.0, 0.0, 0.0], [1.0, 0, 0], [0, 0, 2.0]],
    }
    city.write(folder / "city.json")
    whole = city.document()
    head = {**whole, "CityObjects": {}, "vertices": []}
    feature = {**whole, "type": "CityJSONFeature", "id": "a"}
    lines = [json.dumps(one) for one in (head, feature, feature)]
    (folder / "city.city.jsonl").write_text("\n".join(lines))


def _read_cityjson(folder: Path) -> None:
    for name in ("city.json", "city.city.jsonl"):
        read_city(folder / name)


def _write_osm(folder: Path) -> None:
    write_corner(folder / "corner.osm")


def _read_osm(folder: Path) -> None:
    read_city(folder / "corner.osm")


_TOWN = ("roads.yaml", "stage_01.sdf", "structures.csv", "wedge.obj")

TARGETS = (
    Target(
        "scenario", 7, _write_town, ("sequence_01.yaml",),
        _plan("sequence_01"),
    ),
    Target(
        "drive", 0.7, _write_town,
        ("sequence_01.yaml", *_TOWN), _simulate,
    ),
    Target(
        "waypoints", 6, _write_town, ("tour.yaml", "tour.csv"), _plan("tour")
    ),
    Target("family", 2, _write_town, ("vary.yaml", "structures.csv"), _vary),
    Target(
        "world", 3, _write_town,
        ("stage_01.sdf", "structures.csv", "wedge.obj"), _scan,
    ),
    Target("roads", 7, _write_town, ("roads.yaml",), _load_roads),
    Target(
        "listing", 0.5, _write_town, ("sequence_01.yaml", "structures.csv"),
        _list_town,
    ),
    Target("views", 10, _write_city, ("views.yaml",), _load_views),
    Target("stages", 10, _write_city, ("stages.yaml",), _load_stages),
    Target(
        "plan", 12, _write_city, ("city.yaml",),
        lambda folder: load_plan(folder / "city.yaml"),
    ),
    Target("city", 0.3, _write_city, ("city.yaml", "roads.yaml"), _lay_out),
    Target(
        "mcap", 20, _write_recording, ("town_07/*",),
        lambda folder: _read_drive(folder / "town_07"),
        exact=True, only_bytes=True,
    ),
    Target("clouds", 20, _write_clouds, ("*.*",), _read_clouds),
    Target(
        "kitti", 12, _export("kitti"), ("kitti/**/*",),
        lambda folder: _read_drive(folder / "kitti" / "sequences" / "07"),
    ),
    Target(
        "cns", 7, _export("cns"), ("cns/**/*",),
        lambda folder: _read_drive(folder / "cns" / "Town" / "07"),
    ),
    Target("cityjson", 8, _write_cityjson, ("city.*",), _read_cityjson),
    Target(
        "openstreetmap", 8, _write_osm, ("corner.osm",), _read_osm,
        mutate=mutate_osm,
    ),
    Target("opendrive", 8, write_opendrive, ("town.xodr",), read_opendrive),
    # Targets with well-formed parts that contradict each other.
    Target(
        "false recording", 8, _write_recording, ("town_07/*.mcap",),
        lambda folder: _read_drive(folder / "town_07"),
        exact=True, mutate=contradictions.contradict,
    ),
    Target(
        "false cloud", 8, _write_clouds, ("*.*",), _read_clouds, exact=True,
        mutate=contradictions.contradict_cloud,
    ),
    Target(
        "false world", 2, _write_town, ("stage_01.sdf",), _scan, exact=True,
        mutate=contradictions.contradict_size,
    ),
    Target(
        "false kitti", 4, _export("kitti"),
        # A note names the poses.txt that is not read.
        ("kitti/**/*.label", "kitti/**/*.bin", "kitti/poses/*.txt",
         "kitti/**/times.txt"),
        lambda folder: _read_drive(folder / "kitti" / "sequences" / "07"),
        exact=True, mutate=contradictions.contradict_rows,
    ),
    Target("mulran", 6, _write_mulran, ("drive/**/*",), _read_subfolder),
    Target("helipr", 6, _write_helipr, ("drive/**/*",), _read_subfolder),
)  # fmt: skip


def find_target(name: str) -> Target:
    return next(target for target in TARGETS if target.name == name)
