"""The command `compare`."""

from __future__ import annotations

from math import isnan
from pathlib import Path
from typing import Annotated

import typer

from evaluation.base import InputError, check_writable, shared_options, terminal
from evaluation.command_line.printed_text import spaced_interval

# Endings of figures.
_FIGURES = (".pdf", ".svg", ".png")

GROUP = "Recognise places"


def compare(
    tables: Annotated[
        list[Path] | None, typer.Argument(metavar="RESULTS")
    ] = None,
    metric: str = "auc",
    protocol: Annotated[
        str | None, typer.Option(metavar="random-yaw|paper|recorded|own")
    ] = None,
    verified: Annotated[bool, typer.Option("--verified")] = False,
    rankings: Annotated[bool, typer.Option("--rankings")] = False,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE.pdf|svg|png")
    ] = None,
    width: shared_options.Width = None,
    font: shared_options.Font = None,
    title: shared_options.Title = True,
    json: shared_options.Json = False,
) -> None:
    """Rank the methods in tables of results.

    RESULTS are files like results.csv, or folders that contain such a file. The
    command ranks the methods in these tables and in the shipped tables by their
    means over the conditions that all tables share. Without RESULTS, it ranks
    those of the shipped tables.

    From eight maps on, each mean has a 95 % interval over maps. With a
    queries.csv next to each table, the command also prints the difference in
    R@1 between any two methods, with its interval and p-value, both corrected
    for the number of differences; with --metric relative_auc_strict, which
    methods survive.

    Args:
        tables: Tables of results to compare, or folders with a results.csv.
        metric: Metric by which the methods are ranked: auc, r1 or another
            metric in the tables, or a Python file that registers a metric of
            your own. An unknown name makes the command list all metrics.
        protocol: Protocol of the results to compare; own stands for changed
            options. By default, each result is compared with results of the
            same protocol.
        verified: Rank the results that were measured with geometric
            verification. By default, the results without geometric verification
            are ranked.
        rankings: Compare only how the tables rank the methods, each over its
            own conditions, such as of simulated and of real drives: prints
            Kendall's tau.
        output: File for a figure of the ranking.

    Example:
        cns-eval compare mine/results.csv
    """
    from evaluation.results import (
        PrintStyle,
        compare_tables,
        draw_comparison,
        save_figure,
    )

    printed = PrintStyle.checked(width, font, title)
    if output is None and printed != PrintStyle():
        raise InputError("--output: missing, the file of the figure")
    if output is not None and output.suffix not in _FIGURES:
        raise InputError(
            f"--output: {output}: the name must end in {', '.join(_FIGURES)}"
        )
    if output is not None and rankings:
        raise InputError("--output: --rankings has no figure")
    if output is not None:
        check_writable(output)
    found = compare_tables(
        tables or (), metric, protocol, verified=verified, rankings=rankings
    )
    for note in found.notes:
        terminal.note(note)
    rows = [
        (
            mean.method,
            f"{terminal.number_text(mean.value)}{spaced_interval(mean.interval)}",
        )
        for mean in found.ranked
    ]
    if rows:
        where = f"mean of {found.conditions or 'its own'} conditions"
        known = any(spaced_interval(mean.interval) for mean in found.ranked)
        level = "  [95 %]" if known else ""
        rows.insert(0, ("method", f"{found.metric}, {where}{level}"))
    for compared in found.differences:
        difference = compared.difference
        rows.append(
            (
                f"R@1 of {compared.first} - {compared.second}",
                f"{terminal.number_text(difference.value)}"
                f"{spaced_interval(difference.interval) or '  cannot show'}"
                f"  p {_p_text(difference.p_value)}",
            )
        )
    for one in found.survival:
        rows.append(
            (
                f"{one.method}, loss in {one.cities} cities",
                f"{terminal.number_text(one.loss)}{spaced_interval(one.interval)}"
                f"  {one.verdict}",
            )
        )
    for alike in found.agreements:
        rows.append(
            (
                f"Kendall's tau, {alike.first} and {alike.second}",
                terminal.number_text(alike.tau),
            )
        )
        families = (
            f"{terminal.number_text(alike.tau_of_families)}"
            f"{spaced_interval(alike.interval)}"
        )
        rows.append(
            (
                f"the same over {len(alike.families)} families of methods",
                f"{families}  p {_p_text(alike.p_value)}",
            )
        )
    terminal.show(found.to_json(), rows, json=json)
    if output is not None:
        figure = draw_comparison(found, printed)
        kinds = [output.suffix.removeprefix(".")]
        save_figure(figure, output.with_suffix(""), kinds, printed.settings)
        terminal.note(f"wrote {output}")


def _p_text(p_value: float) -> str:
    if isnan(p_value):
        return terminal.number_text(p_value)
    return "< 0.0001" if p_value < 0.5e-4 else f"{p_value:.4f}"
