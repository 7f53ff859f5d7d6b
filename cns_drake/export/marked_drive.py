"""Reads a recording and marks the points that are absent in another stage."""

from collections import defaultdict
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from cns_drake.base import InputError
from cns_drake.drives import McapDrive, read_scenario
from cns_drake.scenarios import shipped_maps
from cns_drake.scene import (
    MapFolder,
    load_structure_table,
    load_world,
    moving_id,
    structures_in,
)


class MarkedDrive(McapDrive):
    """A recording that marks points on structures absent in another stage.

    A structure is absent if the world of the other stage contains no part of
    the structure. A building that is only lower in the other stage is not
    absent. Points on absent structures get SemanticKITTI's labels of moving
    objects, and all other labels are as recorded. In the structure table,
    absent structures get `"absent_in": <stage>`.
    """

    def __init__(self, path: Path, lidar: str | None, stage: str):
        """Opens a recording and loads the other stage.

        Raises:
            InputError: if the recording cannot be read, was not taken in a
                stage of a map, or has no structures; if the map is missing, has
                other structures by now, or has no such stage.
        """
        super().__init__(path, lidar)
        self._stage = stage
        recorded = super().instances
        if recorded is None:
            raise InputError(f"{path}: has no list of structures")
        folder = self._map_folder()
        self._check_structures(folder.structures, recorded)
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
        recorded = super().instances or {}
        return {
            instance: {**entry, "absent_in": self._stage}
            if instance in self._absent
            else entry
            for instance, entry in recorded.items()
        }

    def scan(self, index: int) -> np.ndarray:
        """Returns the scan with number `index`, with its labels changed.

        The result is a structured array (N,) in the LiDAR's frame, as
        `McapDrive.scan` returns it. The field `label` is uint16.
        """
        recorded = super().scan(index)
        names = recorded.dtype.names or ()
        if not {"label", "instance"} <= set(names):
            raise InputError(
                f"{self._path}: {self._lidar_topic}: scan {index}: no field "
                "label, or no field instance"
            )
        points = recorded.astype(
            [
                (name, np.uint16 if name == "label" else recorded.dtype[name])
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

    def _map_folder(self) -> MapFolder:
        place = (self.scenario or {}).get("map")
        if not isinstance(place, str):
            raise InputError(f"{self._path}: not recorded in a stage of a map")
        if place in shipped_maps():
            return MapFolder(shipped_maps()[place])
        # The recording has the name of the map, and the file beside it the
        # map's folder.
        beside = read_scenario(self._path.parent) or {}
        folder = self._path.parent / str(beside.get("map", place))
        if not folder.is_dir():
            raise InputError(f"{self._path}: map: {folder}: no such folder")
        return MapFolder(folder)

    def _check_structures(
        self, table: Path, recorded: Mapping[int, Mapping]
    ) -> None:
        """Checks that names still belong to the recorded structures."""
        for listed in load_structure_table(table):
            entry = recorded.get(listed.instance, {})
            if (entry.get("name"), entry.get("class")) != (
                listed.name,
                listed.semantic_class,
            ):
                raise InputError(
                    f"{table}: {listed.name}: not the structure "
                    f"{listed.instance} of {self.name}: the map has changed "
                    "since"
                )
