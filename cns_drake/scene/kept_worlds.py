"""Worlds that a process parses for the processes that are forked from it.

A study simulates several drives in one stage, and draws it. Parsing a stage and
its meshes takes seconds. A forked process has what was parsed before.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from cns_drake.scene.parsed_world import ParsedWorld, parse_world
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.referenced_files import FileWatch, referenced_files

# Greatest number of worlds that a process keeps.
_MOST_KEPT = 8

# File, structures left out, and whether no more models come.
_Key = tuple[Path, frozenset[str], bool]
_kept: dict[_Key, tuple[FileWatch, ParsedWorld]] = {}


def keep_world(
    sdf: Path, *, without: Collection[str] = (), is_whole: bool = False
) -> ParsedWorld:
    """Parses a world, unless it is kept already, for the next `take_world`.

    Small meshes are read as well.

    Args:
        sdf: the world.
        without: names of structures to leave out.
        is_whole: whether no more models come; the plant is then finalized.

    Returns:
        The kept world.

    Raises:
        InputError: see `load_world`.
    """
    key = _key(sdf, without, is_whole=is_whole)
    if key in _kept and _kept[key][0].changed() is None:
        return _kept[key][1]
    watch = FileWatch()
    referenced_files(sdf, watch)
    world = parse_world(sdf, without=without)
    read_perception_geometry(world.scene_graph.model_inspector())
    if is_whole:
        world.plant.Finalize()
    _kept.pop(key, None)
    _kept[key] = watch, world
    while len(_kept) > _MOST_KEPT:
        del _kept[next(iter(_kept))]
    return world


def take_world(
    sdf: Path,
    *,
    without: Collection[str] = (),
    model_paths: Collection[Path] = (),
    is_whole: bool = False,
) -> ParsedWorld:
    """Returns a parsed world, which is the caller's alone.

    It is a kept one if there is one and its files have not changed since.

    Args:
        sdf: the world.
        without: names of structures to leave out.
        model_paths: see `load_world`.
        is_whole: whether no more models come; the plant may be finalized.

    Raises:
        InputError: see `load_world`.
    """
    # A whole world takes either, and one with more models the other kind.
    for kind in (True, False) if is_whole else (False,):
        key = _key(sdf, without, is_whole=kind)
        if key in _kept and not model_paths:
            watch, world = _kept.pop(key)
            if watch.changed() is None:
                return world
    return parse_world(sdf, without=without, model_paths=model_paths)


def _key(sdf: Path, without: Collection[str], *, is_whole: bool) -> _Key:
    return sdf.resolve(), frozenset(without), is_whole
