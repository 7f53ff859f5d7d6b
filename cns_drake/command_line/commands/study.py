"""The command `study`, which runs an experiment."""

from pathlib import Path
from typing import Annotated

import typer

from evaluation.base import (
    InputError,
    ended_by_interrupts,
    note,
    read_yaml,
    shared_options,
    terminal,
)
from evaluation.command_line import Align

GROUP = "Study what change costs"


def study(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME|FILE.yaml")
    ] = None,
    maps: Annotated[list[str] | None, typer.Argument(metavar="MAP")] = None,
    output: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    quick: Annotated[bool, typer.Option("--quick")] = False,
    task: Annotated[list[str] | None, typer.Option(metavar="NAME")] = None,
    method: shared_options.Methods = None,
    align: Align = "auto",
    pose_gap: shared_options.PoseGap = None,
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="METHOD.NAME=VALUE|FIELD=VALUE"),
    ] = None,
    allow_code: Annotated[bool, typer.Option("--allow-code")] = False,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    width: shared_options.Width = None,
    font: shared_options.Font = None,
    title: shared_options.Title = True,
    list_all: Annotated[bool, typer.Option("--list")] = False,
    show: Annotated[bool, typer.Option("--show")] = False,
) -> None:
    """Measure how a change affects each method.

    An experiment is a file that describes a database drive and a query drive,
    what differs between the two drives, and which tasks and methods to measure.
    The drives are simulated but not recorded. The command writes results.csv
    (one number per row), queries.csv (one query per row) and a page,
    index.html. To resume after an interruption, run the same command again.

    Args:
        name: Name of a shipped experiment, as --list shows it, or an experiment
            file of your own.
        maps: Maps to use instead of the experiment's maps: names of shipped
            maps, or folders of your own maps.
        output: Folder for the results.
        quick: Measure less than the whole experiment, in order to finish
            sooner. The section `quick` of the experiment says what is measured
            then.
        task: Task to measure: place, pose, localise, map, change, cost or seen.
            By default the tasks of the experiment. May be repeated.
        method: Method to run, instead of the methods of the experiment: the
            name of a shipped method, a Python file with your own method, or the
            word standard, which means all standard methods. May be repeated.
        override: New value for a setting of a method, such as
            btc.candidates=20, or for a field of the experiment, such as
            seeds=[1,2]. For a field inside another field, join both names by a
            dot, such as query.city.years=[0,5]. A list in brackets makes a
            setting a factor, which varies. If a setting has several numbers,
            separate them by commas without brackets. May be repeated.
        allow_code: Allow the experiment to run the Python files that it names;
            those of --method or --set run anyway.
        list_all: List the shipped experiments, and do nothing else.
        show: Print the experiment file, as a start for your own experiment, and
            do nothing else.

    Example:
        cns-drake study ladder suburbia --quick --output ladder
    """
    with ended_by_interrupts("cns-drake"):
        from evaluation.study import (
            experiment_text,
            load_experiment,
            shipped_experiments,
        )

    if list_all:
        for known, path in shipped_experiments().items():
            typer.echo(f"{known:<10}  {read_yaml(path)['about']}")
        return
    if name is None:
        raise InputError("study: give an experiment, or --list")
    if show:
        typer.echo(experiment_text(name), nl=False)
        return
    experiment = load_experiment(
        name,
        override or (),
        quick=quick,
        tasks=task or (),
        methods=method or (),
        allow_code=allow_code,
    )
    if output is None:
        raise InputError("--output: missing")
    with ended_by_interrupts("cns-drake"):
        from cns_drake.studies import run_study
        from evaluation.base import choose_cluster
        from evaluation.command_line import show_results
        from evaluation.results import PrintStyle

    printed = PrintStyle.checked(width, font, title)
    with terminal.resumable():
        page = run_study(
            experiment,
            output,
            choose_cluster(jobs, scheduler),
            maps or (),
            source=name,
            printed=printed,
            on_note=note,
            align=align,
            pose_gap=pose_gap,
        )
    show_results(page)
