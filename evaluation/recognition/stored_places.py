"""Places whose descriptors are read from files, some drives at a time."""

from collections.abc import Callable, Sequence
from dataclasses import replace
import itertools
from typing import Any

import numpy as np

from evaluation.recognition.descriptors import DescribedScans, DriveDescriptors

# Greatest size of the descriptors that are in memory at a time [bytes].
MOST_BYTES = 400_000_000


class StoredDrives:
    """Described drives that are read again whenever they are needed.

    Successive drives form a group. Only the drives of one group are in memory.
    Each drive is read only once if you use the drives in order. A drive that is
    too large for the memory is a group of its own, whose places are read in
    several shares.

    Attributes:
        group_of: (N,) non-decreasing, the group of each drive.
        shares: number of shares of each group.
    """

    def __init__(
        self,
        readers: Sequence[Callable[[], DriveDescriptors]],
        sizes: Sequence[float],
        most_bytes: float,
    ):
        """Divides drives into groups.

        Args:
            readers: a function for each of N drives, which reads it.
            sizes: (N,) size of each drive in memory [bytes].
            most_bytes: greatest size of a group of several drives, and of a
                share.
        """
        self._readers = readers
        self._held: dict[int, DriveDescriptors] = {}
        self._names: dict[int, str] = {}
        groups: list[int] = []
        group, held = 0, 0.0
        for size in sizes:
            if held > 0.0 and held + size > most_bytes:
                group, held = group + 1, 0.0
            held += size
            groups.append(group)
        self.group_of = np.array(groups, np.int64)
        held_by_group = np.bincount(self.group_of, sizes)
        self.shares = np.maximum(np.ceil(held_by_group / most_bytes), 1).astype(
            np.int64
        )

    def drive(self, number: int) -> DriveDescriptors:
        """Returns a drive; drives of other groups leave the memory."""
        group = self.group_of[number]
        if any(self.group_of[place] != group for place in self._held):
            self._held = {}
        if number not in self._held:
            self._held[number] = self._readers[number]()
            self._names[number] = self._held[number].name
        return self._held[number]

    def name(self, number: int) -> str:
        """Returns the name of a drive that has been read."""
        return self._names[number]

    def described(
        self, places: DescribedScans, drive_of: np.ndarray, rows: np.ndarray
    ) -> DescribedScans:
        """Returns places with their descriptors, and with clouds if kept.

        If the places are of several groups, their descriptors are read only
        when they are used, and there are no clouds.

        Args:
            places: D places of these drives without descriptors.
            drive_of: (D,) number of the drive of each place, non-decreasing.
            rows: (D,) number of each place among the places of its drive.
        """
        stored = StoredDescriptors(self, drive_of, rows)
        # The descriptors of several groups do not fit into memory together, so
        # that a search reads one group after the other. Clouds would fit even
        # less; only a method's second stage needs them.
        if len(stored.groups) > 1:
            return replace(places, descriptors=stored)
        kept = [self.drive(k).places.clouds for k in drive_of.tolist()]
        clouds = []
        # Either each place has a cloud, or none has.
        if all(kept):
            clouds = [
                of_drive[row]
                for of_drive, row in zip(kept, rows.tolist(), strict=True)
            ]
        return replace(places, descriptors=stored[:], clouds=clouds)

    def undescribed(self, number: int) -> DescribedScans:
        """Returns the places of a drive, without descriptors and clouds."""
        return self.drive(number).places.positions_only


class StoredDescriptors(Sequence[Any]):
    """The descriptors of D places of stored drives, as a sequence.

    Read the sequence in order: reading a place of another group replaces the
    group in memory.
    """

    def __init__(
        self, drives: StoredDrives, drive_of: np.ndarray, rows: np.ndarray
    ):
        """Chooses places.

        Args:
            drives: the drives.
            drive_of: (D,) number of the drive of each place, non-decreasing.
            rows: (D,) number of each place among the places of its drive.
        """
        self._drives = drives
        self._drive_of = drive_of
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        drive = self._drives.drive(int(self._drive_of[index]))
        return drive.places.descriptors[self._rows[index]]

    @property
    def groups(self) -> list[slice]:
        """The places of each group of drives, or of its shares, as slices."""
        group = self._drives.group_of[self._drive_of]
        starts = np.flatnonzero(np.diff(group, prepend=-1)).tolist()
        slices = []
        for start, end in itertools.pairwise([*starts, len(self)]):
            shares = min(int(self._drives.shares[group[start]]), end - start)
            limits = np.linspace(start, end, shares + 1).astype(int).tolist()
            slices += [slice(*both) for both in itertools.pairwise(limits)]
        return slices
