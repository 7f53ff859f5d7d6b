"""The objects of an imported city in each stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from evaluation.base import MAX_INSTANCE, InputError
from worlds.imports.building_years import stands_today
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity
from worlds.imports.former_buildings import with_former_buildings
from worlds.imports.imported_objects import FARTHEST, ImportedObject, boxes_of
from worlds.imports.options import ImportOptions


@dataclass(frozen=True)
class StagedCity:
    """The objects of an imported city, by stage.

    Attributes:
        standing: name of a stage -> objects that exist in this stage.
        kept: objects that exist in at least one stage.
        undated: number of buildings without a year.
        dated: number of buildings with a year.
        gone: buildings that no longer exist, for `grow`; empty if the options
            of the import do not include `grow`.
    """

    standing: dict[str, list[ImportedObject]]
    kept: list[ImportedObject]
    undated: int
    dated: int
    gone: Sequence[ImportedObject] = ()

    def replaced(
        self, changed: Mapping[ImportedObject, ImportedObject | None]
    ) -> StagedCity:
        """Returns the city with some objects replaced or removed.

        `changed` maps an object to its replacement, or to None to remove it.
        """

        def with_changes(
            objects: Iterable[ImportedObject],
        ) -> list[ImportedObject]:
            others = (changed.get(imported, imported) for imported in objects)
            return [other for other in others if other is not None]

        standing = {
            stage: with_changes(objects)
            for stage, objects in self.standing.items()
        }
        return replace(self, standing=standing, kept=with_changes(self.kept))

    def with_objects(self, added: Sequence[ImportedObject]) -> StagedCity:
        """Returns the city with more objects, which exist in all stages."""
        standing = {
            stage: [*objects, *added]
            for stage, objects in self.standing.items()
        }
        return replace(self, standing=standing, kept=[*self.kept, *added])


def stage_city(
    source: object, city: ForeignCity, options: ImportOptions
) -> StagedCity:
    """Assigns the objects of an imported city to the stages of a map.

    Objects that exist in no stage are counted in `city.faults`.

    Args:
        source: the imported file, named in error messages.
        city: the city as in its file.
        options: options of the import, such as the years of the stages.

    Raises:
        InputError: if all stages together have no structure, or too many.
    """
    objects = _without_copies(_without_outliers(city), city.faults)
    if not objects:
        raise InputError(f"{source}: no object has a surface")
    standing = {
        stage: [
            imported
            for imported in objects
            if not _may_be_missing(imported)
            or _stands_at(imported, number, options)
        ]
        for number, stage in enumerate(stage_names(options.years))
    }
    gone: list[ImportedObject] = []
    if options.grow is not None:
        (today,) = map(set, standing.values())
        gone = [imported for imported in objects if imported not in today]
    elif options.dressed:
        standing = {
            stage: with_former_buildings(
                [imported for imported in of_stage if not _is_here(imported)],
                [imported for imported in of_stage if _is_here(imported)],
            )
            for stage, of_stage in standing.items()
        }
    ever = {imported for of_stage in standing.values() for imported in of_stage}
    for imported in objects:
        if imported not in ever and imported not in gone:
            kind = f"building {_why_never(imported, options)}, left out"
            city.faults.add(kind, imported.structure.name)
    kept = [imported for imported in objects if imported in ever]
    if len(kept) >= MAX_INSTANCE:
        raise InputError(
            f"{source}: {len(kept)} objects are more than instance ids can"
            f" count ({MAX_INSTANCE})"
        )
    if not kept:
        raise InputError(
            f"{source}: no structure stands at any stage; check --years and "
            "--undated"
        )
    years = [imported.year for imported in objects if _may_be_missing(imported)]
    undated = years.count(None)
    return StagedCity(standing, kept, undated, len(years) - undated, gone)


def _is_here(imported: ImportedObject) -> bool:
    """Returns whether a structure, once built, still stands today."""
    return not imported.is_gone and stands_today(imported.until)


def _stands_at(
    imported: ImportedObject, stage: int, options: ImportOptions
) -> bool:
    """Returns whether a structure stands in the stage of number `stage`.

    A structure that was demolished at an unknown date stands in all stages
    except the last, from its year of construction on. If the year of
    construction is unknown, `options.undated` decides.
    """
    years = options.years
    until = imported.until
    if imported.is_gone:
        years = years[:-1]
        until = None
        if stage >= len(years):
            return False
    if not years:
        return stands_today(until)
    if until is not None and years[stage] >= until:
        return False
    if imported.year is not None:
        return imported.year <= years[stage]
    if options.undated == "first":
        return True
    return options.undated == "last" and stage == len(years) - 1


def stage_names(years: Sequence[int]) -> list[str]:
    """Returns the names of the stages: a number from 01 for each year.

    Without years there is one stage, 01.

    Raises:
        InputError: if years do not increase.
    """
    if any(a >= b for a, b in pairwise(years)):
        listed = " ".join(map(str, years))
        raise InputError(
            f"--years: {listed}: each year must be after the one before"
        )
    return [f"{number:02d}" for number in range(1, max(len(years), 1) + 1)]


def _without_outliers(city: ForeignCity) -> list[ImportedObject]:
    """Returns a city's objects within 10 km of its middle, and 3 km in height.

    All other objects are counted in the city's faults.
    """
    if not city.objects:
        return []
    boxes = boxes_of(city.objects)
    middle = np.median(boxes.mean(axis=1), axis=0)
    kept = []
    for imported, reach in zip(
        city.objects,
        (np.abs(boxes - middle) / FARTHEST).max(axis=(1, 2)),
        strict=True,
    ):
        if reach <= 1.0:
            kept.append(imported)
        else:
            x, _, z = FARTHEST / 1000
            kind = f"object more than {x:g} km away or {z:g} km higher or lower"
            city.faults.add(f"{kind}, left out", imported.structure.name)
    return kept


def _without_copies(
    objects: Sequence[ImportedObject], faults: ImportFaults
) -> list[ImportedObject]:
    """Returns the objects without those whose surfaces another one has.

    Those are counted as faults. What stood there at another time is no copy.
    """
    kept: dict[tuple[object, ...], ImportedObject] = {}
    for imported in objects:
        key = (
            imported.object_type,
            imported.year,
            imported.until,
            imported.is_gone,
            imported.triangles.tobytes() or imported.structure.name,
        )
        if kept.setdefault(key, imported) is not imported:
            name = imported.structure.name
            faults.add("object equal to another one, left out", name)
    return list(kept.values())


def _why_never(imported: ImportedObject, options: ImportOptions) -> str:
    """Returns why a building stands at no stage, in words."""
    first = options.years[0] if options.years else None
    if imported.until is not None and (
        first is None or imported.until <= first
    ):
        return "demolished before the first stage" if first else "demolished"
    if imported.is_gone and len(options.years) < 2:
        return "demolished"
    if imported.year is None:
        return "without a year"
    if options.years and imported.year > options.years[-1]:
        return "built after the last stage"
    return "that stood between stages"


def _may_be_missing(imported: ImportedObject) -> bool:
    """Returns whether a structure may be missing at some stages.

    Among the structures without a year, only buildings may be missing.
    """
    is_dated = imported.year is not None or imported.until is not None
    return not imported.is_ground and (is_dated or imported.is_building)
