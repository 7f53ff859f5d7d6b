"""Finds the recordings in a folder, and the map and stage of each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
import itertools
import os
from pathlib import Path
import re
from typing import Any

from evaluation.base import InputError, listed, natural_key, one_line
from evaluation.drives import (
    NEXT_NS,
    SCENARIO,
    Reading,
    RecordingSource,
    driven_way,
    find_data_sets,
)
from evaluation.study.recordings.map_drives import (
    RecordingInfo,
    scenario_digest,
)

# Names of drives that state map and stage. The first form ends in a date, as in
# NCLT, Boreas and rosbag2; the last form ends in a number, as in MulRan.
_NAME_FORMS = (
    re.compile(r"(?P<map>.*?)[-_]?(?P<stage>\d{4}([-_])\d\d?\3\d\d?(\D.*)?)"),
    re.compile(r"(?P<map>.+)_(?P<stage>[^_]+)"),
    re.compile(r"(?P<map>.*\D)(?P<stage>\d+)"),
)
_UNKNOWN_STAGE = (
    "map and stage are unknown: neither a scenario nor a name <map>_<stage>"
    " states both"
)


def find_recordings(
    folder: Path,
    on_note: Callable[[str], None] = lambda text: None,
    **options: Any,
) -> list[RecordingInfo]:
    """Returns all recordings in a folder and its direct subfolders.

    The recordings can have any format that `evaluation.drives.open_drive`
    reads. Recordings in the layouts of CNS and KITTI are found up to three
    levels down, where exports put them. A recording in the layout of KITTI
    needs a `scenario.yaml`.

    Map and stage of a recording come from its scenario. Without a scenario,
    the name of the recording gives both: `<map>_<stage>`, `<map><stage>` as in
    KAIST01, or `<map>-<date>`. If the name is only a date, as in NCLT, the
    world frame is the map. Recordings without map and stage, and recordings in
    deeper folders, are left out with a note.

    Args:
        folder: the folder.
        on_note: is called with each note on how recordings are read or left
            out.
        options: how all recordings are read: options of `open_drive`.

    Raises:
        InputError: if no recording has a map and a stage, or a recording cannot
            be read.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    paths, reading = _find_drives(folder, on_note), Reading(**options)
    spans: dict[Path, tuple[int, int]] = {}
    placed = {
        path: _recording_info(path, on_note, reading, spans) for path in paths
    }
    _check_no_splits(spans)
    found = [one for one in placed.values() if one is not None]
    if not found:
        raise InputError(f"{paths[0]}: {_UNKNOWN_STAGE}")
    for path, one in placed.items():
        if one is None:
            on_note(f"{path}: left out: {_UNKNOWN_STAGE}")
    return found


def _find_drives(folder: Path, on_note: Callable[[str], None]) -> list[Path]:
    """Returns the paths of the drives in a folder, in natural order.

    Two kinds of drives are left out with a note: drives in KITTI's layout
    without a scenario, and drives that are not directly in the folder, unless
    they have the layout of CNS or KITTI.

    Args:
        folder: the folder, searched three levels down.
    """
    children = listed(folder)
    drives = [path for path in children if _holds_drive(path)]
    nested = [path for path in children if path.is_dir() and path not in drives]
    deeper: list[Path] = []
    below = (path for child in nested for path in _folders_in(child, 2))
    for path in below:
        if _holds_drive(path):
            if any(one.is_nested for one in find_data_sets(path)):
                drives.append(path)
            else:
                deeper.append(path)
    for path in sorted(deeper, key=_natural):
        on_note(
            f"{path}: left out: not directly in {folder}; give its folder, or"
            " move it up"
        )
    if not drives:
        raise InputError(f"{folder}: no recorded drive in it")
    return _with_scenario(sorted(drives, key=_natural), on_note)


def _with_scenario(
    drives: Sequence[Path], on_note: Callable[[str], None]
) -> list[Path]:
    """Leaves out the drives in KITTI's layout that have no scenario.

    Args:
        drives: paths of all drives, at least one.
    """
    unplaced = [
        path
        for path in drives
        if any(one.needs_scenario for one in find_data_sets(path))
        and not (path / SCENARIO).is_file()
    ]
    if not unplaced:
        return list(drives)
    fault = (
        f"{unplaced[0]}: no {SCENARIO}, which states map and stage of a"
        f" drive in KITTI's layout ({len(unplaced)} drives have none)"
    )
    if len(unplaced) == len(drives):
        raise InputError(fault)
    on_note(f"{fault}; left out")
    return [path for path in drives if path not in unplaced]


def _natural(path: Path) -> tuple:
    return natural_key(str(path))


def _folders_in(folder: Path, levels: int) -> Iterator[Path]:
    """Yields the folders in a folder, down to a number of levels."""
    with os.scandir(folder) as entries:
        found = [
            Path(entry)
            for entry in entries
            if entry.is_dir() and not entry.name.startswith(".")
        ]
    for path in found:
        yield path
        if levels > 1:
            yield from _folders_in(path, levels - 1)


def _holds_drive(path: Path) -> bool:
    return bool(find_data_sets(path))


def _check_no_splits(spans: Mapping[Path, tuple[int, int]]) -> None:
    """Refuses files of one recording, which would count as drives."""
    ordered = sorted(spans, key=lambda one: spans[one])
    for before, after in itertools.pairwise(ordered):
        gap_ns = spans[after][0] - spans[before][1]
        if before.parent == after.parent and 0 < gap_ns <= NEXT_NS:
            raise InputError(
                f"{before.parent}: {after.name} continues {before.name}, as"
                " files of one recording do; give each recording a folder of"
                " its own"
            )


def _recording_info(
    path: Path,
    on_note: Callable[[str], None],
    reading: Reading,
    spans: dict[Path, tuple[int, int]],
) -> RecordingInfo | None:
    """Returns a recording; None if its map or stage is unknown.

    Args:
        path: its file or folder.
        on_note: see `find_recordings`.
        reading: how it is read.
        spans: file of a recording -> its first and its last stamp [ns], to
            which those of this one are added if it is a file.
    """
    drive = reading.open(path)
    if path.is_file():
        spans[path] = int(drive.stamps_ns[0]), int(drive.stamps_ns[-1])
    for note in drive.notes:
        on_note(note)
    scenario = drive.scenario or {}
    way = driven_way(scenario)
    is_guessed = not {"map", "stage"} <= set(scenario)
    if not is_guessed:
        map_name = one_line(Path(str(scenario["map"])).name)
        stage = one_line(scenario["stage"])
    else:
        matches = (name.fullmatch(drive.session) for name in _NAME_FORMS)
        match = next(filter(None, matches), None)
        if match is None:
            return None
        map_name = match["map"] or drive.world_frame.partition("/")[0]
        stage = match["stage"]
    return RecordingInfo(
        drive.name,
        path,
        map_name,
        stage,
        way,
        made_by=RecordingSource(path.absolute(), reading),
        lidar_field=drive.lidar_field,
        is_guessed=is_guessed,
        scenario=scenario_digest(scenario),
        world=drive.world,
    )
