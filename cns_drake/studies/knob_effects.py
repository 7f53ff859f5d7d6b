"""The effect of each knob on the difference of two drives.

A city's change has three knobs: the offset of the drives, the structures that
are absent at the earlier stage, and those that are lower there. Each is taken
back in turn, and the drives are simulated anew.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
import shutil
import tempfile

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import run_jobs
from cns_drake.base.map_folder import MESH_FOLDER
from cns_drake.city.generation.city_structures import make_city
from cns_drake.city.generation.generate import render_stages
from cns_drake.city.plan.stages import Stage, load_stages
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder
from cns_drake.simulation.simulated_drive import DriveSimulation
from cns_drake.studies.tasks.change import ChangeTask
from cns_drake.studies.tasks.place import PlaceTask
from cns_drake.studies.tasks.task import Jobs, NamedDrive, Pair
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.study.chosen_methods import choose_methods
from evaluation.study.parts import StudyFiles

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
) -> dict[str, dict[str, dict[str, float]]]:
    """Simulates the pair as it is and with each knob taken back.

    The earlier drive is the database, and one of the same map at a later stage
    the query. The result is title -> method -> metric -> value; TCR_sym is that
    of the method "".

    Raises:
        InputError: the map's files cannot be used.
    """
    with tempfile.TemporaryDirectory(prefix="calibration_") as scratch:
        drives = _variants(earlier, later, Path(scratch) / "map")
        methods = choose_methods()
        jobs = Jobs(StudyFiles(Path(scratch) / "study"), methods)
        query = NamedDrive(later.name, DriveSimulation(later))
        tasks = PlaceTask({}, ""), ChangeTask({}, "")
        pairs = {}
        for name, drive in drives.items():
            database = NamedDrive(name, DriveSimulation(drive))
            # Cities were fitted to the paper's numbers.
            pairs[name] = Pair(name, database, query, database, PAPER_PROTOCOL)
            jobs.expect(pairs[name])
        parts = {
            name: [task.measure(pair, jobs) for task in tasks]
            for name, pair in pairs.items()
        }
        run_jobs(jobs.jobs.values(), cluster)
        effects: dict[str, dict[str, dict[str, float]]] = {}
        for name, found in parts.items():
            values = effects[_TITLES[name]] = {}
            for task, part in zip(tasks, found, strict=True):
                for one in task.numbers(part.read(), None):
                    if not one.gate:
                        by_metric = values.setdefault(one.method, {})
                        by_metric[one.metric] = one.value
        return effects


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
    effects: Mapping[str, Mapping[str, Mapping[str, float]]],
) -> Iterator[str]:
    """Yields a table of TCR_sym, and of AUC and R@1 of each method."""
    methods = [name for name in next(iter(effects.values())) if name]
    yield "  ".join(
        [f"{'AUC/R@1':<44} TCR_sym", *(f"{m:>15}" for m in methods)]
    )
    for title, found in effects.items():
        numbers = [
            f"{found[m]['auc']:>10.3f}/{found[m]['r1']:.2f}" for m in methods
        ]
        change = found[""]["tcr_sym"]
        yield "  ".join([f"{title:<44}  {change:.4f}", *numbers])
