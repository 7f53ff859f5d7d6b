"""The study `real`: the tasks of a study, on public data sets of few scans.

Each scan of a data set with poses is a query. The query is searched among all
other scans of the same model of LiDAR: scans of its data set, of other data
sets and of simulated recordings. A place is a single scan; queries get a random
yaw and tilt, as in the protocol `random-yaw`. Each scan is also localised, from
a random initial guess, in a map of the scans around it. In addition, a
classifier is trained to distinguish each data set from simulated scans of the
same model of LiDAR (see `evaluation.real.judge`).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
import importlib.util
import math
from pathlib import Path
from typing import Any

from cns_drake.base import Cluster, InputError, Reporter
from evaluation.clouds import OnNote
from evaluation.localisation import METHODS
from evaluation.methods import MethodConfig, run_module, shipped_methods
from evaluation.real.excerpts import (
    RealScans,
    open_excerpts,
    simulated_drives,
)
from evaluation.real.image_sequences import (
    FOLDER,
    RADIUS,
    UNIT,
    ImageSequence,
    ImageSource,
    open_images,
    open_sequences,
)
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    RECORDED_PROTOCOL,
    Number,
    RetrievalProtocol,
    Role,
)
from evaluation.results import (
    QueryRows,
    Results,
    write_page,
)
from evaluation.study import (
    SHIPPED,
    DescribedSource,
    DriveSource,
    Engine,
    Jobs,
    LocaliseTask,
    MethodChoice,
    NamedDrive,
    Pair,
    PlaceTask,
    PoseTask,
    Result,
    StudyFiles,
    Task,
    choose_methods,
)

_SIMULATED = replace(RANDOM_YAW_PROTOCOL, scans_per_place=1)
# Every real scan is a query and a place.
_REAL = replace(_SIMULATED, query_spacing=1e-6, place_spacing=1e-6)
# Every image is a query or a place.
_IMAGES = replace(
    RECORDED_PROTOCOL,
    radius=RADIUS,
    query_spacing=1e-6,
    place_spacing=1e-6,
    scans_per_place=1,
)
# Name of the experiment.
_NAME = "real"
# More places than all drives have.
_ALL_PLACES = 10**9


def measure_real(
    folder: Path,
    output: Path,
    cluster: Cluster,
    names: Sequence[str] = (),
    settings: Iterable[str] = (),
    simulated: Path | None = None,
    on_note: OnNote = lambda text: None,
    queries: int | None = None,
) -> tuple[Results, QueryRows]:
    """Measures data sets in a folder; writes both tables and the page.

    Args:
        folder: folder that contains a folder for each data set.
        output: folder of the results.
        cluster: runs the jobs.
        names: names of methods and estimators, or Python files with your own;
            if empty, all shipped methods and estimators. A file of an estimator
            defines a function `localise`.
        settings: `METHOD.NAME=VALUE` each, for methods of place recognition.
        simulated: folder of simulated recordings. The scans of these recordings
            are added as places, and a classifier tries to distinguish these
            scans from the real scans. The folder can also contain sequences of
            images, for the classifier.
        on_note: is called with each note for the user.
        queries: number of queries of each sequence of images, see
            `open_sequences`.

    Raises:
        InputError: a method is not known or its file cannot be used, the folder
            contains no data set that can be measured, or a data set cannot be
            read.
    """
    StudyFiles(output).check()
    chosen = list(names) or [*shipped_methods(), *SHIPPED]
    aligning = [name for name in chosen if _is_estimator(name)]
    recognising = [name for name in chosen if name not in aligning]
    choices: tuple[MethodChoice, ...] = ()
    if recognising:
        choices = choose_methods(recognising, settings)
    elif given := next(iter(settings), None):
        raise InputError(f"--set: {given!r}: no method of place recognition")
    tasks: list[Task] = [PlaceTask({}, _NAME), PoseTask({}, _NAME)]
    if aligning:
        tasks.append(LocaliseTask({"methods": aligning}, _NAME))
    tasks.append(_JudgeTask({}, _NAME))
    engine = Engine(
        _NAME,
        {task.name: task for task in tasks},
        {},
        output.absolute(),
        on_note,
    )
    found = open_excerpts(folder, on_note)
    images = open_sequences(folder / FOLDER, on_note, queries)
    units = dict.fromkeys(scans.excerpt.unit for scans in found)
    if images:
        units[UNIT] = None
    made_of = {
        unit: simulated_drives(simulated, unit, on_note) if simulated else []
        for unit in units
    }
    made_images = open_images(simulated / FOLDER) if simulated else []
    _add_images(engine, images, made_of.get(UNIT, []) + made_images, choices)
    for unit, made in made_of.items():
        sets = [scans for scans in found if scans.excerpt.unit == unit]
        if made_images and not sets:
            continue
        _add_unit(engine, sets, made, choices)
        if not made:
            on_note(f"{unit}: no simulated scan of it to judge")
    if not engine.jobs:
        raise InputError(
            f"{folder}: no data set that these methods can measure; the notes"
            " say why"
        )
    results, queries_table = engine.run(cluster)
    write_page(
        results,
        queries_table,
        output,
        title=_NAME,
        about="What do the methods find in public scans?",
        on_note=on_note,
    )
    return results, queries_table


def _is_estimator(name: str) -> bool:
    """Returns whether a name or a file stands for an estimator."""
    if name.endswith(".py"):
        return hasattr(run_module(Path(name)), "localise")
    return name in METHODS


def _add_images(
    engine: Engine,
    sequences: Sequence[ImageSequence],
    made: Sequence[NamedDrive],
    choices: Sequence[MethodChoice],
) -> None:
    """Adds sequences of bird's-eye images to the engine.

    Args:
        engine: the engine.
        sequences: the sequences.
        made: simulated drives, from whose images the classifier tries to
            distinguish the real images.
        choices: the methods.
    """
    if not sequences:
        return
    is_judged = bool(made) and _has_classifier(FOLDER, engine.on_note)
    able = [choice for choice in choices if choice.make().sees_images]
    if unable := [choice.name for choice in choices if choice not in able]:
        names = ", ".join(dict.fromkeys(unable))
        engine.on_note(f"{FOLDER}: not for {names}: these need scans")
    # The ground is at height 0.
    methods = tuple(choice.at_height(0.0) for choice in able)
    for choice, given in zip(methods, able, strict=True):
        engine.methods[choice.key] = choice, given.columns
    jobs = _RealJobs.of(methods, (), frozenset())
    judged = _RealJobs.of((), made, frozenset(made))
    for sequence in sequences:
        pair = Pair(
            map_name=sequence.name,
            names=(sequence.places.name, sequence.queries.name),
            factors={},
            seed=_IMAGES.seed,
            baseline=None,
            stated=_IMAGES,
            key=sequence.name,
            database=sequence.places,
            query=sequence.queries,
            way=sequence.places,
            protocol=_IMAGES,
            settings={"sensor_height": 0.0},
        )
        if methods:
            engine.add([pair], (), jobs, [PlaceTask.name, PoseTask.name])
        if is_judged:
            simulated = replace(
                pair,
                names=("simulated", sequence.places.name),
                key=f"simulated {pair.key}",
                database=NamedDrive("simulated", made[0].source),
                query=sequence.places,
            )
            engine.add([simulated], (), judged, [_JudgeTask.name])


def _add_unit(
    engine: Engine,
    sets: Sequence[RealScans],
    made: Sequence[NamedDrive],
    choices: Sequence[MethodChoice],
) -> None:
    """Adds the data sets of one model of LiDAR to the engine.

    Args:
        engine: the engine.
        sets: the data sets.
        made: simulated drives of this model.
        choices: the methods.
    """
    drives = {
        id(scans): NamedDrive(
            scans.name, scans.source, num_scans=len(scans.drive)
        )
        for scans in sets
    }
    asked = [scans for scans in sets if scans.excerpt.poses]
    methods: tuple[MethodChoice, ...] = ()
    if asked:
        height = asked[0].excerpt.height
        methods = tuple(choice.at_height(height) for choice in choices)
        for choice, given in zip(methods, choices, strict=True):
            # The height is in the protocol's digest.
            engine.methods[choice.key] = choice, given.columns
    tasks = [name for name in engine.tasks if name != _JudgeTask.name]
    if not methods:
        tasks = [name for name in tasks if name == LocaliseTask.name]
    for scans in sets:
        others = [other for other in sets if other is not scans]
        own = drives[id(scans)]
        here, elsewhere = (
            tuple(
                drives[id(other)]
                for other in others
                if (other.excerpt.world == scans.excerpt.world) == is_here
            )
            for is_here in (True, False)
        )
        if scans.excerpt.poses:
            jobs = _RealJobs.of(methods, (*elsewhere, *made), frozenset(made))
            engine.add([_data_set_pair(scans, own, own, here)], (), jobs, tasks)
        if made and _can_be_judged(scans, engine.on_note):
            simulated = NamedDrive("simulated", made[0].source)
            judged = _RealJobs.of((), made, frozenset(made))
            engine.add(
                [_data_set_pair(scans, simulated, own)], (), judged, ["judge"]
            )


def _data_set_pair(
    scans: RealScans,
    database: NamedDrive,
    query: NamedDrive,
    beside: tuple[NamedDrive, ...] = (),
) -> Pair:
    height = scans.excerpt.height
    is_usual = height == MethodConfig().sensor_height
    return Pair(
        map_name=scans.excerpt.world,
        names=(database.name, query.name),
        factors={},
        seed=_REAL.seed,
        baseline=None,
        stated=_REAL,
        key=f"{database.name} {query.name} {scans.excerpt.unit}",
        database=database,
        query=query,
        way=database,
        protocol=_REAL,
        distractors=_ALL_PLACES,
        beside=beside,
        leaves_out_itself=database == query,
        settings={} if is_usual else {"sensor_height": height},
    )


def _can_be_judged(scans: RealScans, on_note: OnNote) -> bool:
    if not scans.excerpt.whole:
        on_note(f"{scans.name}: thinned scans, not judged")
        return False
    return _has_classifier(scans.name, on_note)


def _has_classifier(name: str, on_note: OnNote) -> bool:
    """Returns whether the classifier's package exists; a note says if not."""
    if importlib.util.find_spec("sklearn") is not None:
        return True
    on_note(
        f"{name}: not judged; a package is not installed (pip install"
        " 'cns-drake[judge]')"
    )
    return False


@dataclass
class _RealJobs(Jobs):
    """Jobs on data sets and simulated drives.

    Attributes:
        made: the simulated drives, whose places are farther apart than the
            places of the data sets.
    """

    made: frozenset[NamedDrive] = frozenset()

    @classmethod
    def of(
        cls,
        methods: tuple[MethodChoice, ...],
        distractors: Sequence[NamedDrive],
        made: frozenset[NamedDrive],
    ) -> Any:
        """Returns a function that makes the jobs, for `Engine.add`."""
        return lambda files, *_: cls(files, methods, distractors, made=made)

    def described(
        self,
        drive: NamedDrive,
        role: Role,
        protocol: RetrievalProtocol,
        needs: list[str],
        *,
        kept: bool = False,
    ) -> DescribedSource:
        if drive in self.made:
            protocol = _SIMULATED
        # Several pairs need the same places.
        return super().described(drive, role, protocol, needs, kept=True)


# Number of random samples of patches for the classifier; their AUCs differ by
# up to 0.04.
_DRAWS = 1


class _JudgeTask(Task):
    """Measures how well a classifier tells real scans from simulated scans.

    The simulated scans are the scans of the jobs' distractors.
    """

    name = "judge"

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        part = jobs.files.part("judge", pair.key)
        made = tuple(drive.source for drive in jobs.distractors)
        arguments = pair.query.source, made
        return (jobs.add(part, judge_scans, arguments, version=self.version),)

    def numbers(
        self, found: dict[str, Any] | None, before: Any | None
    ) -> Iterator[Number]:
        if found is None:
            return
        num_real, _ = found["patches"]
        for group, auc in found["auc"].items():
            values = {"auc": auc, "auc_control": found["control"][group]}
            for name, value in values.items():
                if not math.isnan(value):
                    yield Number(group, False, name, value, n=num_real)


def judge_scans(
    reporter: Reporter, source: DriveSource, made: tuple[DriveSource, ...]
) -> dict[str, Any] | None:
    """Returns how well a classifier tells a data set from simulated scans.

    Real images are compared with images that are made of the simulated scans.

    Args:
        reporter: reports notes.
        source: the data set, or a sequence of images.
        made: the simulated drives.

    Returns:
        The result of `evaluation.real.judge.judge_draws`; None for a data set
        of a single place.
    """
    # Imported here: the module needs the optional packages of the extra
    # `judge`. Studies without this task must work without these packages.
    from evaluation.real import judge

    drive = source()
    is_of_images = isinstance(source, ImageSource)
    table = judge.image_table if is_of_images else judge.scan_table
    places = judge.places_of([drive], table, reporter.note)
    if len(places) < 2:
        reporter.note(f"{drive.name}: one place, not judged")
        return None
    simulated = judge.places_of(
        (recording() for recording in made), table, reporter.note
    )
    return judge.judge_draws(places, simulated, _DRAWS)
