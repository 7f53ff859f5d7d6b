"""The commands on damaged files: a result, or one line and status 2.

As `test_fuzz`, but of whole programs, of which a dozen runs must do.
"""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import shutil
import subprocess

from helpers.fuzz_mutations import mutate
from helpers.fuzz_targets import find_target
from helpers.internal.command_server import CommandServer
import numpy as np
import pytest

pytestmark = [pytest.mark.slow, pytest.mark.night]

_DRAKE = "cns-drake"
_EVALUATION = "cns-eval"
# Name, target whose files are damaged, which of them, words of the command,
# how many runs.
COMMANDS = {
    "simulate": (
        "drive",
        ("sequence_01.yaml", "roads.yaml", "stage_01.sdf", "structures.csv"),
        (_DRAKE, "simulate", "sequence_01.yaml", "--output", "out"),
        2,
    ),
    "vary": (
        "family",
        ("vary.yaml",),
        (_DRAKE, "generate", "--vary", "vary.yaml", "--output", "out"),
        1,
    ),
    "scan": (
        "world",
        ("stage_01.sdf", "wedge.obj"),
        (
            _DRAKE,
            "scan",
            "stage_01.sdf",
            "--output",
            "out/scan.pcd",
            "--pose",
            "0",
            "0",
            "2",
            "0",
            "0",
            "0",
        ),
        2,
    ),
    "list": (
        "listing",
        ("sequence_01.yaml", "roads.yaml"),
        (_DRAKE, "list", "."),
        1,
    ),
    "city": (
        "city",
        ("city.yaml", "roads.yaml", "stages.yaml"),
        (_DRAKE, "city", "--check", "."),
        1,
    ),
    "export": (
        "mcap",
        ("town_07/town_07_0.mcap",),
        (_DRAKE, "export", "town_07", "--format", "kitti", "--output", "out"),
        1,
    ),
    "tcr": (
        "clouds",
        ("*.pcd", "*.ply", "*.npy"),
        (_EVALUATION, "tcr", "{file}", "points.bin", "--json"),
        1,
    ),
    "pr": (
        "kitti",
        ("kitti/**/*.*",),
        (
            _EVALUATION,
            "pr",
            "kitti/sequences/07",
            "kitti/sequences/07",
            "--method",
            "solid",
        ),
        1,
    ),
}
# These print lines of progress before they find the fault.
_PRINT_PROGRESS = ("city", "list")


def damaged_runs():
    """Yields command, number of the run."""
    for command, (_, _, _, count) in COMMANDS.items():
        for number in range(count):
            yield command, number


@pytest.fixture(scope="module")
def runs(tmp_path_factory, request):
    """All runs, two at a time: (command, number) -> folder, result."""
    top = tmp_path_factory.mktemp("commands")
    seed = request.config.option.fuzz_seed
    server = CommandServer(top / "environment")
    with ThreadPoolExecutor(2) as pool:
        results = pool.map(lambda key: run(top, seed, *key), damaged_runs())
        found = dict(zip(damaged_runs(), results, strict=True))
    server.close()
    return found


def run(top: Path, seed: int, command: str, number: int):
    target, patterns, words, _ = COMMANDS[command]
    folder = top / f"{command}_{number}"
    folder.mkdir()
    find_target(target).build(folder)
    (folder / "out").mkdir()
    files = sorted(
        path
        for pattern in patterns
        for path in folder.glob(pattern)
        if path.is_file()
    )
    rng = np.random.default_rng([seed, number, len(command)])
    path = files[int(rng.integers(len(files)))]
    path.write_bytes(mutate(path, path.read_bytes(), rng))
    program, *words = [word.replace("{file}", path.name) for word in words]
    result = subprocess.run(
        [top / "environment" / "bin" / program, *words],
        cwd=folder,
        capture_output=True,
        check=False,
    )
    return folder, result


@pytest.mark.parametrize(("command", "number"), list(damaged_runs()))
def test_a_result_or_one_line_and_status_2(runs, command, number):
    folder, result = runs[command, number]
    errors = result.stderr.decode()
    report = f"{folder}: status {result.returncode}:\n{errors}"
    assert "Traceback" not in errors, report
    if command == "city" and result.returncode == 1:
        # There are no generated files yet: all of them would change.
        assert result.stdout
        return
    assert result.returncode in (0, 2), report
    if result.returncode == 2:
        *progress, line = errors.splitlines()
        program = COMMANDS[command][2][0]
        assert line.startswith(f"{program}: error: "), report
        assert not progress or command in _PRINT_PROGRESS, report
        assert result.stdout == b""
        finished = [
            path
            for path in (folder / "out").rglob("*")
            if path.is_file()
            # The folder's mark, made before the first drive is read.
            and path.name != "export.yaml"
            and ".part" not in str(path.relative_to(folder))
        ]
        assert not finished, report
    shutil.rmtree(folder)
