"""Measures how far public odometry programs drift on whole drives.

    python tests/benchmarks/lidar_odometry.py DRIVE [PROGRAM ...]
        [--lidar PRESET] [--ride CLASS] [--imu-rate HZ] [--frames N]
        [--output DIR]

DRIVE is recorded once: motion distortion, 10 turns a second, a ride, and an
IMU with the noise of Kalibr's example. Each PROGRAM then reads the recording
through its own loader, as published:

    rko                       RKO-LIO
    kiss                      KISS-ICP
    rko,deskew=false          one of its settings changed
    rko,below=5,nearer=30     without rays more than 5 deg above the horizon,
                              and without returns farther than 30 m

Poses are those of `base_link`. An error is that of the motion over the next
100 m, position alone, from every tenth scan on. Needs `rko-lio`, `kiss-icp`
and `rosbags`. Prints one JSON object for each program:

    median, p90     error over 100 m [m]
    up_100, up_end  how far the car has risen over 100 m, in the median, and
                    at the end [m]
    end             error at the end [m]
"""

import argparse
from collections.abc import Callable
import json
from pathlib import Path
import tempfile
import time

import numpy as np
from rosbags.highlevel import AnyReader
import yaml

from cns_drake.recording import START_NS
from cns_drake.scenarios import (
    Scenario,
    load_scenario,
    make_scenario,
    plan_drive,
)
from cns_drake.simulation import simulate
from evaluation.base import poses
from evaluation.drives import travelled

_TURNS = 10
# Length of the path over which the error of a motion is measured [m].
_SPAN = 100.0
# Number of poses between the starts of two such parts.
_STEP = 10
_ADIS16448 = {
    "accelerometer_noise_density": 0.01,
    "accelerometer_random_walk": 0.0002,
    "gyroscope_noise_density": 0.005,
    "gyroscope_random_walk": 4.0e-06,
}


def record(options: argparse.Namespace, folder: Path) -> tuple[Scenario, Path]:
    """Records a drive, and returns its scenario and its folder."""
    kalibr = folder / "imu.yaml"
    kalibr.write_text(yaml.safe_dump(_ADIS16448))
    values = load_scenario(options.drive).model_dump(
        mode="json", exclude_defaults=True, exclude={"source", "lidars"}
    )
    values["ride"] = {"roughness": options.ride}
    values["imu"] = {"rate": options.imu_rate, "kalibr": str(kalibr)}
    lidar = {"preset": options.lidar, "rate": _TURNS}
    values["lidars"] = {"lidar": lidar | {"motion_distortion": True}}
    if options.frames:
        values["frames"] = options.frames
    scenario = make_scenario(values, options.drive)
    return scenario, simulate(scenario, folder / "recordings").folder


def keep(settings: dict, p: np.ndarray) -> np.ndarray:
    """Returns which of (N, 3) points in the LiDAR's frame a program gets."""
    across = np.hypot(p[:, 0], p[:, 1])
    below = np.degrees(np.arctan2(p[:, 2], across)) <= settings["below"]
    return below & (np.linalg.norm(p, axis=1) < settings["nearer"])


def run_kiss(
    recording: Path, settings: dict, config: dict, scratch: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Returns times [s] of KISS-ICP's poses, and X_WS but for a start."""
    from kiss_icp.datasets.rosbag import RosbagDataset
    from kiss_icp.pipeline import OdometryPipeline

    class Dataset(RosbagDataset):
        def __getitem__(self, index: int) -> tuple[np.ndarray, np.ndarray]:
            points, times = super().__getitem__(index)
            kept = keep(settings, points)
            return points[kept], times[kept]

    file = scratch / "kiss.yaml"
    sections: dict = {"data": {}, "mapping": {}, "registration": {}}
    for key, value in config.items():
        home = "data" if key in {"deskew", "max_range"} else "mapping"
        sections[home][key] = value
    sections["registration"]["max_num_threads"] = 1
    file.write_text(yaml.safe_dump(sections))
    dataset = Dataset(recording, "/lidar/points")
    pipeline = OdometryPipeline(dataset, config=file)
    pipeline._run_pipeline()
    # Deskewed points are in the frame at the end of the scan; others, in the
    # mean, in that at its middle.
    late = 1.0 if config.get("deskew", True) else 0.5
    stamps = np.array(dataset.get_frames_timestamps())
    return stamps + late / _TURNS, pipeline.poses


def run_rko(
    recording: Path, settings: dict, config: dict, scratch: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Returns times [s] of RKO-LIO's poses, and X_WB but for a start."""
    from rko_lio.config import PipelineConfig
    from rko_lio.dataloaders import LidarIMUSequencer
    from rko_lio.dataloaders.rosbag import RosbagDataLoader
    from rko_lio.lio_pipeline import LIOPipeline
    from rko_lio.util import transform_to_quat_xyzw_xyz

    class Loader(RosbagDataLoader):
        def read_point_cloud(self, data: object) -> dict:
            scan = super().read_point_cloud(data)
            kept = keep(settings, scan["scan"])
            for field in ("scan", "timestamps"):
                scan[field] = scan[field][kept]
            return scan

    pipeline_config = PipelineConfig.from_dict(
        {"max_num_threads": 1, "log_dir": scratch} | config
    )
    loader = LidarIMUSequencer(
        Loader(
            recording,
            "/imu/data",
            "/lidar/points",
            None,
            None,
            "base_link",
            pipeline_config.lidar_timestamps,
        )
    )
    X_BI, X_BS = map(transform_to_quat_xyzw_xyz, loader.extrinsics)
    pipeline_config.extrinsic_imu2base_quat_xyzw_xyz = X_BI
    pipeline_config.extrinsic_lidar2base_quat_xyzw_xyz = X_BS
    pipeline = LIOPipeline(pipeline_config)
    for kind, data in loader:
        if kind == "imu":
            pipeline.add_imu(**data)
        else:
            pipeline.register_scan(**data)
    times_ns, rows = pipeline.lio.poses_with_timestamps()
    rows = np.array(rows)
    found = poses.make_pose(
        poses.rotation_from_quaternion(rows[:, 3:]), rows[:, :3]
    )
    return np.array(times_ns) * 1e-9, found


def sensor_pose(recording: Path) -> np.ndarray:
    """Returns X_BS of the LiDAR from the static transforms."""
    with AnyReader([recording]) as bag:
        (connection,) = (c for c in bag.connections if c.topic == "/tf_static")
        _, _, data = next(bag.messages(connections=[connection]))
        message = bag.deserialize(data, connection.msgtype)
    for item in message.transforms:
        if item.child_frame_id == "lidar":
            p, q = item.transform.translation, item.transform.rotation
            R = poses.rotation_from_quaternion(np.array([q.x, q.y, q.z, q.w]))
            return poses.make_pose(R, np.array([p.x, p.y, p.z]))
    raise KeyError("lidar")


def drift(exact: np.ndarray, found: np.ndarray) -> dict:
    """Returns errors [m] of (N, 4, 4) found poses against the exact ones."""
    exact, found = (poses.inverse(X[0]) @ X for X in (exact, found))
    steps = np.linalg.norm(np.diff(exact[:, :3, 3], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    starts = np.arange(0, len(exact), _STEP)
    ends = np.searchsorted(along, along[starts] + _SPAN, "right")
    starts, ends = starts[ends < len(exact)], ends[ends < len(exact)]
    moved, true = (poses.inverse(X[starts]) @ X[ends] for X in (found, exact))
    over = poses.inverse(moved) @ true
    errors = np.linalg.norm(over[:, :3, 3], axis=1)
    off = found[:, :3, 3] - exact[:, :3, 3]
    up = off[:, 2]
    return {
        "length": round(travelled(exact[:, :3, 3])[-1]),
        "median": round(float(np.median(errors)), 2),
        "p90": round(float(np.percentile(errors, 90)), 2),
        "up_100": round(float(np.median(up[ends] - up[starts])), 2),
        "up_end": round(float(up[-1]), 1),
        "end": round(float(np.linalg.norm(off[-1])), 1),
    }


PROGRAMS: dict[str, Callable] = {"kiss": run_kiss, "rko": run_rko}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("drive")
    parser.add_argument("programs", nargs="*", default=["rko"])
    parser.add_argument("--lidar", default="cns")
    parser.add_argument("--ride", default="A")
    parser.add_argument("--imu-rate", type=int, default=400)
    parser.add_argument("--frames", type=int)
    parser.add_argument(
        "--output", help="folder for the recording, which is removed"
    )
    options = parser.parse_args()
    if options.output is not None:
        Path(options.output).mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.output) as scratch:
        scenario, recording = record(options, Path(scratch))
        trajectory = plan_drive(scenario)
        X_BS = sensor_pose(recording)
        for text in options.programs:
            name, *changes = text.split(",")
            pairs = (change.split("=") for change in changes)
            config = {key: yaml.safe_load(value) for key, value in pairs}
            settings = {
                "below": config.pop("below", 90.0),
                "nearer": config.pop("nearer", np.inf),
            }
            begun = time.process_time()
            times, found = PROGRAMS[name](
                recording, settings, config, Path(scratch)
            )
            spent = time.process_time() - begun
            if name == "kiss":
                found = X_BS @ found @ poses.inverse(X_BS)
            times = times - START_NS * 1e-9
            exact = poses.make_pose(*trajectory.poses(times))
            row = {
                "drive": options.drive,
                "lidar": options.lidar,
                "ride": options.ride,
                "program": text,
                "scans": len(found),
                **drift(exact, found),
                "cpu_s": round(spent),
            }
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
