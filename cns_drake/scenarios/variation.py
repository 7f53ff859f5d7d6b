"""Families of scenarios, each described by one small file.

Every member of a family is a scenario. The members differ in how much of the
city is missing: each lacks a given share of the buildings and plants, namely
those nearest to a random place. A member with a greater share lacks everything
that a member with a smaller share lacks. The removed structures can also be
limited to those that an earlier stage lacks; the members are then between the
two stages. In addition, structures of chosen classes can be missing at random.
A family can also combine these shares with several random seeds, redrawn
cities, random routes and other LiDARs.
"""

from collections.abc import Callable, Mapping, Sequence, Set
from itertools import product
import os
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field
import yaml

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError, validated
from cns_drake.base.files import make_folder, write_text
from cns_drake.base.value_lists import repeated, spread
from cns_drake.base.yaml_files import read_yaml
from cns_drake.roads.network import load_road_network
from cns_drake.roads.route import Route, draw_route
from cns_drake.scenarios import scenario_files
from cns_drake.scenarios.scenario import RideConfig, Scenario
from cns_drake.scenarios.shipped import shipped_drives
from cns_drake.scene.world import load_world, structures_in
from cns_drake.sensors.imu.config import ImuSection
from cns_drake.sensors.sensor_config import Section

# Classes of structures that can be missing; streets, ground and street
# furniture always stay.
_REMOVABLE = ("building", "vegetation")
# Farther than any city reaches [m].
_FARTHEST = 1e6

_Part = Annotated[float, Field(ge=0.0, le=1.0)]
_Seed = Annotated[int, Field(ge=0)]
# A function that draws the city of a map again. It takes the map's folder, the
# name of the complete stage and seeds; it returns seed -> map folder of the
# city drawn with that seed.
Redraw = Callable[[Path, str, Sequence[int]], Mapping[int, Path]]


def _without_doubles(seeds: tuple[int, ...]) -> tuple[int, ...]:
    for seed in repeated(seeds):
        raise ValueError(f"the seed {seed} is there twice")
    return seeds


class DrawnRoutes(Section):
    """Routes that are drawn at random.

    Attributes:
        count: number of routes to draw.
        length: smallest length of each route [m].
        seed: seed of the random draws.
    """

    count: int = Field(ge=1, le=10_000)
    length: float = Field(gt=0.0, le=100_000.0)
    seed: _Seed = 0


class Family(Section):
    """A family of drives: a base drive and what varies among its members.

    There is a member for each combination of the values of `missing`, `seeds`,
    `city_seeds`, `routes` and `lidars`. All other fields apply to all members.

    Attributes:
        base: name or file of the drive that provides the map, route, speeds and
            sensors of all members.
        stage: stage through which the members drive, and from which structures
            are removed. By default the map's last stage.
        towards: another stage of the map, usually an earlier one. Only
            structures that do not exist in this other stage are removed.
            Structures that are lower there keep their height.
        missing: shares of the structures to remove: numbers from 0 to 1, or
            `{from: 0, to: 0.6, count: 20}` for evenly spaced ones. Seeds can be
            written like this, too.
        scattered: name of a class -> share of its structures to remove at
            random all over the map, besides those of `missing`, such as
            `{pole: 0.3}`.
        seeds: seeds of the random draws. A seed determines the place around
            which the structures of `missing` are removed, the nearest first,
            and which structures of `scattered` are removed.
        city_seeds: seeds of cities that are generated anew along the same
            streets.
        routes: random routes for the members, instead of the base's route.
        lidars: presets of LiDARs, such as `[cns, os1-64]`, that replace the
            LiDARs of the base.
        ride: ride of all members, instead of the base's.
        imu: IMU of all members, instead of the base's.
    """

    base: str
    stage: str | None = None
    towards: str | None = None
    missing: Annotated[tuple[_Part, ...], BeforeValidator(spread)] = Field(
        default=(0.0,), min_length=1
    )
    scattered: dict[str, _Part] = Field(default_factory=dict)
    seeds: Annotated[tuple[_Seed, ...], BeforeValidator(spread)] = Field(
        default=(0,), min_length=1
    )
    city_seeds: Annotated[
        tuple[_Seed, ...],
        BeforeValidator(spread),
        AfterValidator(_without_doubles),
    ] = Field(default=(), min_length=1)
    routes: DrawnRoutes | None = None
    lidars: tuple[str, ...] = ()
    ride: RideConfig | None = None
    imu: ImuSection | None = None


def load_family(path: Path, redraw: Redraw | None = None) -> list[Scenario]:
    """Reads the file of a family of drives, and returns the members.

    The name of a member consists of the name of the base drive; the seed of its
    city, if the family has `city_seeds`; its value of `missing` in per mille;
    its value of `seeds`; and its route and LiDAR, if they vary.

    Args:
        redraw: function that generates cities along the streets of a map. Its
            arguments are the map's folder, its complete stage and the seeds; it
            returns seed -> folder of the new map. Only a family with
            `city_seeds` needs it. It is called last, after all checks.

    Raises:
        InputError: the family's file or a file that it names cannot be used,
            the base has no map, or a stage, class or LiDAR of the family does
            not exist.
        ValueError: the family has `city_seeds`, but `redraw` is None.
    """
    values = read_yaml(path)
    if isinstance(values, dict):
        scenario_files.find_files(values, path)
    family = validated(Family, values, path)
    base: str | Path = family.base
    if base not in shipped_drives():
        base = path.parent / base
    return vary(scenario_files.load_scenario(base), family, path, redraw)


def vary(
    base: Scenario,
    family: Family,
    source: Path | str,
    redraw: Redraw | None = None,
) -> list[Scenario]:
    """Returns the members of a family as scenarios.

    Args:
        base: the drive that all members are made from.
        family: what varies among the members.
        source: file of the family, for error messages.
        redraw: function that generates cities along the streets of a map, see
            `load_family`. Only a family with `city_seeds` needs it.

    Raises:
        InputError: a file that the family names cannot be used, the base has no
            map, or a stage, class or LiDAR of the family does not exist.
        ValueError: the family has `city_seeds`, but `redraw` is None.
    """
    if base.map is None:
        raise InputError(
            f"{source}: base: {base.name} has no map to vary; give a scenario "
            "with a map"
        )
    sections = {"ride": family.ride, "imu": family.imu}
    base = base.replaced(**{n: one for n, one in sections.items() if one})
    scenario_files.check_files(base, source)
    last = max(scenario_files.map_folder(base).stages())
    stage = family.stage or last
    if family.city_seeds:
        _check_redrawable(base, family, last, source)
    text = "buildings and plants"
    removable = None
    if family.towards is not None:
        text = f"what stage {family.towards} lacks"
        removable = _difference(base, stage, family.towards, source)
    routes: dict[str | None, Route | None] = {None: None}
    if family.routes is not None:
        network = load_road_network(scenario_files.map_folder(base).roads)
        routes = {}
        for k in range(family.routes.count):
            rng = np.random.default_rng([family.routes.seed, k])
            routes[f"r{k}"] = draw_route(network, family.routes.length, rng)
    units: dict[str | None, dict] = {None: base.lidars}
    if family.lidars:
        units = {n: base.with_lidar_preset(n).lidars for n in family.lidars}
    cities: dict[int | None, Scenario] = {None: base}
    if family.city_seeds:
        if redraw is None:
            raise ValueError("a family with city_seeds needs `redraw`")
        here = scenario_files.map_folder(base).path
        folders = redraw(here, stage, family.city_seeds)
        cities = {n: base.replaced(map=str(f)) for n, f in folders.items()}
    drawn = {}
    for city_seed, seed in product(cities, family.seeds):
        table = scenario_files.map_folder(cities[city_seed]).structures
        drawn[city_seed, seed] = (
            _decay_order(table, seed, removable),
            _draw_losses(table, family.scattered, seed, source),
        )
    members = []
    for city_seed, part, seed, route, preset in product(
        cities, family.missing, family.seeds, routes, units
    ):
        labels = [base.name, f"m{round(1000 * part):03d}", f"s{seed}"]
        labels += [label for label in (route, preset) if label]
        title = f"{100 * part:.1f} % of {text} missing"
        if family.scattered:
            title += f", others at random with seed {seed}"
        if city_seed is not None:
            labels.insert(1, f"c{city_seed}")
            title += f", in the city as seed {city_seed} draws it"
        order, losses = drawn[city_seed, seed]
        missing = losses.union(order[: round(part * len(order))])
        member = cities[city_seed].replaced(
            name="_".join(labels).replace("-", "_"),
            stage=stage,
            without=tuple(sorted(missing)),
            title=title,
            lidars=units[preset],
        )
        if routes[route] is not None:
            member = member.replaced(route=routes[route], waypoints=None)
        scenario_files.check_files(member, source)
        members.append(member)
    return members


def write_scenarios(scenarios: Sequence[Scenario], folder: Path) -> list[Path]:
    """Writes scenarios as `<folder>/<name>.yaml`.

    If a map lies next to `folder`, its path is written as a relative path, so
    that map and folder can be moved together.

    Raises:
        InputError: if a file cannot be written.
    """
    make_folder(folder)
    here = folder.resolve()
    paths = []
    for scenario in scenarios:
        path = folder / f"{scenario.name}.yaml"
        values = scenario.model_dump(mode="json", exclude_none=True)
        if Path(values.get("map", "")).is_relative_to(here.parent):
            values["map"] = os.path.relpath(values["map"], here)
        write_text(path, yaml.safe_dump(values, sort_keys=False))
        paths.append(path)
    return paths


def _check_redrawable(
    base: Scenario, family: Family, last: str, source: Path | str
) -> None:
    """Checks that the base's city can be drawn again with other seeds."""
    why = (
        f"not with city_seeds: stages before the last one, {last}, are lists "
        "of names that another draw of the city need not have"
    )
    if family.towards is not None:
        raise InputError(f"{source}: towards: {why}")
    if family.stage not in (None, last):
        raise InputError(f"{source}: stage: {why}")
    folder = scenario_files.map_folder(base)
    for file in (folder.plan, folder.roads):
        if not os.path.isfile(file):
            raise InputError(
                f"{source}: city_seeds: no {file}, so that the city of base "
                f"{base.name} cannot be drawn anew"
            )


def _difference(
    base: Scenario, stage: str, other: str, source: Path | str
) -> frozenset[str]:
    """Returns the structures of a stage that another one lacks."""
    names = []
    for one in (stage, other):
        scenario = base.replaced(stage=one)
        scenario_files.check_files(scenario, source)
        world = load_world(scenario_files.world_file(scenario))
        names.append(structures_in(world))
    difference = names[0] - names[1]
    if not difference:
        raise InputError(
            f"{source}: towards: stage {other} lacks nothing of stage {stage}"
        )
    return frozenset(difference)


def _decay_order(
    table: Path, seed: int, removable: Set[str] | None
) -> list[str]:
    """Returns structures that can be missing, in the order of removal."""
    rows = [
        row
        for _, row in read_records(table, ("name", "class"))
        if (
            row["class"] in _REMOVABLE and not _is_on_a_lot(row)
            if removable is None
            else row["name"] in removable
        )
    ]
    if not rows:
        raise InputError(f"{table}: none of its structures can be missing")
    try:
        xy = np.array([(float(row["x"]), float(row["y"])) for row in rows])
        if not (np.abs(xy) <= _FARTHEST).all():  # NaN fails, too.
            raise ValueError
    except (KeyError, ValueError):
        raise InputError(
            f"{table}: x, y: every structure needs finite numbers"
        ) from None
    rng = np.random.default_rng(seed)
    low, high = xy.min(axis=0), xy.max(axis=0)
    distance = np.linalg.norm(xy - rng.uniform(low, high), axis=1)
    return [rows[k]["name"] for k in np.argsort(distance, kind="stable")]


def _is_on_a_lot(row: Mapping[str, str]) -> bool:
    """Returns whether a structure occupies a lot only until it is built on."""
    tags = (row.get("tags") or "").split()
    return "_lot_" in row["name"] and "lot" in tags


def _draw_losses(
    table: Path, parts: Mapping[str, float], seed: int, source: Path | str
) -> frozenset[str]:
    """Draws the missing structures, each class independently.

    `parts` maps classes to shares from 0 to 1. The structures of a smaller
    share are among those of a greater share.
    """
    records = [row for _, row in read_records(table, ("name", "class"))]
    rows = [row for row in records if not _is_on_a_lot(row)]
    missing: set[str] = set()
    for kind, part in parts.items():
        names = sorted(row["name"] for row in rows if row["class"] == kind)
        if not names:
            raise InputError(f"{source}: scattered: no {kind!r} in {table}")
        rng = np.random.default_rng([seed, *kind.encode()])
        order = rng.permutation(len(names))
        missing.update(names[k] for k in order[: round(part * len(names))])
    return frozenset(missing)
