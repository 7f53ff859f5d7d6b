"""Studies whose jobs run in the process of a test, one after the other.

Tests of `evaluation.base.jobs` cover other processes, which would only slow
these tests.
"""

from pathlib import Path

from matplotlib.figure import Figure
import numpy as np
import pytest

from cns_drake.pictures import StageScene
from evaluation.base import Cluster, Reporter
from evaluation.base.jobs.processes import nothing_left
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    choose_methods,
    chosen_methods,
)
from evaluation.study import (
    find_recordings,
    recorded_city,
    run,
    study,
    study_recordings,
)


def do(jobs):
    """Runs unfinished jobs, sorted so that none needs a later one.

    Returns:
        The names of the jobs that ran.
    """
    done = []
    for job in jobs:
        if not nothing_left(job.step):
            job.step.run(Reporter())
            done.append(job.name)
    return done


def run_here(patch, *modules):
    """Has modules run their jobs in this process."""
    for module in modules:
        patch.setattr(
            module, "run_jobs", lambda jobs, cluster, unit="": do(jobs)
        )


def jobs_here(patch):
    """Has studies run their jobs in this process, and write no page.

    Returns:
        A list that gets the names of the jobs of each study.
    """
    from cns_drake.scenarios import map_step
    from cns_drake.studies import recording

    runs = []
    run_here(patch, map_step, recording)
    for module in (run, recorded_city):
        patch.setattr(
            module,
            "run_jobs",
            lambda jobs, cluster, unit="": runs.append(do(jobs)),
        )
    patch.setattr(
        study,
        "write_page",
        lambda results, queries, folder, **options: folder / "index.html",
    )
    return runs


def asked_studies(patch):
    """Has `cns-drake study` measure nothing.

    Returns:
        A list that gets the experiment, the maps and the source of each study.
    """
    from cns_drake import studies

    calls = []

    def run_study(experiment, output, cluster, maps, **options):
        calls.append((experiment, tuple(maps), options["source"]))
        return Path(output) / "index.html"

    patch.setattr(studies, "run_study", run_study)
    return calls


def ship_methods(patch, *names):
    """Makes studies believe that these methods are the shipped ones."""
    patch.setattr(chosen_methods, "shipped_methods", lambda: names)
    return names


def report(recordings, output, methods=None, protocols=None, **more):
    """Measures a folder of recordings; returns the path of the page."""
    chosen = choose_methods() if methods is None else tuple(methods)
    with pytest.MonkeyPatch.context() as patch:
        run_here(patch, run, recorded_city)
        return study_recordings(
            find_recordings(recordings),
            output,
            Cluster(),
            chosen,
            protocols or {"random-yaw": RANDOM_YAW_PROTOCOL},
            source=str(recordings),
            **more,
        )


def leave_figures_unrendered(patch):
    """Has figures made but not rendered, which takes half of a study's time.

    Drives are drawn on a blank picture of their stage.

    For tests of other results than what figures show.
    """

    def write(figure, file, **options):
        Path(file).write_text("<svg>a figure</svg>")

    def blank(scene, view, width, height, **options):
        return np.zeros((height, width, 3), dtype=np.uint8)

    patch.setattr(Figure, "draw_without_rendering", lambda figure: None)
    patch.setattr(Figure, "savefig", write)
    patch.setattr(StageScene, "photograph", blank)
