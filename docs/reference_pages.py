"""Writes the pages in `docs/reference` from the code that they explain.

    python docs/reference_pages.py

Tables of fields come from the docstrings and types of the models that read
the input files, tables of options from the programs themselves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import is_dataclass
import inspect
import itertools
from pathlib import Path
import re
import typing
from typing import Any

import griffe
from pydantic import BaseModel
from pydantic.fields import FieldInfo
import typer

from cns_drake import command_line as cli
from cns_drake.export import export_formats
from cns_drake.motion import Speeds
from cns_drake.scenarios import (
    CityConfig,
    DriverConfig,
    OffsetConfig,
    RideConfig,
    Scenario,
    TrafficConfig,
    TransientConfig,
)
from cns_drake.sensors import (
    CameraSection,
    ImuSection,
    LidarSection,
    OdometrySection,
    WeatherConfig,
)
from cns_drake.studies import DrawnRoute, Fleet
from evaluation import command_line as evaluation_cli
from evaluation.drives import data_sets
from evaluation.lidar_sheets import (
    LIDAR_PRESETS,
    Head,
    LidarSheet,
    NoddingSheet,
    Response,
    ReturnsSheet,
    RosetteSheet,
    SpinningSheet,
)
from evaluation.methods import (
    MethodConfig,
    find_method,
    optional_methods,
    shipped_methods,
)
from evaluation.recognition import METRICS, Metric
from evaluation.results import in_table_order
from evaluation.study import Experiment, MadeMap, causes
from worlds.city import (
    BuildingPlan,
    CityPlan,
    DistrictPlan,
    Growth,
    LinePlan,
    ObjectPlan,
    ParkingPlan,
    PatchPlan,
    RowPlan,
    ScatterPlan,
    Stage,
    Stages,
    StreetPlan,
)
from worlds.imports import map_sources
from worlds.roads import JunctionEntry, RoadEntry, RoadsFile, RoadStyle
from worlds.shapes import Route, RouteLeg

FOLDER = Path(__file__).resolve().parent / "reference"
Sections = dict[str, type[BaseModel]]

SCENARIO: Sections = {
    "Scenario": Scenario,
    "Route": RouteLeg,
    "Speeds": Speeds,
    "Driver": DriverConfig,
    "Ride": RideConfig,
    "Traffic": TrafficConfig,
    "City": CityConfig,
    "Transient": TransientConfig,
    "Offset": OffsetConfig,
    "LiDARs": LidarSection,
    "Cameras": CameraSection,
    "IMU": ImuSection,
    "Weather": WeatherConfig,
    "Odometry": OdometrySection,
}
LIDAR: Sections = {
    "A data sheet": LidarSheet,
    "A spinning LiDAR": SpinningSheet,
    "A LiDAR with prisms": RosetteSheet,
    "A nodding LiDAR": NoddingSheet,
    "Returns": ReturnsSheet,
    "Response": Response,
    "Head": Head,
}
CITY: Sections = {
    "roads.yaml": RoadsFile,
    "A road's style": RoadStyle,
    "A road": RoadEntry,
    "A junction": JunctionEntry,
    "city.yaml": CityPlan,
    "A district": DistrictPlan,
    "A patch": PatchPlan,
    "A building": BuildingPlan,
    "A row": RowPlan,
    "A parking lot": ParkingPlan,
    "An object": ObjectPlan,
    "A line": LinePlan,
    "A scatter": ScatterPlan,
    "A street": StreetPlan,
    "stages.yaml": Stages,
    "A stage": Stage,
    "A growth": Growth,
}
EXPERIMENT: Sections = {
    "Experiment": Experiment,
    "A map to make": MadeMap,
    "A route at random": DrawnRoute,
    "A fleet": Fleet,
}


def _sections_of_methods() -> Sections:
    """Returns the classes of settings, by the names of their methods."""
    names: dict[type[MethodConfig], list[str]] = {}
    for name in (*shipped_methods(), *optional_methods()):
        names.setdefault(find_method(name).Config, []).append(name)
    return {", ".join(some): config for config, some in names.items()}


METHODS: Sections = {
    "All methods": MethodConfig,
    **_sections_of_methods(),
}
# Where the page of the fields of a drive finds those of a data sheet.
_OF_LIDARS = "lidars.md"
_SHEETS = "../../evaluation/lidar_sheets"
# What stands for the default where the model's own does not say it.
_FILLED_IN = {
    (Scenario, "name"): "the file's name",
    (Experiment, "name"): "the file's name",
    (Experiment, "maps"): "all shipped maps",
    (Experiment, "tasks"): "`place`",
    (Experiment, "methods"): "the standard methods",
    (Experiment, "protocol"): "`random-yaw`",
    (Experiment, "baseline"): "the first values",
    (Fleet, "seed"): "the condition's seed",
    (LidarSheet, "pattern"): "`spinning`",
    (LidarSheet, "period"): "`0.05` or `0.1`",
    (ReturnsSheet, "rows"): "one row",
    (Response, "far"): "any range",
}


def pages() -> dict[str, str]:
    """Returns the text of every page by its file name."""
    return {
        "scenario.md": _fields_page(
            "Fields of a drive",
            "[Drives](../scenarios.md) explains these fields with examples. "
            "Relative paths start at the folder of the file.",
            SCENARIO,
        ),
        "lidars.md": _lidars_page(),
        "city.md": _fields_page(
            "Fields of a city",
            "[Files of a city](../city.md#the-files) says what each file is "
            "for, what weights and ranges are, and lists the archetypes of "
            "buildings and the objects.",
            CITY,
        ),
        "experiment.md": _fields_page(
            "Fields of an experiment",
            "[Studies](../studies.md) explains these fields with examples. It "
            "also lists what can vary, and the settings of tasks. Relative "
            "paths start at the working folder, but those of data sheets of "
            "LiDARs at the folder of the experiment.",
            EXPERIMENT,
        )
        + f"\n{_causes()}",
        "methods.md": _fields_page(
            "Settings of the methods",
            "[Methods](../methods.md) shows how to change these settings.\n\n"
            + _table_of_methods(),
            METHODS,
        ),
        "data.md": _data_page(),
        "metrics.md": _metrics_page(),
        "commands.md": _commands_page(),
    }


def _data_page() -> str:
    drives = [(one.title, one.files) for one in data_sets().values()]
    maps = [
        (one.title, ", ".join(f"`{ending}`" for ending in one.suffixes))
        for one in map_sources()
    ]
    parts = [
        _heading("Data"),
        "`cns-eval` reads these drives ([evaluation](../evaluation.md#data)):",
        _table(("drives of", "path that you give"), drives),
        "`cns-drake import` makes maps from these files"
        " ([imports](../imports.md)):",
        _table(("format", "files"), maps),
        "`cns-drake export` writes recordings in the formats"
        f" {', '.join(f'`{name}`' for name in export_formats())}"
        " ([exports](../recordings.md#exports)).",
    ]
    return "\n\n".join(parts) + "\n"


def _table_of_methods() -> str:
    names = in_table_order((*shipped_methods(), *optional_methods()))
    rows = []
    for name in names:
        method = find_method(name)
        rows.append(
            (
                f"`{name}`",
                method.title,
                method.source or "this project",
                "yes" if method.standard else "no",
                str(method.scans_per_place),
                "yes" if method.estimates_poses() else "no",
            )
        )
    heading = (
        "`--method`",
        "method",
        "publication",
        "standard",
        "scans of a place",
        "estimates poses",
    )
    return _table(heading, rows)


def _causes() -> str:
    lines = []
    for cause in causes().values():
        side = "scans" if cause.scans_only else " and ".join(cause.sides)
        alone = "" if cause.combined else ", not part of `all`"
        line = f"- `{cause.name}` ({cause.title}; {side}{alone}): "
        line += " ".join(cause.about.split())
        if levels := cause.strengths.get("levels"):
            line += f". In the levels: {_values_of_levels(levels)}"
        lines.append(line)
    parts = [
        "## Causes of change",
        "The experiment [`ladder`](../ladder.md) measures each cause by itself,"
        " at up to four levels, and all of them together. The"
        " [levels](../ladder.md#levels) combine weaker causes. Brackets have"
        " the title of a cause, and what it changes: the drive of the database"
        " or of the query, or the query's scans.",
        "\n".join(lines),
    ]
    return "\n\n".join(parts) + "\n"


def _values_of_levels(fields: Any, path: str = "") -> str:
    """Returns the values at each level of the fields of drives."""
    if not isinstance(fields, dict):
        return f"`{path}` {_plain(fields)}"
    return "; ".join(
        _values_of_levels(value, f"{path}.{name}".lstrip("."))
        for name, value in fields.items()
    )


def _fields_page(title: str, introduction: str, sections: Sections) -> str:
    links = {model: heading for heading, model in sections.items()}
    if sections is not LIDAR:
        links |= {LidarSheet: _OF_LIDARS}
    brackets = "Brackets have the values of a field, and its default, if any."
    parts = [_heading(title), f"{introduction}\n\n{brackets}"]
    for heading, model in sections.items():
        description, meanings = explain_fields(model)
        lines = [
            _field(
                field.alias or name,
                [_values(model, name), describe_default(model, name)],
                meanings[name] + _links(field.annotation, links),
            )
            for name, field in own_fields(model).items()
        ]
        parts += [f"## {heading}", description, "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _field(name: str, words: list[str], meaning: str) -> str:
    """Returns a field with its values and default in brackets."""
    said = "; ".join(word for word in words if word not in ("", "none"))
    return f"- `{name}`{f' ({said})' * bool(said)}: {meaning}"


def _lidars_page() -> str:
    fields = _fields_page(
        "LiDARs and their data sheets",
        "[Your own LiDAR](../how-to/own_lidar.md) shows how to write and use a "
        "data sheet. A preset is a data sheet that ships with the program. "
        "[LiDAR presets](../scenarios.md#lidar-presets) explains rates, angles "
        "and the order of firing.",
        LIDAR,
    )
    rows = [
        (f"[`{name}`]({_SHEETS}/{name}.yaml)", *_beams_of(sheet))
        for name, sheet in LIDAR_PRESETS.items()
    ]
    columns = "preset", "rings", "elevations [deg]", "columns", "ranges [m]"
    sources = "The file of each preset names the sources of its numbers:"
    return f"{fields}\n## Presets\n\n{sources}\n\n{_table(columns, rows)}\n"


def _beams_of(sheet: LidarSheet) -> tuple[str, ...]:
    """Returns what the table of presets says of a LiDAR's beams."""
    lowest, highest = sheet.field_deg
    columns = sheet.columns if isinstance(sheet, SpinningSheet) else "-"
    return (
        str(sheet.num_rings),
        f"{highest:g} to {lowest:g}" if lowest < highest else f"{lowest:g}",
        str(columns),
        f"{sheet.ranges[0]:g} to {sheet.ranges[1]:g}",
    )


def own_fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Returns the fields that have a row in the model's table.

    What a road shares with the style of all roads, and a method with all
    methods, and a kind of LiDAR with all LiDARs, is in the tables of those.
    """
    shared: dict[str, FieldInfo] = {}
    for base in (RoadStyle, MethodConfig, LidarSheet):
        if issubclass(model, base) and model is not base:
            shared |= base.model_fields
    fields = model.model_fields
    return {name: fields[name] for name in fields if name not in shared}


def explain_fields(model: type[BaseModel]) -> tuple[str, dict[str, str]]:
    """Returns what docstrings say of a model, and of each field.

    Fields that a model shares with a configuration for Drake are explained in
    the docstring of the dataclass with these fields.
    """
    bases = [base for base in model.__mro__[:0:-1] if is_dataclass(base)]
    description = ""
    meanings = {}
    for explained in (*bases, model):
        docstring = griffe.Docstring(inspect.getdoc(explained) or "")
        texts = []
        for section in docstring.parse("google"):
            if section.kind is griffe.DocstringSectionKind.text:
                texts.append(section.value)
            if section.kind is griffe.DocstringSectionKind.attributes:
                meanings |= {
                    attribute.name: " ".join(attribute.description.split())
                    for attribute in section.value
                }
        description = texts[0] if texts else ""
    return _prose(description), meanings


def describe_default(model: type[BaseModel], name: str) -> str:
    """Returns the default of a field as YAML writes it."""
    field = model.model_fields[name]
    if (model, name) in _FILLED_IN:
        return _FILLED_IN[model, name]
    if field.is_required():
        return "required"
    default = field.get_default(call_default_factory=True)
    if default in (None, (), [], {}, "") or _holds_models(default):
        return "none"
    return f"`{_plain(default)}`"


def _holds_models(value: Any) -> bool:
    values = value.values() if isinstance(value, dict) else [value]
    return any(isinstance(each, BaseModel) for each in values)


def _plain(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(_plain(each) for each in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.10g}"
    return str(getattr(value, "value", value))


def _values(model: type[BaseModel], name: str) -> str:
    """Returns which values a field takes, after the model's JSON schema."""
    schema = model.model_json_schema()
    alias = model.model_fields[name].alias or name
    kind = _kind(schema["properties"][alias], schema.get("$defs", {}))
    # What has limits is a number.
    return re.sub("^number (?=from|above)", "", kind)


def _kind(schema: dict[str, Any], models: dict[str, Any]) -> str:
    """Returns in words what a JSON schema allows; empty for a model."""
    if "$ref" in schema:
        model = models[schema["$ref"].rpartition("/")[2]]
        return "" if model["type"] == "object" else _kind(model, models)
    if "anyOf" in schema:
        kinds = [_kind(each, models) for each in schema["anyOf"]]
        return " or ".join(kind for kind in kinds if kind)
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if "type" not in schema:
        return ""
    if schema["type"] == "array":
        return _list_kind(schema, models)
    if schema["type"] == "object":
        # What a name stands for, whatever the name.
        inner = schema.get("additionalProperties", {})
        kind = _kind(inner, models) if isinstance(inner, dict) and inner else ""
        return f"by name: {kind}" if kind else "values by name"
    words = {"string": "text", "boolean": "`true` or `false`", "null": ""}
    kind = words.get(schema["type"], schema["type"])
    return " ".join(part for part in (kind, _limits(schema)) if part)


def _list_kind(schema: dict[str, Any], models: dict[str, Any]) -> str:
    if "prefixItems" not in schema:
        inner = _kind(schema["items"], models)
        return f"list: {inner}" if inner else "list"
    kinds = [_kind(each, models) for each in schema["prefixItems"]]
    if len(set(kinds)) > 1:
        return f"{len(kinds)} numbers"
    noun, _, limits = kinds[0].partition(" ")
    return f"{len(kinds)} {noun}s {limits}".strip()


def _limits(schema: dict[str, Any]) -> str:
    least, most = schema.get("minimum"), schema.get("maximum")
    above = schema.get("exclusiveMinimum")
    begin = "" if least is None else f"from {least:g}"
    if above is not None:
        begin = f"above {above:g}"
    end = "" if most is None else f"to {most:g}"
    return f"{begin} {end}".strip()


def _links(annotation: Any, headings: dict[type[BaseModel], str]) -> str:
    """Returns links to the tables of the models that a field holds."""
    found = [headings[model] for model in models_in(annotation)]
    if not found:
        return ""
    links = (
        f"[data sheet]({each})"
        if each == _OF_LIDARS
        else f"[{each}](#{_anchor(each)})"
        for each in dict.fromkeys(found)
    )
    return f" See {', '.join(links)}."


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yields the models that an annotation names; a route's are its legs."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield RouteLeg if annotation is Route else annotation
    for argument in typing.get_args(annotation):
        yield from models_in(argument)


def _metrics_page() -> str:
    arrows = {"more": " ↑", "less": " ↓"}

    def values(metric: Metric) -> str:
        text = metric.range_text.removeprefix("a number ")
        text = f"{text[0].upper()}{text[1:]}{arrows.get(metric.better, '')}"
        without = f", undefined if {metric.undefined}"
        return text + without * bool(metric.undefined)

    by_values: dict[str, list[Metric]] = {}
    for metric in METRICS.values():
        by_values.setdefault(values(metric), []).append(metric)
    parts = [
        _heading("Metrics"),
        "The values of the column `metric` in [results.csv]"
        "(../studies.md#the-table-of-results), in groups with the same range."
        " ↑: more is better; ↓: less is. Over conditions, a metric is averaged"
        " by the arithmetic mean of its defined values; an undefined value is"
        " an empty cell, and is left out with a note. [A metric of your own]"
        "(../how-to/own_method.md#a-metric-of-your-own) is a function in a"
        " file. Brackets have the titles of metrics.",
    ]
    for text, metrics in by_values.items():
        # Metrics of which the same is said stand together.
        lines = [
            f"- {', '.join(f'`{one.name}` ({one.label})' for one in alike)}: "
            + over
            for over, alike in itertools.groupby(
                metrics, lambda one: one.over_queries
            )
        ]
        parts += [f"{text}:", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _commands_page() -> str:
    commands = {
        f"{program} {name}": command
        for program, app in (
            ("cns-drake", cli.app),
            ("cns-eval", evaluation_cli.app),
        )
        for name, command in typer.main.get_command(app).commands.items()
    }
    rows = {
        name: [
            (_option(each), _option_default(each), each.help or "")
            for each in command.params
            if each.name != "help"
        ]
        for name, command in commands.items()
    }
    uses = Counter(row for some in rows.values() for row in some)
    shared = [
        row
        for row, number in uses.items()
        if number > 1 and row[1] != "required"
    ]
    parts = [
        _heading("Commands"),
        "Commands print results to stdout, and progress and messages to "
        "stderr. The exit status is 0 on success, 2 for bad input (with an "
        "error of one line), and 1 if some of many jobs failed. Add "
        "`--traceback` to any command to see where in the code an error comes "
        "from. Brackets have what is required, and defaults.",
    ]
    # Of two options with one name, what stands for the value follows, too.
    same = Counter(_name(row) for row in shared)
    for name, command in commands.items():
        own = [row for row in rows[name] if row not in shared]
        others = [
            row[0] if same[_name(row)] > 1 else _name(row)
            for row in rows[name]
            if row in shared
        ]
        parts += [
            f"## {name}",
            _prose(command.help or ""),
            _example(command.epilog),
            _options(own),
        ]
        if others:
            parts.append(
                f"[Also](#options-of-many-commands): {', '.join(others)}."
            )
    parts += ["## Options of many commands", _options(shared)]
    return "\n\n".join(parts) + "\n"


def _name(row: tuple[str, ...]) -> str:
    return f"`{row[0].strip('`').split()[0]}`"


def _options(rows: list[tuple[str, ...]]) -> str:
    """Returns a list of options; brackets have the default, if there is one."""
    return "\n".join(
        f"- {name}{f' ({default})' * (default not in ('none', 'off'))}: {text}"
        for name, default, text in rows
    )


def _option(parameter: Any) -> str:
    """Returns the names of a parameter and what stands for its value."""
    kind = getattr(parameter, "type", None) or parameter.type_descriptor
    choices = map(_plain, getattr(kind, "choices", None) or ())
    metavar = parameter.metavar or "|".join(choices)
    metavar = metavar or kind_of(parameter).removesuffix(" range").upper()
    if parameter.param_type_name == "argument":
        return f"`{metavar}`"
    names = " / ".join([*parameter.opts, *parameter.secondary_opts])
    return f"`{names}`" if parameter.is_flag else f"`{names} {metavar}`"


def kind_of(parameter: Any) -> str:
    """Returns what typer calls a parameter's type, such as `int range`."""
    if hasattr(parameter, "type"):
        return parameter.type.name
    # Since typer 0.29.
    if parameter.type_descriptor.choices:
        return "choice"
    name = parameter.bare_type().lower().removeprefix("list[").rstrip("]")
    return name if parameter.min is None else f"{name} range"


def _option_default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    default = parameter.default
    if isinstance(default, bool):
        return "on" if default else "off"
    if default in (None, (), [], "") or callable(default):
        return "none"
    return f"`{_plain(default)}`"


def _example(epilog: str) -> str:
    """Returns the example at the end of a command's help as a block."""
    lines = epilog.replace("\\\n", " ").splitlines()[2:]
    return "\n".join(
        ["```", *(" ".join(each.split()) for each in lines), "```"]
    )


def _heading(title: str) -> str:
    return (
        f"# {title}\n\n"
        "<!-- Written by docs/reference_pages.py; change the code instead. -->"
    )


def _prose(text: str) -> str:
    paragraphs = text.replace("\b", "").split("\n\n")
    return "\n\n".join(" ".join(each.split()) for each in paragraphs)


def _table(heading: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [heading, ("---",) * len(heading), *rows]
    cells = [[each.replace("|", "\\|") for each in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def _anchor(heading: str) -> str:
    kept = "".join(c for c in heading.lower() if c.isalnum() or c in " -_")
    return kept.replace(" ", "-")


def main() -> None:
    """Writes all pages."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
