"""The structures of an imported city at each stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.city.generation.structure_rows import MAX_STRUCTURES
from cns_drake.imports.building_years import (
    stage_names,
    stands_at,
    stands_today,
)
from cns_drake.imports.foreign_city import ForeignCity, Imported
from cns_drake.imports.gone_buildings import with_gone
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.import_report import ImportOptions
from cns_drake.imports.near_drives import keep_near
from cns_drake.imports.waypoint_drives import WaypointDrive

# Greatest distance from the middle of a city [m].
_FARTHEST = 10_000.0


@dataclass(frozen=True)
class StagedCity:
    """The structures of a city, stage by stage.

    Attributes:
        standing: stage -> its structures.
        kept: the structures of any stage.
        undated: number of buildings without a year.
        dated: number of buildings with a year.
        gone: buildings that stand no more, if there is but one stage, that
            of today.
    """

    standing: dict[str, list[Imported]]
    kept: list[Imported]
    undated: int
    dated: int
    gone: Sequence[Imported] = ()

    def near(
        self,
        drives: Sequence[WaypointDrive],
        distance: float,
        faults: ImportFaults,
    ) -> StagedCity:
        """Returns the city without structures far from drives.

        Args:
            drives: of the city.
            distance: see `keep_near` [m].
            faults: counts structures left out.

        Raises:
            InputError: if no structure is near, or there is no drive.
        """
        if not drives:
            raise InputError(
                "--within: no drive was found; give one with --along"
            )
        cut = dict(
            zip(
                self.kept,
                keep_near(self.kept, drives, distance, faults),
                strict=True,
            )
        )
        kept = [one for one in cut.values() if one is not None]
        if not kept:
            raise InputError(
                f"--within: nothing stands within {distance:g} m of the drives"
            )
        standing = {
            stage: [new for one in some if (new := cut[one]) is not None]
            for stage, some in self.standing.items()
        }
        return replace(self, standing=standing, kept=kept)

    def replaced(self, changed: Mapping[Imported, Imported]) -> StagedCity:
        """Returns the city with some structures in place of others."""
        return replace(
            self,
            standing={
                stage: [changed.get(one, one) for one in some]
                for stage, some in self.standing.items()
            },
            kept=[changed.get(one, one) for one in self.kept],
        )

    def joined(self, added: Sequence[Imported]) -> StagedCity:
        """Returns the city with more structures, at all stages."""
        return replace(
            self,
            standing={
                stage: [*some, *added] for stage, some in self.standing.items()
            },
            kept=[*self.kept, *added],
        )


def stage_city(
    source: object, city: ForeignCity, options: ImportOptions
) -> StagedCity:
    """Returns the structures at the wanted stages.

    Args:
        source: the name of the file in errors.
        city: the whole city; its faults count structures of no stage.
        options: the years, and the stage of buildings without any.

    Raises:
        InputError: if no structure, or too many, are at any stage.
    """
    found = _together(city)
    if not found:
        raise InputError(f"{source}: no object has a surface")
    standing = {
        stage: [
            one
            for one in found
            if not _has_years(one) or _stands(one, k, options)
        ]
        for k, stage in enumerate(stage_names(options.years))
    }
    gone: list[Imported] = []
    if options.grow is not None:
        (today,) = map(set, standing.values())
        gone = [one for one in found if one not in today]
    elif options.dressed:
        standing = {
            stage: with_gone(
                [one for one in some if not _is_here(one)],
                [one for one in some if _is_here(one)],
            )
            for stage, some in standing.items()
        }
    ever = {one for some in standing.values() for one in some}
    for one in found:
        if one not in ever and one not in gone:
            kind = f"building {_why_never(one, options)}, left out"
            city.faults.add(kind, one.structure.name)
    kept = [one for one in found if one in ever]
    if len(kept) >= MAX_STRUCTURES:
        raise InputError(
            f"{source}: {len(kept)} objects are more than instance ids can"
            f" count ({MAX_STRUCTURES})"
        )
    if not kept:
        raise InputError(
            f"{source}: no structure stands at any stage; check --years and "
            "--undated"
        )
    years = [one.year for one in found if _has_years(one)]
    undated = years.count(None)
    return StagedCity(standing, kept, undated, len(years) - undated, gone)


def _is_here(one: Imported) -> bool:
    """Returns whether a structure stands today, if it was built."""
    return not one.is_gone and stands_today(one.until)


def _stands(one: Imported, stage: int, options: ImportOptions) -> bool:
    """Returns whether a structure stands at the stage of a number.

    A structure that is gone without a date stood at all stages but the last, as
    far as its year, or the lack of one, allows.
    """
    years, undated = options.years, options.undated
    if one.is_gone:
        past = years[:-1]
        return stage < len(past) and stands_at(
            one.year, None, stage, past, undated
        )
    return stands_at(one.year, one.until, stage, years, undated)


def _together(city: ForeignCity) -> list[Imported]:
    """Returns the structures of a city without those far away."""
    if not city.structures:
        return []
    boxes = np.array(
        [
            (one.triangles.min(axis=(0, 1)), one.triangles.max(axis=(0, 1)))
            for one in city.structures
        ]
    )
    middle = np.median(boxes.mean(axis=1), axis=0)
    kept = []
    for one, reach in zip(
        city.structures, np.abs(boxes - middle).max(axis=(1, 2)), strict=True
    ):
        if reach <= _FARTHEST:
            kept.append(one)
        else:
            kind = f"object more than {_FARTHEST / 1000:g} km away, left out"
            city.faults.add(kind, one.structure.name)
    return kept


def _why_never(one: Imported, options: ImportOptions) -> str:
    """Returns why a building stands at no stage."""
    first = options.years[0] if options.years else None
    if one.until is not None and (first is None or one.until <= first):
        return "demolished before the first stage" if first else "demolished"
    if one.is_gone and len(options.years) < 2:
        return "demolished"
    if one.year is None:
        return "without a year"
    if options.years and one.year > options.years[-1]:
        return "built after the last stage"
    return "that stood between stages"


def _has_years(one: Imported) -> bool:
    """Returns whether a structure may be missing at a stage.

    Without any --years, only buildings are taken to have a year.
    """
    is_building = one.kind.startswith("Building")
    is_dated = one.year is not None or one.until is not None
    return not one.is_ground and (is_dated or is_building)
