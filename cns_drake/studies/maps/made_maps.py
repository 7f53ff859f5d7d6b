"""Maps that an experiment makes: aged, generated anew or imported."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import hashlib
from pathlib import Path
from typing import Any

from cns_drake.scenarios import Scenario, age_city, digest_file
from cns_drake.studies.maps.map_step import MakeMap, make_maps
from cns_drake.studies.maps.redrawing import RedrawCity, redrawn_city
from evaluation.base import (
    Cluster,
    InputError,
    Reporter,
    errors_at,
    fingerprint,
    read_bytes,
)
from evaluation.study import Experiment, MadeMap
from worlds.ageing import (
    DEFAULT_RATES,
    LAST_YEAR,
    check_rates,
    read_rates,
)
from worlds.imports import ImportOptions, import_city, map_sources
from worlds.maps import MapFolder

_FACTOR = "factor"
# Seeds of redraws are below this number.
_SEEDS = 2**31


@dataclass(frozen=True)
class AgeCity(MakeMap):
    """A job step that ages a city and makes a map with a stage for each age.

    Attributes:
        source: folder of the city's map.
        years: the ages of the city: numbers of years from today.
        seed: seed of the events.
        rates: events and their rates per year.
    """

    source: Path
    years: tuple[int, ...]
    seed: int
    rates: tuple[tuple[str, float], ...]

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        age_city(
            self.source,
            self.years,
            self.seed,
            dict(self.rates),
            self.folder,
            finish=lambda draft, *_: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        files = MapFolder(self.source).files()
        return {
            "files": {one.name: digest_file(one) for one in files},
            "years": list(self.years),
            "seed": self.seed,
            "rates": dict(self.rates),
        }


@dataclass(frozen=True)
class ImportCity(MakeMap):
    """A job step that makes a map from the file of a real city.

    Attributes:
        source: the file.
        options: options of the import.
    """

    source: Path
    options: ImportOptions

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        import_city(
            self.source,
            self.folder,
            self.options,
            lambda draft, _: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        return {
            "file": digest_file(self.source),
            "options": repr(self.options),
        }


@dataclass
class MadeMaps:
    """The maps that the conditions of an experiment need, in one folder.

    A map is requested when a drive asks for it; `make` then makes all maps
    together. In this way, a city that is aged by several numbers of years
    becomes one map with a stage for each number. A drive that asks before
    `make` stays in its present city.

    Attributes:
        folder: the folder for all maps.
        num_requests: how often a map was asked for that does not exist yet.
    """

    folder: Path
    num_requests: int = 0
    _are_made: bool = False
    # (Map, rates, seed) -> years.
    _ages: dict[tuple[Path, tuple[tuple[str, float], ...], int], set[int]] = (
        field(default_factory=dict)
    )
    _steps: dict[Path, RedrawCity] = field(default_factory=dict)

    def aged(
        self, drive: Scenario, years: Any, rates: Any, seed: int
    ) -> tuple[str, str]:
        """Returns map and stage of a drive's city, aged by some years.

        Args:
            drive: the drive.
            years: number of years.
            rates: factor by which all rates of change are multiplied, or event
                -> rate per year.
            seed: seed of the events.

        Raises:
            InputError: years, or a rate, are out of range.
        """
        if type(years) is not int or not 1 <= years <= LAST_YEAR:
            raise InputError(f"years: {years!r} is not from 1 to {LAST_YEAR}")
        path = drive.folder.path.resolve()
        key = path, tuple(sorted(_all_rates(rates).items())), seed
        if self._are_made:
            number = sorted(self._ages[key]).index(years)
            return str(self._aged_folder(*key)), f"{number + 2:02d}"
        self._ages.setdefault(key, set()).add(years)
        return self._present(drive)

    def redrawn(self, drive: Scenario, seed: Any) -> tuple[str, str]:
        """Returns map and stage of a drive's city, generated anew from a seed.

        The map has the streets of the drive's own map.

        Raises:
            InputError: the seed is out of range.
        """
        if type(seed) is not int or not 0 <= seed < _SEEDS:
            raise InputError(
                f"redraw: {seed!r} is no whole number from 0 to {_SEEDS - 1}"
            )
        city = redrawn_city(drive.folder.path.resolve(), seed, self.folder)
        if self._are_made:
            return str(city.folder), city.stage
        self._steps[city.folder] = city
        return self._present(drive)

    def _present(self, drive: Scenario) -> tuple[str, str]:
        """Counts a request; returns a drive's map and stage as they are."""
        self.num_requests += 1
        return str(drive.map), str(drive.stage)

    def make(self, cluster: Cluster) -> None:
        """Makes all requested maps that do not exist yet.

        Raises:
            InputError: maps could not be made; the error names all of them.
        """
        aged = [
            AgeCity(
                self._aged_folder(path, rates, seed),
                path,
                tuple(sorted(years)),
                seed,
                rates,
            )
            for (path, rates, seed), years in self._ages.items()
        ]
        make_maps([*aged, *self._steps.values()], self.folder, cluster)
        self._are_made = True

    def _aged_folder(
        self, path: Path, rates: tuple[tuple[str, float], ...], seed: int
    ) -> Path:
        name = f"{path.name}_s{seed}"
        if dict(rates) != dict(DEFAULT_RATES):
            name += f"_{fingerprint(dict(rates))[:6]}"
        return self.folder / name


def _all_rates(rates: Any) -> Mapping[str, float]:
    """Returns rates per year by event, for an experiment's field `rates`."""
    factor: Any = rates
    found: dict[str, float] = {}
    if isinstance(rates, dict):
        found = dict(rates)
        factor = found.pop(_FACTOR, 1.0)
        check_rates(found, "rates")
    if isinstance(factor, bool) or not isinstance(factor, int | float):
        raise InputError(f"rates: {factor!r} is no number")
    with errors_at("rates", "--rate: "):
        known = read_rates(None, factor)
    return {**known, **found}


def made_map_step(
    made: MadeMap, experiment: Experiment, folder: Path, shipped: Mapping
) -> MakeMap:
    """Returns the job step that makes a map described by an experiment.

    Args:
        made: description of the map.
        experiment: the experiment.
        folder: folder of the map to make.
        shipped: name -> folder of the shipped maps.

    Raises:
        InputError: the file to import is missing or has another digest, or the
            map to age does not exist.
    """
    if made.age is not None:
        assert made.years is not None
        path = Path(shipped.get(made.age, made.age))
        if not MapFolder(path).recordable_drives():
            raise InputError(f"{made.name}: no map {made.age!r} with drives")
        rates = tuple(sorted(DEFAULT_RATES.items()))
        return AgeCity(folder, path.resolve(), (made.years,), made.seed, rates)
    assert made.import_file is not None
    path = Path(experiment.files or ".") / made.import_file
    if not path.is_file():
        raise InputError(
            f"{path}: no such file; --set files=FOLDER names the folder of the"
            " cities to import (docs/map_update.md says where they are from)"
        )
    if made.sha256 is not None:
        digest = hashlib.sha256(read_bytes(path)).hexdigest()
        if digest != made.sha256:
            raise InputError(f"{path}: not the file of {made.name}: its sha256")
    for source in map_sources() if made.grow is not None else ():
        if path.suffix in source.suffixes and source.has_stages:
            raise InputError(
                f"{experiment.name}: maps: {made.name}.grow: a map from"
                f" {source.title} has two stages anyway; leave it out"
            )
    options = ImportOptions(
        seed=made.seed, grow=made.grow, dressed=not made.plain
    )
    return ImportCity(folder, path.resolve(), options)
