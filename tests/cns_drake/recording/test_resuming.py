"""Recordings that go on after an interruption at any byte."""

import os

from helpers.bag_recordings import (
    FRAMES,
    TOPICS,
    contents,
    open_bag,
    record,
    write_frame,
)
import numpy as np
import pytest

from cns_drake.base import complete_files
from cns_drake.base.errors import InputError
from cns_drake.recording import topic_chunks
from cns_drake.recording.schedule import frame_stamp_ns


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "drive_01"
    assert record(folder) == 0
    return contents(folder)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "drive_01"
    folder.mkdir()
    return folder


def leave(folder, content):
    for path in folder.iterdir():
        path.unlink()
    (folder / "drive_01_0.mcap.part").write_bytes(content)


@pytest.mark.slow
def test_cut_off_at_any_byte(folder, whole):
    mcap = whole["drive_01_0.mcap"]
    found = []
    for size in [*range(0, len(mcap), 983), len(mcap) - 1, len(mcap)]:
        leave(folder, mcap[:size])
        found.append(record(folder))
        assert contents(folder) == whole
    # Whole chunks, and finally the complete file.
    assert sorted(found) == found
    assert set(found) == {0, 16, 32, 48, FRAMES}


@pytest.mark.slow
def test_damaged_at_any_byte(folder, whole):
    mcap = whole["drive_01_0.mcap"]
    rng = np.random.default_rng(2)
    for _ in range(40):
        damaged = bytearray(mcap)
        damaged[rng.integers(1000, len(mcap))] ^= 1 << rng.integers(8)
        leave(folder, damaged)
        record(folder, overwrite=True)
        assert contents(folder) == whole


def test_interrupted_by_an_exception_in_any_frame(tmp_path, whole):
    for stop in range(0, FRAMES, 7):
        folder = tmp_path / str(stop) / "drive_01"

        def record_until(stop, folder=folder):
            with open_bag(folder) as bag:
                for frame in range(stop):
                    write_frame(bag, frame)
                bag.write("/tf", frame_stamp_ns(stop), b"torn frame", stop)
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            record_until(stop)
        # Even the last second is there, because the file was closed properly.
        assert record(folder) == stop
        assert contents(folder) == whole


def test_interrupted_again_while_frames_are_taken_over(folder, whole):
    leave(folder, whole["drive_01_0.mcap"])

    def take_over_some():
        with open_bag(folder) as bag:
            for message, _ in zip(bag.interrupted(), range(101), strict=False):
                bag.write(*message)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        take_over_some()
    # The first 25 frames were written again, and all 50 are there.
    assert (folder / "drive_01_0.mcap.part").read_bytes() == whole[
        "drive_01_0.mcap"
    ]
    assert record(folder) == FRAMES
    assert contents(folder) == whole


def test_chunks_of_full_size_are_cut_alike(tmp_path, monkeypatch):
    # Each frame has 0.4 MB: spans end by their size, chunks within spans.
    monkeypatch.setattr(topic_chunks, "_MOST_HELD_BYTES", 3_000_000)
    record(tmp_path / "whole" / "drive_01", 20, size=100_000)
    folder = tmp_path / "drive_01"
    folder.mkdir()
    whole = contents(tmp_path / "whole" / "drive_01")
    # Two spans of 30 messages each, and a part of the third one.
    leave(folder, whole["drive_01_0.mcap"][:7_000_000])
    assert record(folder, 20, size=100_000) == 14
    assert contents(folder) == whole


@pytest.mark.parametrize("renamed", range(4))
@pytest.mark.parametrize("overwrite", [False, True])
def test_interrupted_between_the_final_names(
    folder, whole, monkeypatch, renamed, overwrite
):
    if overwrite:
        record(folder, 5)
    replace = os.replace
    left = [renamed]

    def replace_some(*arguments):
        if not left[0]:
            raise KeyboardInterrupt
        left[0] -= 1
        replace(*arguments)

    monkeypatch.setattr(complete_files.os, "replace", replace_some)
    if renamed < 3:
        with pytest.raises(KeyboardInterrupt):
            record(folder, overwrite=overwrite)
        assert not (folder / "metadata.yaml").exists()
    else:
        record(folder, overwrite=overwrite)
    monkeypatch.undo()
    if renamed < 3:
        assert record(folder) == FRAMES
    assert contents(folder) == whole


def test_an_interrupted_recording_of_another_kind_is_kept(folder, whole):
    leave(folder, whole["drive_01_0.mcap"][:5000])
    before = contents(folder)
    with pytest.raises(InputError, match=r"drive_01: .*--overwrite discards"):
        record(folder, title="another")
    assert contents(folder) == before
    assert record(folder, title="another", overwrite=True) == 0


def test_a_file_without_metadata_of_another_kind_is_kept(folder, whole):
    (folder / "drive_01_0.mcap").write_bytes(whole["drive_01_0.mcap"])
    with pytest.raises(InputError, match=r"drive_01: .*--overwrite discards"):
        record(folder, title="another")
    assert (folder / "drive_01_0.mcap").read_bytes() == whole["drive_01_0.mcap"]
    record(folder, title="another", overwrite=True)


@pytest.mark.parametrize(
    "fault",
    [
        {"stamp_ns": frame_stamp_ns(1) + 1},
        {"sequence": 2},
        {"topic": "/tf_static"},
    ],
)
def test_frames_that_are_no_frames_are_not_taken_over(folder, fault):
    message = {
        "topic": "/tf",
        "stamp_ns": frame_stamp_ns(1),
        "data": b"x",
        "sequence": 1,
    }

    def record_strangely():
        with open_bag(folder) as bag:
            write_frame(bag, 0)
            for topic in TOPICS:
                if not topic.latched:
                    bag.write(**message | {"topic": topic.name} | fault)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record_strangely()
    assert record(folder) == 1


def test_a_folder_with_nothing_of_a_recording_is_refused(folder):
    (folder / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"other files, such as 'thesis.tex'"):
        record(folder)


def test_a_repaired_file_beside_the_leftover_does_no_harm(folder, whole):
    leave(folder, whole["drive_01_0.mcap"][:7000])
    (folder / "drive_01_0_repaired.mcap").write_bytes(b"")
    record(folder)
    assert contents(folder) == whole | {"drive_01_0_repaired.mcap": b""}
