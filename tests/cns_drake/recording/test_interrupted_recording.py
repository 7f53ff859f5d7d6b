"""Recordings that are interrupted or killed: whole, or not there."""

import os
import signal

from helpers.bag_recordings import contents, open_bag, record, write_frame
import pytest

from evaluation.base import InputError

MCAP = "drive_01_0.mcap"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "drive_01"
    record(folder)
    return contents(folder)


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "drive_01"


def record_until(folder, stop, **kwargs):
    with open_bag(folder, **kwargs) as bag:
        for frame in range(stop):
            write_frame(bag, frame)
        raise KeyboardInterrupt


@pytest.mark.parametrize("stop", [0, 1, 40])
def test_an_exception_leaves_nothing(folder, stop):
    with pytest.raises(KeyboardInterrupt):
        record_until(folder, stop)
    assert list(folder.parent.iterdir()) == []


def test_an_exception_leaves_an_older_recording(folder, whole):
    record(folder)
    with pytest.raises(KeyboardInterrupt):
        record_until(folder, 5, overwrite=True)
    assert contents(folder) == whole


def in_killed_process(run):
    """Runs a function in a process that must end by being killed."""
    child = os.fork()
    if child == 0:
        try:
            run()
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WTERMSIG(status) == signal.SIGKILL


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("overwrite", [False, True])
def test_a_killed_run_is_replaced(folder, whole, overwrite):
    if overwrite:
        record(folder, 5)
    before = contents(folder) if overwrite else {}

    def run():
        with open_bag(folder, overwrite=overwrite) as bag:
            for frame in range(40):
                write_frame(bag, frame)
            kill()

    in_killed_process(run)
    left = contents(folder)
    assert before.items() <= left.items()
    (draft,) = left.keys() - before
    assert draft.endswith(".part")
    record(folder, overwrite=overwrite)
    assert contents(folder) == whole


@pytest.mark.slow
@pytest.mark.parametrize("renamed", range(3))
@pytest.mark.parametrize("overwrite", [False, True])
def test_killed_between_the_final_names(folder, whole, renamed, overwrite):
    if overwrite:
        record(folder, 5)
    replace = os.replace
    left = [renamed]

    def replace_some(*arguments):
        if not left[0]:
            kill()
        left[0] -= 1
        replace(*arguments)

    def run():
        os.replace = replace_some
        record(folder, overwrite=overwrite)

    in_killed_process(run)
    # No reader takes it for a recording, and no --overwrite is needed.
    assert not (folder / MCAP).exists()
    record(folder)
    assert contents(folder) == whole


def test_one_writer_at_a_time(folder):
    with open_bag(folder) as bag:
        write_frame(bag, 0)
        with (
            pytest.raises(InputError, match=r"drive_01: another process is"),
            open_bag(folder),
        ):
            pytest.fail("the context must not open")
        write_frame(bag, 1)
    assert (folder / MCAP).is_file()


def test_an_mcap_file_without_metadata_is_kept(folder):
    folder.mkdir()
    (folder / MCAP).write_bytes(b"of another program")
    with pytest.raises(
        InputError, match=r"drive_01: .*replace it by --overwrite"
    ):
        record(folder)
    assert (folder / MCAP).read_bytes() == b"of another program"
    record(folder, overwrite=True)


def test_a_folder_with_nothing_of_a_recording_is_refused(folder):
    folder.mkdir()
    (folder / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"other files, such as 'thesis.tex'"):
        record(folder)
    assert [path.name for path in folder.iterdir()] == ["thesis.tex"]
