"""The verb `report`: all recordings in a folder."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from evaluation.alignment import When
from evaluation.base import Cluster, choose_cluster, note
from evaluation.recognition import PROTOCOLS, RetrievalProtocol, choose_methods
from evaluation.results import PrintStyle
from evaluation.study import find_recordings, study_recordings


def report(
    recordings: Path | str,
    output: Path | str,
    methods: Iterable[Path | str] = (),
    *,
    settings: Iterable[str] = (),
    protocols: Mapping[str, RetrievalProtocol] | None = None,
    lidar: str | None = None,
    columns: int | None = None,
    odometry: str | None = None,
    pose_gap: float | None = None,
    align: When = "auto",
    cluster: Cluster | None = None,
    with_costs: bool = True,
    printed: PrintStyle | None = None,
    on_note: Callable[[str], None] = note,
) -> Path:
    """Evaluates all recordings in a folder, as `cns-eval report` does.

    Returns the page `index.html` of the folder `output`, which then also
    contains the tables and pictures. Finished work is not repeated.

    Args:
        recordings: folder that contains the recordings.
        output: folder of the results.
        methods: names of methods, or Python files; by default the standard
            methods.
        settings: `METHOD.NAME=VALUE` for parameters that differ.
        protocols: name -> protocol; the first is the main one. The default is
            `random-yaw`.
        lidar: name of the LiDAR, for recordings with several LiDARs.
        columns: number of columns of `.bin` files.
        odometry, pose_gap: see `open_drive`.
        align: whether to align the recordings of a map: `auto` (if their worlds
            differ), `always` or `never`.
        cluster: runs the jobs; by default a job for each core.
        with_costs: whether the page shows the times and memory of methods.
        printed: style of the charts for print.
        on_note: is called with notes for the user.

    Raises:
        InputError: something cannot be read, used or written, or there is
            nothing to compare.

    Example:
        from evaluation import report

        page = report("drives", "report", ["solid", "btc"])
    """
    cluster = cluster or choose_cluster(None, None)
    chosen = choose_methods(methods, settings)
    # The verdict on the world comes before notes on how drives are read.
    held: list[str] = []

    def told(text: str) -> None:
        on_note(text)
        while held and text.startswith("world: "):
            on_note(held.pop(0))

    try:
        found = find_recordings(
            Path(recordings),
            held.append,
            lidar=lidar,
            columns=columns,
            odometry=odometry,
            pose_gap=pose_gap,
        )
        for choice in chosen:
            made = choice.make()
            for text in {made.assumption(one.lidar_field) for one in found}:
                if text is not None:
                    held.append(text)
        return study_recordings(
            found,
            Path(output),
            cluster,
            chosen,
            protocols or {"random-yaw": PROTOCOLS["random-yaw"]},
            source=str(recordings),
            with_costs=with_costs,
            printed=printed,
            on_note=told,
            align=align,
        )
    finally:
        for text in held:
            on_note(text)
