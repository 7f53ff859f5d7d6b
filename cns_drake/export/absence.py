"""Marks the points of a drive on structures that another stage lacks."""

from collections import defaultdict
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from cns_drake.scene import load_world, structures_in
from evaluation.base import InputError
from evaluation.drives import Drive, read_scenario
from worlds.maps import MapFolder, shipped_maps
from worlds.shapes import load_structure_table, moving_id


class Absence:
    """The structures of a drive that are absent in another stage of its map.

    A structure is absent if the world of the other stage contains no part of
    the structure. A building that is only lower in the other stage is not
    absent.
    """

    def __init__(self, drive: Drive, stage: str):
        """Loads the other stage.

        Raises:
            InputError: if the drive was not taken in a stage of a map, or has
                no structures; if the map is missing, has other structures by
                now, or has no such stage.
        """
        self._name, self._stage = drive.name, stage
        recorded = drive.instances
        if recorded is None:
            raise InputError(f"{drive.name}: has no list of structures")
        self._recorded = recorded
        folder = _map_folder(drive)
        _check_structures(folder.structures, drive.name, recorded)
        stages = folder.stages()
        if stage not in stages:
            raise InputError(
                f"{folder.path}: no stage '{stage}'; it has: "
                f"{', '.join(stages) or 'none'}"
            )
        standing = structures_in(load_world(stages[stage]))
        self._absent = {
            instance: entry
            for instance, entry in recorded.items()
            if entry.get("name") not in standing
        }

    @property
    def instances(self) -> Mapping[int, Mapping]:
        """The drive's structures; absent ones have `"absent_in": <stage>`."""
        return {
            instance: {**entry, "absent_in": self._stage}
            if instance in self._absent
            else entry
            for instance, entry in self._recorded.items()
        }

    def marked(self, scan: np.ndarray, index: int) -> np.ndarray:
        """Returns a scan with SemanticKITTI's labels of moving objects.

        Points on absent structures get them; all other labels are as recorded.

        Returns:
            A copy of the scan, with the field `label` as uint16.
        """
        names = scan.dtype.names or ()
        if not {"label", "instance"} <= set(names):
            raise InputError(
                f"{self._name}: scan {index}: no field label, or no field"
                " instance"
            )
        points = scan.astype(
            [
                (name, np.uint16 if name == "label" else scan.dtype[name])
                for name in names
            ]
        )
        for label, instances in self._absent_by_label.items():
            points["label"][np.isin(points["instance"], instances)] = label
        return points

    @cached_property
    def _absent_by_label(self) -> dict[int, list[int]]:
        groups = defaultdict(list)
        for instance, entry in self._absent.items():
            groups[moving_id(entry.get("class", ""))].append(instance)
        return groups


def _map_folder(drive: Drive) -> MapFolder:
    place = (drive.scenario or {}).get("map")
    if not isinstance(place, str):
        raise InputError(f"{drive.name}: not recorded in a stage of a map")
    if place in shipped_maps():
        return MapFolder(shipped_maps()[place])
    # A recording has the name of the map, and the file beside it the map's
    # folder.
    folder = Path()
    for home in sorted({file.parent for file in drive.files}):
        beside = read_scenario(home) or {}
        folder = home / str(beside.get("map", place))
        if folder.is_dir():
            return MapFolder(folder)
    raise InputError(f"{drive.name}: map: {folder}: no such folder")


def _check_structures(
    table: Path, name: str, recorded: Mapping[int, Mapping]
) -> None:
    """Checks that names still belong to the recorded structures of a drive."""
    for listed in load_structure_table(table):
        entry = recorded.get(listed.instance, {})
        if (entry.get("name"), entry.get("class")) != (
            listed.name,
            listed.semantic_class,
        ):
            raise InputError(
                f"{table}: {listed.name}: not the structure {listed.instance}"
                f" of {name}: the map has changed since"
            )
