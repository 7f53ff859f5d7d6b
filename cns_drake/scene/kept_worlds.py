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

_Key = tuple[Path, frozenset[str]]
_kept: dict[_Key, tuple[FileWatch, ParsedWorld]] = {}


def keep_world(sdf: Path, *, without: Collection[str] = ()) -> None:
    """Parses a world, unless it is kept already, for the next `take_world`.

    Small meshes are read as well. No ray is cast: a ray caster may start
    threads, which a forked process lacks.

    Raises:
        InputError: see `load_world`.
    """
    key = _key(sdf, without)
    if key in _kept and _kept[key][0].changed() is None:
        return
    watch = FileWatch()
    referenced_files(sdf, watch)
    world = parse_world(sdf, without=without)
    read_perception_geometry(world.scene_graph.model_inspector())
    _kept.pop(key, None)
    _kept[key] = watch, world
    while len(_kept) > _MOST_KEPT:
        del _kept[next(iter(_kept))]


def take_world(
    sdf: Path,
    *,
    without: Collection[str] = (),
    model_paths: Collection[Path] = (),
) -> ParsedWorld:
    """Returns a parsed world, which is the caller's alone.

    It is a kept one if there is one and its files have not changed since.

    Raises:
        InputError: see `load_world`.
    """
    if not model_paths:
        watch, world = _kept.pop(_key(sdf, without), (None, None))
        if watch is not None and watch.changed() is None:
            assert world is not None
            return world
    return parse_world(sdf, without=without, model_paths=model_paths)


def _key(sdf: Path, without: Collection[str]) -> _Key:
    return sdf.resolve(), frozenset(without)
