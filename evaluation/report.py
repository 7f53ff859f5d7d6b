"""The whole benchmark on a folder of recordings: tables and figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from evaluation import figures
from evaluation.change import Surveyed, compare, survey_sequence
from evaluation.collection import City, Recording, find_cities
from evaluation.errors import InputError
from evaluation.files import completing, make_folder
from evaluation.maps import (
    PICTURE_DIVISIONS,
    VOXEL_SIZE,
    VoxelMap,
    map_sequence,
)
from evaluation.methods import known_methods, make_method
from evaluation.metrics import MODES
from evaluation.place_recognition import run
from evaluation.progress import Track, silent
from evaluation.tables import (
    ChangeResult,
    RecognitionResult,
    Table,
    change_table,
    recognition_table,
)


@dataclass(frozen=True)
class _Mapped:
    """A drive with the map for pictures and the one for the TCR."""

    surveyed: Surveyed
    fine: VoxelMap


def write_report(recordings: Path, output: Path, track: Track = silent) -> Path:
    """Measures all recordings in a folder and writes tables and figures.

    Files: `report.md`, `tcr.csv`, `place_recognition.csv`, and a folder
    `figures`. A city with one stage only gets its route drawn.

    Args:
        recordings: folder of recordings; drives of one map that share stage
            and route with others serve as same-stage controls.
        output: folder to write, made if needed.
        track: reports progress.

    Returns:
        The path of `report.md`.

    Raises:
        InputError: if a recording cannot be read, or the output not be
            written.
    """
    cities = find_cities(recordings)
    pictures = output / "figures"
    make_folder(pictures)
    changes: list[ChangeResult] = []
    recognitions: list[RecognitionResult] = []
    drawn: list[tuple[str, Path]] = []
    for city in cities:
        city_changes, city_pictures = _measure_change(city, pictures, track)
        changes += city_changes
        drawn += city_pictures
        city_recognitions = _measure_recognition(city, track)
        recognitions += city_recognitions
        drawn += _draw_curves(city, city_recognitions, pictures)
    tables = {
        "tcr.csv": change_table(changes),
        "place_recognition.csv": recognition_table(
            [r.counting(mode) for r in recognitions for mode in MODES]
        ),
    }
    for name, table in tables.items():
        _write(output / name, table.to_csv())
    path = output / "report.md"
    _write(path, _to_markdown(*tables.values(), drawn))
    return path


def _measure_change(
    city: City, pictures: Path, track: Track
) -> tuple[list[ChangeResult], list[tuple[str, Path]]]:
    mapped = {
        stage: _map(recording, track)
        for stage, recording in city.stages.items()
    }
    drawn = []
    for stage, one in mapped.items():
        path = pictures / f"route_{city.name}_{stage}.png"
        figures.draw_route(
            one.fine, one.surveyed.positions, one.surveyed.name, path
        )
        drawn.append((f"Route of {one.surveyed.name}", path))
    results = []
    for earlier, later in city.change_pairs():
        control = city.control(earlier, later)
        first, last = mapped[earlier.stage], mapped[later.stage]
        report = compare(
            first.surveyed,
            last.surveyed,
            None if control is None else _map(control, track).surveyed,
        )
        stages = (earlier.stage, later.stage)
        results.append(ChangeResult(city.name, stages, report))
        path = pictures / f"change_{city.name}_{'_'.join(stages)}.png"
        figures.draw_change(
            last.fine, first.surveyed.voxels, (later.name, earlier.name), path
        )
        drawn.append((f"{later.name} with what {earlier.name} lacks", path))
    return results, drawn


def _measure_recognition(city: City, track: Track) -> list[RecognitionResult]:
    results = []
    for database, query in city.recognition_pairs():
        for name in known_methods():
            outcome = run(
                database.sequence,
                query.sequence,
                make_method(name, {}),
                track=track,
            )
            stages = (database.stage, query.stage)
            results.append(RecognitionResult(city.name, stages, outcome))
    return results


def _draw_curves(
    city: City, results: list[RecognitionResult], pictures: Path
) -> list[tuple[str, Path]]:
    if not results:
        return []
    curves = [
        (f"{' -> '.join(r.stages)} {r.outcome.method}", r.outcome)
        for r in results
    ]
    title = f"{city.name}, mode {results[0].outcome.metrics.mode}"
    for kind in ("pdf", "png"):
        path = pictures / f"pr_{city.name}.{kind}"
        figures.draw_pr_curves(title, curves, path)
    return [(f"Precision and recall, {title}", path)]


def _map(recording: Recording, track: Track) -> _Mapped:
    fine = map_sequence(
        recording.sequence, VOXEL_SIZE / PICTURE_DIVISIONS, track
    )
    if len(fine) == 0:
        raise InputError(f"{recording.name}: no scan holds a point")
    coarse = fine.coarsen(PICTURE_DIVISIONS)
    return _Mapped(survey_sequence(recording.sequence, coarse), fine)


def _to_markdown(
    change: Table, recognition: Table, drawn: list[tuple[str, Path]]
) -> str:
    parts = ["# Structural change and place recognition\n"]
    if change.rows:
        parts.append("## Temporal change ratio\n")
        parts.append(change.to_markdown())
    if recognition.rows:
        parts.append("## Place recognition\n")
        parts.append(recognition.to_markdown())
    parts.append("## Figures\n")
    for title, path in drawn:
        parts.append(f"![{title}](figures/{path.name})\n\n{title}\n")
    return "\n".join(parts)


def _write(path: Path, text: str) -> None:
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")
