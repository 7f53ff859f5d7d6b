"""A full disk gives one line and leaves nothing.

Where the tests run as root the disk is real, a tmpfs of a few kilobytes.
Elsewhere, and in any case, a limit on the size of files makes writes fail.
"""

import resource
import subprocess
import sys

from helpers.bag_recordings import contents, record
from helpers.tiny_drive import tiny_scenario
from mcap.reader import make_reader
import pytest
import yaml

from cns_drake.simulation import simulate
from evaluation.base import InputError

pytestmark = pytest.mark.slow

PAGE = 4096
COMMAND = (sys.executable, "-m", "cns_drake", "simulate")
FAULTS = {"tmpfs": "No space left on device", "limit": "File too large"}


class Tmpfs:
    """A small file system with a file that takes up the rest of it."""

    def __init__(self, folder, pages):
        self.folder = folder
        self._pages = pages
        self.filler = folder / "filler"

    def leave(self, pages):
        self.filler.write_bytes(bytes(PAGE * (self._pages - pages)))


@pytest.fixture(scope="module")
def tmpfs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tmpfs")
    pages = 64
    mount = ["mount", "-t", "tmpfs", "-o", f"size={pages * PAGE}", "tmpfs"]
    try:
        subprocess.run([*mount, folder], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("only root can mount a file system")
    yield Tmpfs(folder, pages)
    subprocess.run(["umount", folder], check=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "drive_01"
    record(folder)
    return contents(folder)


def test_disks_of_any_size(tmpfs, whole):
    needed = sum(-(-len(content) // PAGE) for content in whole.values())
    folder = tmpfs.folder / "drive_01"
    for pages in range(1, needed):
        tmpfs.leave(pages)
        with pytest.raises(InputError, match=FAULTS["tmpfs"]) as error:
            record(folder)
        assert "\n" not in str(error.value)
        assert not folder.exists()
        tmpfs.filler.unlink()
        record(folder)
        assert contents(folder) == whole
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()


def test_limits_of_any_size(tmp_path, whole):
    size = len(whole["drive_01_0.mcap"])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for limit in range(10, size, size // 17):
        folder = tmp_path / str(limit) / "drive_01"
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limits[1]))
        try:
            with pytest.raises(InputError, match=FAULTS["limit"]):
                record(folder)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert not folder.exists()
        record(folder)
        assert contents(folder) == whole


def recorded(folder):
    """Returns files except the one with the path to the world."""
    files = contents(folder)
    del files["scenario.yaml"]
    return files


@pytest.mark.night
@pytest.mark.parametrize("disk", ["tmpfs", "limit"])
def test_a_real_run_ends_in_one_line(tmp_path, request, disk):
    scenario = tiny_scenario(tmp_path)
    file = tmp_path / "tiny_01.yaml"
    file.write_text(yaml.safe_dump(scenario.model_dump(exclude_none=True)))
    simulate(scenario, tmp_path / "whole")
    whole = recorded(tmp_path / "whole" / "tiny_01")
    with (tmp_path / "whole/tiny_01/tiny_01_0.mcap").open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    # The third of four spans of 16 frames begins there.
    start_ns = chunks[0].message_start_time + 32 * 50_000_000
    half = 100 + min(
        chunk.chunk_start_offset
        for chunk in chunks
        if chunk.message_start_time == start_ns
    )
    output = tmp_path
    preexec = None
    if disk == "tmpfs":
        small = request.getfixturevalue("tmpfs")
        small.leave(half // PAGE)
        output = small.folder
    else:

        def preexec():
            resource.setrlimit(resource.RLIMIT_FSIZE, (half, half))

    result = subprocess.run(
        [*COMMAND, file, "--output", output],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=preexec,
    )
    folder = output / "tiny_01"
    assert result.returncode == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    last = result.stderr.splitlines()[-1]
    mcap = folder / "tiny_01_0.mcap"
    assert last == f"cns-drake: error: {mcap}: {FAULTS[disk]}"
    assert not folder.exists()
    if disk == "tmpfs":
        small.filler.unlink()
    simulate(scenario, output)
    assert recorded(folder) == whole
