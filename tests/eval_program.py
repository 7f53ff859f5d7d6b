"""Running `cns-eval` in the process of a test, on two small drives."""

import sys

from drive_files import make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation import cli


def make_block_scene(seed):
    rng = np.random.default_rng([seed, 5])
    parts = []
    for _ in range(40):
        foot = rng.uniform(-60.0, 60.0, 2)
        size = [*rng.uniform(1.0, 8.0, 2), rng.uniform(2.0, 20.0)]
        parts.append(
            rng.uniform(size=(150, 3)) * size + np.array([*foot, -1.6])
        )
    return np.concatenate(parts)


def write_towns(folder):
    """Writes two drives of eight frames, 10 m apart; and their scans."""
    for name, side in (("town_01", 0.0), ("town_02", 1.0)):
        scans = [make_block_scene(i) - [0.0, side, 0.0] for i in range(8)]
        write_recording(
            folder / name,
            [make_scan(scan) for scan in scans],
            [yaw_pose(10.0 * i, side, 0.0, 0.0) for i in range(8)],
        )
        singles = folder / f"{name}_scans"
        singles.mkdir()
        for i, scan in enumerate(scans[:4]):
            four = np.c_[scan, np.ones(len(scan))].astype(np.float32)
            four.tofile(singles / f"{i:06d}.bin")
        np.save(folder / f"{name}.npy", np.concatenate(scans))


def run(capsys, *arguments):
    """Runs the program in this process; returns status, stdout, stderr."""
    old = sys.argv
    sys.argv = ["cns-eval", *map(str, arguments)]
    try:
        with pytest.raises(SystemExit) as info:
            cli.main()
    finally:
        sys.argv = old
    out, err = capsys.readouterr()
    return info.value.code, out, err


def assert_refused(capsys, arguments, *words):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("cns-eval: error: ")
    assert err.count("\n") == 1
    for word in words:
        assert str(word) in err
