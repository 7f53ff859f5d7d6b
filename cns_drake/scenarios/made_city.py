"""Makes the city of a drive: aged, or drawn anew along the same streets.

What makes a city is imported only where one is made.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cns_drake.scenarios.map_step import MakeMap
from cns_drake.scenarios.provenance import digest_file
from cns_drake.scenarios.scenario import Scenario
from evaluation.base import (
    InputError,
    Reporter,
    doing,
    errors_at,
    exclusive,
    fingerprint,
)

_FACTOR = "factor"
# The stage of a map that was aged by one number of years; stage 01 is today.
_AGED_STAGE = "02"


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
        from cns_drake.scenarios.city_ageing import age_city

        age_city(
            self.source,
            self.years,
            self.seed,
            dict(self.rates),
            self.folder,
            finish=lambda draft, *_: finish(draft),
        )

    def sources(self) -> dict[str, object]:
        from worlds.maps import MapFolder

        files = MapFolder(self.source).files()
        return {
            "files": {one.name: digest_file(one) for one in files},
            "years": list(self.years),
            "seed": self.seed,
            "rates": dict(self.rates),
        }


def city_step(scenario: Scenario, cities: Path) -> MakeMap | None:
    """Returns the step that makes a drive's city; None if it is there.

    Args:
        scenario: the scenario.
        cities: folder of the cities that are made. The folder of a city is
            named by what makes it, so that drives share it.

    Raises:
        InputError: the city cannot age or be drawn anew.
    """
    city = scenario.city
    if not city.is_made:
        return None
    from cns_drake.scenarios.redrawing import redrawn_city
    from worlds.ageing import DEFAULT_RATES
    from worlds.maps import MapFolder

    source = f"{scenario.source}: city"
    folder = scenario.map_folder.path.resolve()
    if city.redraw is not None:
        return redrawn_city(folder, city.redraw, cities.resolve())
    with errors_at(source):
        rates = tuple(sorted(_all_rates(city.rates).items()))
    last = list(MapFolder(folder).stages())[-1]
    if scenario.stage != last:
        raise InputError(
            f"{source}.years: the last stage ages; give the drive stage:"
            f" '{last}', not '{scenario.stage}'"
        )
    name = f"{folder.name}_y{city.years:02d}_s{city.seed}"
    if dict(rates) != dict(DEFAULT_RATES):
        name += f"_{fingerprint(dict(rates))[:6]}"
    return AgeCity(
        cities.resolve() / name, folder, (city.years,), city.seed, rates
    )


def in_made_city(scenario: Scenario, cities: Path) -> Scenario:
    """Returns a scenario whose city, if made, is read from a folder's map.

    Args:
        scenario: the scenario.
        cities: see `city_step`.

    Raises:
        InputError: as in `city_step`.
    """
    step = city_step(scenario, cities)
    if step is None:
        return scenario.in_folder(None)
    from cns_drake.scenarios.redrawing import REDRAWN_STAGE

    stage = _AGED_STAGE if scenario.city.years else REDRAWN_STAGE
    return scenario.in_folder((step.folder, stage))


def make_city(scenario: Scenario, cities: Path) -> Scenario:
    """Makes the city of a drive if needed, and returns `in_made_city`.

    Args:
        scenario: the scenario. If it has its city in a folder already, the city
            is made there.
        cities: see `city_step`.

    Raises:
        InputError: the city cannot be made, or another folder is in the way.
    """
    if scenario.city.is_made and not scenario.lacks_city:
        cities = scenario.folder.path.parent
    step = city_step(scenario, cities)
    if step is not None:
        doing("making the city")
        with exclusive(step.folder, lambda: doing("waiting for the city")):
            if not step.is_done():
                with errors_at(f"{scenario.source}: city"):
                    step.run(Reporter())
    return in_made_city(scenario, cities)


def _all_rates(rates: float | Mapping[str, float]) -> Mapping[str, float]:
    """Returns event -> rate per year, for the field `rates` of a city."""
    from worlds.ageing import check_rates, read_rates

    given = dict(rates) if isinstance(rates, Mapping) else {_FACTOR: rates}
    factor = given.pop(_FACTOR, 1.0)
    check_rates(given, "rates")
    with errors_at("rates", "--rate: "):
        known = read_rates(None, factor)
    return {**known, **given}
