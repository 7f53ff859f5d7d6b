"""Records the drives of maps, and measures the experiment `stages`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cns_drake.pictures import draw_drives, draw_stages, load_views
from cns_drake.scenarios import (
    Scenario,
    describe_scenario,
    digest_file,
    digest_inputs,
    load_scenario,
)
from cns_drake.simulation import SimulationSource
from cns_drake.studies.drives.changed_drives import control_drive
from cns_drake.studies.recording import (
    is_recorded,
    plan_recordings,
    usual_frames,
)
from evaluation.base import (
    Cluster,
    InputError,
    Job,
    MakePart,
    Part,
    Reporter,
    Space,
    forecast,
    make_folder,
    natural_key,
    run_jobs,
)
from evaluation.drives import driven_way
from evaluation.recognition import RetrievalProtocol, choose_methods
from evaluation.results import PrintStyle
from evaluation.study import (
    RecordingInfo,
    check_study_output,
    scenario_digest,
    study_recordings,
)
from worlds.maps import MapFolder, recordable_map, recordable_maps

# Mean size of a page.
_PAGE_BYTES = 18e6
# Mean size of a frame in a recording.
_RECORDED_BYTES = 170e3
# Mean size of a frame in the study's folder.
_STUDY_BYTES = 68e3


def reproduce_maps(
    maps: Sequence[str] | None,
    output: Path,
    cluster: Cluster,
    protocols: Mapping[str, RetrievalProtocol],
    *,
    with_pages: bool = True,
    with_recordings: bool = True,
    methods: Sequence[str] = (),
    settings: Sequence[str] = (),
    with_costs: bool = False,
    printed: PrintStyle | None = None,
    on_note: Callable[[str], None] = lambda text: None,
) -> Path:
    """Records the drives of maps, and measures the experiment `stages` on them.

    The recordings are in `<output>/<name>/`, and a web page of each drive is in
    `<output>/pages/<name>.html`. `<output>/pictures` shows the routes of each
    map from above, and a street in its first and last stage. `<output>/report`
    contains the tables and the page of the study. Finished work is not
    repeated. The function returns the path of the study's page.

    Without recordings, only the study is made. Drives that are not recorded
    yet are evaluated while they are simulated, at the same frames as a
    recording.

    Args:
        maps: names or folders of maps; all shipped cities if None.
        output: folder for all results.
        cluster: runs the jobs.
        protocols: name -> protocol of place recognition; the first is the main
            one.
        with_pages: whether drives get web pages.
        with_recordings: whether drives are recorded.
        methods: names or Python files of methods; by default the standard
            methods.
        settings: settings of methods, each `METHOD.NAME=VALUE`.
        with_costs: whether the page shows the times and memory of methods.
        printed: style of the charts for print; None for the default.
        on_note: is called with each note for the user, such as on how long the
            jobs take on this machine, and how much space they need.

    Raises:
        InputError: a map is unknown, the folder cannot be made, or a step
            failed.
    """
    chosen = choose_methods(methods, settings)
    folders = [recordable_map(name) for name in maps or recordable_maps()]
    drives, controls, pictures = [], [], []
    for folder in folders:
        of_map = _recordable_drives(folder)
        drives += of_map
        controls += control_drives(of_map)
        if with_recordings:
            pictures += _plan_pictures(folder, output / "pictures")
    pages = {s.name: output / "pages" / f"{s.name}.html" for s in drives}
    every = [*drives, *controls]
    check_study_output(output / "report")
    make_folder(output)
    space: Space | None = _expected_space(
        usual_frames(every),
        len(drives) if with_pages and with_recordings else 0,
        output,
        with_recordings=with_recordings,
    )
    if with_recordings:
        jobs = plan_recordings(every, output, pages=pages if with_pages else {})
        if told := forecast([*jobs, *pictures], cluster, space):
            on_note(told)
        run_jobs([*jobs, *pictures], cluster, "drives")
        space = None
    return study_recordings(
        sorted(
            (_drive_info(one, output) for one in every),
            key=lambda one: one.name,
        ),
        output / "report",
        cluster,
        chosen,
        protocols,
        source=", ".join(folder.name for folder in folders),
        with_costs=with_costs,
        printed=printed,
        space=space,
        pages={name: f"../pages/{page.name}" for name, page in pages.items()},
        on_note=on_note,
    )


def _expected_space(
    num_frames: int, num_pages: int, output: Path, *, with_recordings: bool
) -> Space:
    """Returns how much space all files need."""
    of_frame = _STUDY_BYTES + (_RECORDED_BYTES if with_recordings else 0.0)
    return Space(output, num_pages * _PAGE_BYTES + num_frames * of_frame)


def _recordable_drives(folder: Path) -> list[Scenario]:
    drives = [
        load_scenario(path) for path in MapFolder(folder).recordable_drives()
    ]
    for drive in drives:
        if drive.map is None:
            raise InputError(
                f"{drive.source}: map: missing, and needed to compare stages"
            )
    return drives


def control_drives(drives: Sequence[Scenario]) -> list[Scenario]:
    """Returns the control of each of a map's drives but that of the last stage.

    The controls go through the last stage.
    """
    last = max(drives, key=lambda drive: natural_key(drive.stage or ""))
    return [
        control_drive(drive, str(last.stage))
        for drive in drives
        if drive is not last
    ]


def _drive_info(scenario: Scenario, output: Path) -> RecordingInfo:
    """Returns the description of a drive, recorded in a folder or simulated."""
    assert scenario.stage is not None  # It has a map.
    fields = describe_scenario(scenario)
    made_by = None
    if not is_recorded(scenario, output):
        made_by = SimulationSource(scenario)
    return RecordingInfo(
        name=scenario.name,
        path=output.absolute() / scenario.name,
        map_name=scenario.folder.name,
        stage=scenario.stage,
        way=driven_way(fields),
        made_by=made_by,
        scenario=scenario_digest(fields),
    )


@dataclass(frozen=True)
class _ReadFile:
    """Input of a job: the content of a file and of all files it refers to."""

    path: Path

    def identity(self) -> list[str]:
        return [self.path.name, digest_file(self.path)]


@dataclass(frozen=True)
class _PictureInput:
    """Input of a job: a scenario and the content of its files."""

    scenario: Scenario

    def identity(self) -> list[object]:
        values = self.scenario.model_dump(mode="json")
        return [values, digest_inputs(self.scenario)]


def _plan_pictures(folder: Path, pictures: Path) -> list[Job]:
    """Returns the jobs that draw pictures of a map.

    Args:
        folder: folder of the map.
        pictures: folder to which the jobs write `<map>_drives.png`, the drives
            from above, and, if the map has a `views.yaml`, `<map>_stages.png`,
            a street in the first and the last stage.
    """
    # Workers may run elsewhere.
    source = MapFolder(folder.resolve())
    pictures = pictures.absolute()
    drives = tuple(
        _PictureInput(load_scenario(file))
        for file in source.recordable_drives()
    )
    drawn: dict[str, tuple] = {"drives": (_picture_drives, drives)}
    if source.views.is_file():
        stages = list(source.stages().values())
        read = tuple(map(_ReadFile, (source.views, stages[0], stages[-1])))
        drawn["stages"] = (_picture_stages, read)
    jobs = []
    for what, (draw, shown) in drawn.items():
        name = f"{source.name}_{what}"
        picture = pictures / f"{name}.png"
        jobs.append(
            Job(
                name=f"picture {source.name} {what}",
                step=MakePart(
                    Part(pictures / "parts" / f"{name}.data"),
                    draw,
                    (shown, picture),
                    figures=(picture,),
                ),
            )
        )
    return jobs


def _picture_drives(
    reporter: Reporter, drives: tuple[_PictureInput, ...], picture: Path
) -> None:
    """Draws the drives of a map from above, and writes the image file."""
    scenarios = [one.scenario for one in drives]
    draw_drives({s.name.replace("_", " "): s for s in scenarios}, picture)


def _picture_stages(
    reporter: Reporter, read: tuple[_ReadFile, ...], picture: Path
) -> None:
    """Draws a street of a map in its first and its last stage."""
    views, *stages = (one.path for one in read)
    draw_stages(
        {stage.stem.replace("_", " "): stage for stage in stages},
        load_views(views)["street"],
        picture,
    )
