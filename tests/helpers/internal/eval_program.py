"""Running `cns-eval` in the process of a test, on two small drives."""

import sys
import threading

import numpy as np
import pytest

from evaluation import command_line as cli
from evaluation.base import progress_display
from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.signal_handlers import handlers_kept


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
    """Writes two drives of eight frames, 10 m apart, and their scans."""
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
    """Runs `cns-eval` in this process; returns status, stdout, stderr."""
    return run_program(capsys, "cns-eval", cli.main, *arguments)


def run_program(capture, name, main, *arguments):
    """Runs a program in this process; returns status, stdout, stderr."""
    old = sys.argv
    sys.argv = [name, *map(str, arguments)]
    try:
        with handlers_kept(), pytest.MonkeyPatch.context() as patch:
            # No lines of progress appear, even on a slow machine.
            longest = threading.TIMEOUT_MAX
            patch.setattr(progress_display, "PATIENCE", longest)
            with pytest.raises(SystemExit) as info:
                main()
    finally:
        sys.argv = old
    out, err = capture.readouterr()
    return info.value.code, out, err


def without_world(err):
    """Returns what a command wrote behind its verdict on the world, if any."""
    first, _, rest = err.partition("\n")
    return rest if first.startswith("world: ") else err


def assert_refused(capsys, arguments, *words):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    err = without_world(err)
    assert err.startswith("cns-eval: error: ")
    assert err.count("\n") == 1
    for word in words:
        assert str(word) in err
