"""Maps that an experiment makes: older ones, others, imported ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import hashlib
from pathlib import Path
from typing import Any

from cns_drake.ageing.aged_map import age_map
from cns_drake.ageing.rates import (
    DEFAULT_RATES,
    LAST_YEAR,
    check_rates,
    read_rates,
)
from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import code_digest, fingerprint
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.map_folder import MapFolder
from cns_drake.imports.import_map import import_city
from cns_drake.imports.options import ImportOptions
from cns_drake.scenarios.provenance import digest_file
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.studies.experiment import Experiment, MadeMap
from cns_drake.studies.redrawing import MakeMap, RedrawCity, make_maps

_FACTOR = "factor"
# The only stage of a city that is drawn anew.
_STAGE = "01"


@dataclass(frozen=True)
class AgeCity(MakeMap):
    """Lets a city live for some years, with a stage after each of them."""

    source: Path
    years: tuple[int, ...]
    seed: int
    rates: tuple[tuple[str, float], ...]

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        age_map(
            self.source,
            self.years,
            self.seed,
            dict(self.rates),
            self.folder,
            finish=lambda draft, _: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        files = MapFolder(self.source).files()
        return {
            "files": {one.name: digest_file(one) for one in files},
            "years": list(self.years),
            "seed": self.seed,
            "rates": dict(self.rates),
            "code": code_digest("cns_drake.ageing.aged_map"),
        }


@dataclass(frozen=True)
class ImportCity(MakeMap):
    """Imports the file of a real city."""

    source: Path
    options: ImportOptions

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        import_city(
            self.source,
            self.folder,
            self.options,
            reporter.note,
            lambda draft, _: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        return {
            "file": digest_file(self.source),
            "options": repr(self.options),
            "code": code_digest("cns_drake.imports.import_map"),
        }


@dataclass
class MadeMaps:
    """The maps that the conditions of an experiment need, in one folder.

    They are asked for first, and made by `make`: a city that ages has a stage
    for each of its years.
    """

    folder: Path
    # (Map, rates, seed) -> years.
    _ages: dict[tuple[Path, tuple[tuple[str, float], ...], int], set[int]] = (
        field(default_factory=dict)
    )
    _steps: dict[Path, RedrawCity] = field(default_factory=dict)

    def want_age(
        self, drive: Scenario, years: Any, rates: Any, seed: int
    ) -> tuple[str, str]:
        """Notes that a drive's city must be aged by some years.

        Returns:
            The drive's own map and stage, as long as there is no other.

        Raises:
            InputError: years, or a rate, are out of range.
        """
        if type(years) is not int or not 1 <= years <= LAST_YEAR:
            raise InputError(f"years: {years!r} is not from 0 to {LAST_YEAR}")
        key = self._key(drive, rates, seed)
        self._ages.setdefault(key, set()).add(years)
        return str(drive.map), str(drive.stage)

    def want_redrawn(self, drive: Scenario, seed: Any) -> tuple[str, str]:
        """Notes that a drive's city must be drawn anew with a seed.

        Raises:
            InputError: the seed is out of range.
        """
        if type(seed) is not int or not 0 <= seed < 2**31:
            raise InputError(f"version: {seed!r} is no number from 0 on")
        source = map_folder(drive).path.resolve()
        folder, stage = self.redrawn(drive, seed)
        path = Path(folder)
        self._steps[path] = RedrawCity(path, source, stage, seed)
        return str(drive.map), str(drive.stage)

    def aged(
        self, drive: Scenario, years: int, rates: Any, seed: int
    ) -> tuple[str, str]:
        """Returns the map folder of a drive's aged city, and its stage."""
        key = self._key(drive, rates, seed)
        number = sorted(self._ages[key]).index(years)
        return str(self._aged_folder(*key)), f"{number + 2:02d}"

    def redrawn(self, drive: Scenario, seed: int) -> tuple[str, str]:
        """Returns the map folder of a drive's redrawn city, and its stage."""
        source = map_folder(drive).path.resolve()
        return str(self.folder / f"{source.name}_c{seed}"), _STAGE

    def make(self, cluster: Cluster) -> None:
        """Makes all maps that were noted and do not exist yet.

        Raises:
            InputError: one could not be made; all are named.
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

    def _key(
        self, drive: Scenario, rates: Any, seed: int
    ) -> tuple[Path, tuple[tuple[str, float], ...], int]:
        path = map_folder(drive).path.resolve()
        return path, tuple(sorted(self._rates(rates).items())), seed

    def _rates(self, rates: Any) -> Mapping[str, float]:
        factor: Any = rates
        found: dict[str, float] = {}
        if isinstance(rates, dict):
            found = dict(rates)
            factor = found.pop(_FACTOR, 1.0)
            check_rates(found, "rates")
        if isinstance(factor, bool) or not isinstance(factor, int | float):
            raise InputError(f"rates: {factor!r} is no number")
        try:
            known = read_rates(None, factor)
        except InputError as error:
            fault = str(error).removeprefix("--rate: ")
            raise InputError(f"rates: {fault}") from None
        return {**known, **found}

    def _aged_folder(
        self, path: Path, rates: tuple[tuple[str, float], ...], seed: int
    ) -> Path:
        name = f"{path.name}_s{seed}"
        if dict(rates) != dict(DEFAULT_RATES):
            name += f"_{fingerprint(dict(rates))[:6]}"
        return self.folder / name


def made_map_step(
    made: MadeMap, experiment: Experiment, folder: Path, shipped: Mapping
) -> MakeMap:
    """Returns the step that makes a map of an experiment in a folder.

    Raises:
        InputError: its file is missing, or another one; or its source is no
            map.
    """
    if made.age is not None:
        assert made.years is not None
        path = Path(shipped.get(made.age, made.age))
        if not MapFolder(path).recordable_drives():
            raise InputError(
                f"maps: {made.name}: no map {made.age!r} with drives"
            )
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
    options = ImportOptions(
        seed=made.seed, grow=made.grow, dressed=not made.plain
    )
    return ImportCity(folder, path.resolve(), options)
