"""Opening what is compared: which drives, and in which world they are."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from evaluation.alignment.align import AlignmentReport, align
from evaluation.base import InputError, doing
from evaluation.drives import (
    SHARED_FRAMES,
    Drive,
    PoseSteps,
    Reading,
    check_same_map,
    check_same_world,
)

When = Literal["auto", "always", "never"]

# A pause between two scans is told if it is longer than this [s].
_PAUSE = 10.0
# No vehicle is faster [m/s].
_IN_MILLIMETRES = 1000.0
# The mounts of two LiDARs are told if their heights differ by more [m].
_MOUNT = 0.2
# Drives that are nowhere closer than this have no place in common, and the
# verdict says so [m].
_APART = 200.0


@dataclass(frozen=True)
class WorldVerdict:
    """The world in which drives are compared: the verdict of `open_pair`.

    Attributes:
        shared: whether the poses are in one world as they were recorded; None
            if nothing says so, as of a map's file.
        aligned: whether drives were aligned by their scans.
        why: what says so, in words.
        alignments: a report on each alignment.
    """

    shared: bool | None
    aligned: bool
    why: str
    alignments: tuple[AlignmentReport, ...] = ()

    @property
    def state(self) -> str:
        """The verdict in a word: `aligned`, `shared` or `unknown`."""
        if self.aligned:
            return "aligned"
        return "shared" if self.shared else "unknown"

    @property
    def doubt(self) -> str:
        """What to do if nothing is found where its world says; or ""."""
        if self.state != "shared":
            return ""
        return "; if the poses are not in one world, --align always moves them"

    def to_json(self) -> dict[str, Any]:
        """Returns the verdict, ready for JSON."""
        return {
            "shared": self.shared,
            "aligned": self.aligned,
            "why": self.why,
        }


@dataclass(frozen=True)
class Opened:
    """What is compared, in one world.

    Attributes:
        drives: the drives, and paths of maps, in the given order.
        world: their world.
    """

    drives: list[Drive | Path]
    world: WorldVerdict


def open_pair(
    given: Sequence[Drive | Path | str],
    readings: Sequence[Reading] | None = None,
    when: When = "auto",
    on_note: Callable[[str], None] = lambda text: None,
    *,
    across_maps: bool = False,
) -> Opened:
    """Opens what is compared, and brings it into one world.

    All commands and studies open drives by this function. Drives share a world
    only if something says so: the name of their frame, see
    `evaluation.drives.drive.SHARED_FRAMES`, their format, or the map that their
    scenarios name. Others are aligned by their scans, or refused.

    Args:
        given: the drives, open or as paths, or paths of point clouds. Clouds
            stay as they are, and count as in the world of the first drive.
        readings: how each of them is read.
        when: when all other drives are aligned with the first drive: `auto`
            (only if their worlds differ), `always` or `never`.
        on_note: is called with the verdict, and then with notes on how drives
            were read and aligned.
        across_maps: whether the drives may be from maps with different names.

    Returns:
        The drives and paths of clouds, and the verdict.

    Raises:
        InputError: nothing is given, or it cannot be read; a drive cannot be
            aligned, is of another map or, with `never`, of another world; or a
            cloud should be aligned. The error says how recordings of this
            format get a common world.
    """
    if not given:
        raise InputError("no drive and no cloud is given")
    readings = readings or Reading.each(len(given))
    found = [
        one if isinstance(one, Drive) else reading.open_source(Path(one))
        for one, reading in zip(given, readings, strict=True)
    ]
    places = [i for i, one in enumerate(found) if isinstance(one, Drive)]
    drives = [one for one in found if isinstance(one, Drive)]
    clouds = [one for one in found if not isinstance(one, Drive)]
    lidar = readings[0].lidar
    if lidar is not None and not drives:
        raise InputError(f"--lidar {lidar}: a map file has no LiDARs")
    if when == "always" and clouds:
        raise InputError(f"--align always: {clouds[0]} is no drive, and stays")
    moved = []
    for number, other in enumerate(drives[1:], 1):
        if not across_maps:
            check_same_map(drives[0], other)
        if when == "never":
            check_same_world(drives[0], other, across_maps=True)
        if when == "always" or (
            when == "auto" and drives[0].world != other.world
        ):
            moved.append(number)
    world = _world(drives, clouds, aligned=bool(moved))
    on_note(f"world: {world.why}")
    notes = [text for drive in drives for text in drive.notes]
    notes += _misfits(drives)
    for text in dict.fromkeys(notes):
        on_note(text)
    reports = []
    for number in moved:
        first, other = drives[0], drives[number]
        doing(f"aligning {other.name} to {first.name}")
        pair = align(first, other, hold_first=number > moved[0])
        drives[0], drives[number] = pair.first, pair.second
        reports.append(pair.report)
        on_note(pair.report.to_text())
    for place, drive in zip(places, drives, strict=True):
        found[place] = drive
    whys = [world.why, *(one.to_text() for one in reports)]
    return Opened(
        found,
        replace(world, why="; ".join(whys), alignments=tuple(reports)),
    )


def world_of_frames(
    names: Sequence[str], frames: Sequence[str]
) -> WorldVerdict:
    """Returns the verdict on drives whose worlds have names, see `Drive.world`.

    Args:
        names: names of the drives.
        frames: name of the world of each.
    """
    if len(set(frames)) == 1:
        return WorldVerdict(
            True, False, f"all poses are in {_in_words(frames[0])}"
        )
    listed = "; ".join(
        f"{name} in {_in_words(frame)}"
        for name, frame in zip(names, frames, strict=True)
    )
    return WorldVerdict(
        False, False, f"nothing says that these are one: {listed}"
    )


def _in_words(frame: str) -> str:
    """Returns what the name of a world says of the frame of poses."""
    name, slash, _ = frame.partition("/")
    if frame in SHARED_FRAMES or not slash:
        return f"frame {frame!r}, which drives share"
    return f"frame {name!r} of {frame[len(name) :]}"


def _world(
    drives: Sequence[Drive], clouds: Sequence[Path], *, aligned: bool
) -> WorldVerdict:
    """Returns the verdict on drives and clouds, before they are aligned."""
    if not drives:
        return WorldVerdict(
            None,
            False,
            "maps' files name no frame; their coordinates are compared as"
            " they are",
        )
    found = world_of_frames(
        [one.name for one in drives], [one.world for one in drives]
    )
    if clouds:
        named = ", ".join(str(one) for one in clouds)
        why = (
            f"{named}: names no frame; its coordinates are taken as those of"
            f" {drives[0].name}"
        )
        return WorldVerdict(None, False, f"{why}; {found.why}")
    if aligned:
        return replace(
            found, aligned=True, why=f"{found.why}; aligned by their scans"
        )
    places = "".join(_apart(drives[0], one) for one in drives[1:])
    return replace(found, why=f"{found.why}{places}")


def _misfits(drives: Sequence[Drive]) -> list[str]:
    """Returns notes on pauses of drives, and on mounts that do not fit."""
    notes = []
    for drive in dict.fromkeys(drives):
        steps = PoseSteps.of(drive.stamps_ns, drive.X_WS)
        is_anew = steps.is_jump | (steps.times > _PAUSE)
        if steps.speed > _IN_MILLIMETRES:
            notes.append(
                f"{drive.name}: moves at {steps.speed:.0f} m/s; are the poses"
                " in metres?"
            )
        elif is_anew.any():
            worst = int(np.where(is_anew, steps.moves, -1.0).argmax())
            notes.append(
                f"{drive.name}: after scan {worst}, {steps.times[worst]:.2g} s"
                " without a scan, in which the poses move by"
                f" {steps.moves[worst]:.1f} m; give sessions whose poses begin"
                " anew as drives of their own"
            )
    heights = [
        float(drive.X_BS[2, 3]) for drive in drives if drive.X_BS is not None
    ]
    if len(heights) > 1 and np.ptp(heights) > _MOUNT:
        listed = ", ".join(f"{one:.2f}" for one in heights)
        notes.append(
            f"the LiDARs are mounted at different heights above their vehicles:"
            f" {listed} m"
        )
    return notes


def _apart(first: Drive, second: Drive) -> str:
    """Returns that two drives in one world are nowhere near; "" if they are."""
    p, q = (one.X_WS[:, :2, 3] for one in (first, second))
    low = np.maximum(p.min(axis=0), q.min(axis=0))
    high = np.minimum(p.max(axis=0), q.max(axis=0))
    away = float(np.linalg.norm(np.maximum(low - high, 0.0)))
    if away <= _APART:
        return ""
    return (
        f"; {second.name} is nowhere within {away:.0f} m of {first.name}"
        " (--align always aligns them)"
    )
