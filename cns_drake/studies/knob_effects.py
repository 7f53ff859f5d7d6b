"""The effect of each knob on the difference of two drives.

A city's change has three knobs: the offset of the drives, the structures that
are absent at the earlier stage, and those that are lower there. Each is taken
back in turn, and the drives are simulated anew.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
import shutil
import tempfile

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.map_folder import MESH_FOLDER
from cns_drake.city.generation.city_structures import make_city
from cns_drake.city.generation.generate import render_stages
from cns_drake.city.plan.stages import Stage, load_stages
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.simulation.simulated_drive import DriveSimulation
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.study import trend_databases
from evaluation.study.chosen_methods import choose_methods

_AS_IT_IS = "as_it_is"
# Variant of the earlier stage -> its title.
_TITLES = {
    _AS_IT_IS: "as it is",
    "no_aside": "the earlier drive in the middle of its lanes",
    "nothing_absent": "nothing absent",
    "nothing_lower": "nothing lower",
    "no_change": "the earlier drive in the later stage",
}


def knob_effects(
    earlier: Scenario, later: Scenario, cluster: Cluster
) -> dict[str, list[trend_databases.TrendPoint]]:
    """Simulates the pair as it is and with each knob taken back.

    The earlier drive is the database, and one of the same map at a later stage
    the query. The result is title -> a point for each method.

    Raises:
        InputError: the map's files cannot be used.
    """
    with tempfile.TemporaryDirectory(prefix="calibration_") as scratch:
        folder = Path(scratch) / "map"
        drives = _variants(earlier, later, folder)
        points = trend_databases.measure_drives(
            later.name,
            DriveSimulation(later),
            {name: DriveSimulation(drive) for name, drive in drives.items()},
            dict.fromkeys(drives),
            Path(scratch) / "study",
            cluster,
            choose_methods(),
            # Cities were fitted to the paper's numbers.
            PAPER_PROTOCOL,
        )
    return {
        _TITLES[name]: [one for one in points if one.database == name]
        for name in drives
    }


def _variants(
    earlier: Scenario, later: Scenario, folder: Path
) -> dict[str, Scenario]:
    """Builds the required stages; returns the drives through them."""
    source = map_folder(earlier)
    first, last = earlier.stage, later.stage
    if first is None or last is None or map_folder(later).path != source.path:
        raise InputError(f"{later.name}: map: it is not that of {earlier.name}")
    city = make_city(source.path)
    names = [structure.name for structure in city.structures]
    stages = load_stages(source.stage_plan, names)
    as_it_is = stages.on_its_own(first)
    plans = {
        _AS_IT_IS: as_it_is,
        "nothing_absent": as_it_is.model_copy(update={"absent": {}}),
        "nothing_lower": as_it_is.model_copy(update={"lower": {}}),
    }
    drives = {}
    for variant, plan in plans.items():
        if variant != _AS_IT_IS and plan == as_it_is:
            continue
        # Drives share a world if their maps have the same name.
        path = folder / variant / source.path.resolve().name
        whole = Stage(story="the whole city")
        alone = stages.model_copy(update={"stages": {first: plan, "99": whole}})
        files = render_stages(
            source.name, city, alone, [first], source.stage_plan
        )
        (path / MESH_FOLDER).mkdir(parents=True)
        shutil.copy(source.roads, path)
        for name, text in files.items():
            (path / name).write_text(text, encoding="utf-8")
        drives[variant] = earlier.model_copy(update={"map": str(path)})
    if earlier.aside:
        drives["no_aside"] = drives[_AS_IT_IS].model_copy(update={"aside": 0.0})
    drives["no_change"] = earlier.model_copy(update={"stage": last})
    return {
        name: drives[name].model_copy(update={"name": name})
        for name in _TITLES
        if name in drives
    }


def effect_lines(
    effects: Mapping[str, Sequence[trend_databases.TrendPoint]],
) -> Iterator[str]:
    """Yields a table of TCR_sym, and of AUC and R@1 of each method."""
    methods = [point.method for point in next(iter(effects.values()))]
    yield "  ".join(
        [f"{'AUC/R@1':<44} TCR_sym", *(f"{m:>15}" for m in methods)]
    )
    for title, points in effects.items():
        numbers = [f"{p.auc:>10.3f}/{p.recall_at_1:.2f}" for p in points]
        change = points[0].tcr_sym
        yield "  ".join([f"{title:<44}  {change:.4f}", *numbers])
