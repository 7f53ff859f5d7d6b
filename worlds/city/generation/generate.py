"""Writes the generated files of a city, or compares them with the folder."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
import os
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
import yaml

from evaluation.base import (
    InputError,
    MarkedYamlLoader,
    doing,
    read_bytes,
    read_records,
    read_yaml,
    to_number,
    user_errors,
    write_text,
)
from worlds.city.generation.city_structures import City, make_city
from worlds.city.generation.rendering import render_city
from worlds.maps import MESH_FOLDER, STAGES_NAME, stage_name
from worlds.shapes import STRUCTURES_NAME, Structure


def generate_city(
    world: Path | str,
    progress: Callable[[str], None] = lambda line: None,
    *,
    repair_stages: bool = False,
) -> list[Path]:
    """Writes all generated files of a map's folder, and returns their paths.

    The same inputs give the same bytes. Each file is replaced atomically.
    Stages and meshes of an earlier run that no longer belong to the city are
    removed. Other files are neither removed nor replaced.

    Args:
        world: the folder.
        progress: called with messages of one line on the progress.
        repair_stages: whether to update the names in `stages.yaml`, if
            structures at the same place have other names now than in
            `structures.csv`.

    Raises:
        InputError: if an input cannot be used or a file cannot be written; if a
            file that no earlier run wrote has the name of a generated file; if
            a structure in `stages.yaml` has another name now and
            `repair_stages` is false; or if a structure in `stages.yaml` no
            longer exists.

    Example:
        from worlds import generate_city

        generate_city("maps/my_town")  # with roads.yaml, city.yaml, stages.yaml
    """
    world = Path(world)
    if (world / MESH_FOLDER).is_symlink():
        # The linked folder may belong to another map.
        raise InputError(f"{world / MESH_FOLDER}: a link instead of a folder")
    files = _rendered_files(world, progress, repair_stages)
    doing("writing the stages")
    with user_errors(world / MESH_FOLDER):
        (world / MESH_FOLDER).mkdir(exist_ok=True)
    for name, content in files.items():
        write_text(world / name, content)
    for path in _generated_files(world) - {world / name for name in files}:
        with user_errors(path):
            path.unlink()
    return [world / name for name in files if name != STAGES_NAME]


def _rendered_files(
    world: Path, progress: Callable[[str], None], repair_stages: bool
) -> dict[str, str]:
    """Returns the text of every file to write, by relative path.

    Raises:
        InputError: see `generate_city`.
    """
    doing("laying out the city")
    city = make_city(world)
    text = _stages_text(world, city, repair_stages, progress)
    files = render_city(world, city, progress, text)
    earlier = _generated_files(world)
    for name, content in files.items():
        path = world / name
        # A run that was interrupted had not written the stages.
        is_equal = _has_text(path, content) and not path.is_symlink()
        if os.path.lexists(path) and path not in earlier and not is_equal:
            raise InputError(
                f"{path}: no earlier run wrote it; move it to another folder"
            )
    return files if text is None else {STAGES_NAME: text, **files}


def _stages_text(
    world: Path, city: City, repair: bool, progress: Callable[[str], None]
) -> str | None:
    """Returns the new text of `stages.yaml`, or None if it stays the same.

    Raises:
        InputError: see `generate_city`.
    """
    stages, table = world / STAGES_NAME, world / STRUCTURES_NAME
    if not table.exists() and not repair:
        return None
    try:
        found = _find_renaming(stages, table, city.structures)
    except InputError:
        if repair:
            raise
        # A faulty table is written anew anyway, and faulty stages are reported
        # later.
        return None
    if not repair:
        for old, new in found.renamed.items():
            raise InputError(
                f"{stages}: {old} is {new} now, and {len(found.renamed) - 1} "
                "more have other names; --repair-stages writes the new names "
                f"(if they are there already, remove {STRUCTURES_NAME})"
            )
        return None
    for old, new in found.renamed.items():
        progress(f"{old} is {new} now")
    for name in found.lost:
        progress(f"{name} has no counterpart")
    for pattern in found.unclear:
        progress(f"{pattern} matches other structures than before")
    if found.lost:
        raise InputError(
            f"{stages}: {len(found.lost)} structure(s) have no counterpart, "
            f"such as {found.lost[0]}; take them out, then repair again"
        )
    return _renamed_text(stages, found.renamed) if found.renamed else None


def differing_files(
    world: Path,
    progress: Callable[[str], None] = lambda line: None,
    *,
    repair_stages: bool = False,
) -> list[Path]:
    """Returns the files that `generate_city` would change, without writing.

    The arguments are the same as those of `generate_city`.
    """
    world = Path(world)
    files = _rendered_files(world, progress, repair_stages)
    stale = _generated_files(world) - {world / name for name in files}
    changed = {
        world / name
        for name, text in files.items()
        if not _has_text(world / name, text)
    }
    return sorted(stale | changed)


def _has_text(path: Path, text: str) -> bool:
    """Returns whether a path is a file with exactly this text."""
    with user_errors(path):
        return path.is_file() and path.read_bytes() == text.encode()


def _generated_files(world: Path) -> set[Path]:
    """Returns the files in a world folder that an earlier run wrote.

    These are stages that state so, the meshes that they name, and the table.
    """
    found: set[Path] = set()
    for stage in world.glob(stage_name("*")):
        if stage.is_symlink() or not stage.is_file():
            continue
        with user_errors(stage):
            text = stage.read_bytes()
        if _MARK in text[:_MARKED]:
            names = map(bytes.decode, _MESH.findall(text))
            found |= {stage, *(world / MESH_FOLDER / name for name in names)}
    if found:
        found.add(world / STRUCTURES_NAME)
    return {path for path in found if path.is_file()}


# What a generated stage contains among its first bytes.
_MARK = b"<!-- Generated by cns-drake city "
_MARKED = 200
_MESH = re.compile(rb"<uri>%s/([\w.-]+\.obj)</uri>" % MESH_FOLDER.encode())


# A structure that has moved farther than this counts as a new one [m].
_SAME_PLACE = 0.3
_COLUMNS = ("name", "class", "x", "y", "tags")


class _Renaming(NamedTuple):
    """How the names in `stages.yaml` must change after a change of the city.

    Attributes:
        renamed: old name -> new name, for each structure that is still at the
            same place but has another name now.
        lost: names of structures that no longer exist at their place, even if
            another structure now has this name.
        unclear: patterns that match different structures than before.
    """

    renamed: dict[str, str]
    lost: list[str]
    unclear: list[str]


class _Row(NamedTuple):
    name: str
    semantic_class: str
    xy: tuple[float, float]
    tags: str

    @property
    def stem(self) -> str:
        return re.sub(r"_\d+$", "", self.name)


def _find_renaming(
    stages: Path, table: Path, structures: Sequence[Structure]
) -> _Renaming:
    """Returns how names in `stages.yaml` must change for the current city.

    A structure of the earlier city and a structure of the current city count as
    the same structure if both are of the same kind and at the same place.

    Args:
        stages: the file `stages.yaml`.
        table: the file `structures.csv` of the earlier city, for which `stages`
            was written.
        structures: the structures of the current city.

    Raises:
        InputError: a file cannot be read.
    """
    before = {row.name: row for row in _read_rows(table)}
    today = [
        _Row(one.name, one.semantic_class, one.xyz[:2], " ".join(one.tags))
        for one in structures
    ]
    successor = _successors(list(before.values()), today)
    names = {row.name for row in today}
    renamed: dict[str, str] = {}
    lost: list[str] = []
    unclear: list[str] = []
    for name in dict.fromkeys(node.value for node in _name_nodes(stages)):
        if "*" in name or "?" in name:
            if _has_changed(name, before, names, successor):
                unclear.append(name)
        elif name not in before:
            # The name is new or misspelt. Generating the stages reports
            # misspelt names.
            continue
        elif name not in successor:
            lost.append(name)
        elif successor[name] != name:
            renamed[name] = successor[name]
    return _Renaming(renamed, lost, unclear)


def _renamed_text(stages: Path, renamed: Mapping[str, str]) -> str:
    """Returns the text of `stages.yaml` with structures renamed.

    Comments and order stay unchanged. `renamed` maps old names to new names.

    Raises:
        InputError: the file cannot be read.
    """
    text = _read_text(stages)
    nodes = _name_nodes(stages)
    for node in sorted(nodes, key=lambda node: -node.start_mark.index):
        if node.value in renamed:
            start, end = node.start_mark.index, node.end_mark.index
            # The scalar may have an anchor in front of it.
            head, _, tail = text[start:end].rpartition(node.value)
            new = head + renamed[node.value] + tail
            text = text[:start] + new + text[end:]
    return text


def _read_text(path: Path) -> str:
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8") from error


def _name_nodes(path: Path) -> list[yaml.ScalarNode]:
    """Returns the YAML scalars in a file of stages that name structures."""
    read_yaml(path)  # Errors in one line.
    # Only this slower loader records where in the text a node is.
    root = yaml.compose(_read_text(path), MarkedYamlLoader)
    lists = [
        node
        for _, stage in _items(root, "stages")
        for node in (
            *(group for _, group in _items(stage, "absent")),
            *(
                part
                for kind in ("lower", "sites")
                for _, growth in _items(stage, kind)
                for key, part in _pairs(growth)
                if key in ("structures", "but")
            ),
        )
    ]
    lists += [node for _, node in _items(root, "lots")]
    # A node that aliases refer to several times is replaced only once.
    scalars = {
        id(node): node
        for group in lists
        if isinstance(group, yaml.SequenceNode)
        for node in group.value
        if isinstance(node, yaml.ScalarNode)
    }
    return list(scalars.values())


def _items(node: yaml.Node | None, key: str) -> list[tuple[str, yaml.Node]]:
    """Returns key and value of each pair in the mapping under a key."""
    return [
        pair
        for name, value in _pairs(node)
        if name == key
        for pair in _pairs(value)
    ]


def _pairs(node: yaml.Node | None) -> list[tuple[str, yaml.Node]]:
    """Returns the pairs of a mapping, and pairs that `<<` merges into it."""
    if not isinstance(node, yaml.MappingNode):
        return []
    pairs = []
    for key, value in node.value:
        if key.value == "<<":
            merged = (
                value.value if isinstance(value, yaml.SequenceNode) else [value]
            )
            pairs += [pair for part in merged for pair in _pairs(part)]
        else:
            pairs.append((key.value, value))
    return pairs


def _has_changed(
    pattern: str,
    before: Iterable[str],
    today: Iterable[str],
    successor: Mapping[str, str],
) -> bool:
    """Returns whether a pattern now matches other structures than before.

    Structures that are new or lost do not count.
    """
    meant = {
        successor[name]
        for name in before
        if name in successor and fnmatchcase(name, pattern)
    }
    known = set(successor.values())
    return meant != {
        name for name in today if name in known and fnmatchcase(name, pattern)
    }


def _read_rows(table: Path) -> list[_Row]:
    rows = []
    for line, row in read_records(table, _COLUMNS):
        xy = to_number(row["x"]), to_number(row["y"])
        if not np.isfinite(xy).all():
            raise InputError(f"{table}: line {line}: no finite x and y")
        rows.append(_Row(row["name"], row["class"], xy, row["tags"]))
    return rows


def _successors(
    before: Sequence[_Row], today: Sequence[_Row]
) -> dict[str, str]:
    """Maps old names to new names of structures that have not moved."""
    if not before or not today:
        return {}
    tree = cKDTree([row.xy for row in today])
    pairs = []
    for row in before:
        for k in tree.query_ball_point(row.xy, _SAME_PLACE):
            other = today[k]
            # Usually there is one structure of a kind at a place. If there are
            # two, such as the grounds of two districts, their names decide.
            if (
                row.stem == other.stem
                and row.semantic_class == other.semantic_class
            ):
                gap = float(np.hypot(*np.subtract(row.xy, other.xy)))
                unlike = (row.name != other.name, row.tags != other.tags)
                pairs.append((gap > 0.01, unlike, gap, row.name, other.name))
    found: dict[str, str] = {}
    taken: set[str] = set()
    for *_, old, new in sorted(pairs):
        if old not in found and new not in taken:
            found[old] = new
            taken.add(new)
    return found
