"""What the README says of options, files, formats and packages is so."""

import pydoc
import re

from mcap.reader import make_reader
import pytest
import readme
import typer
import yaml

from cns_drake import cli
from cns_drake.beam_pattern import LIDAR_PRESETS
from cns_drake.scenario import LidarConfig
from cns_drake.variation import Family
from evaluation import cli as evaluation_cli
from evaluation.sequences import open_sequence

TEXT = readme.read()
CODES = [piece.text for piece in readme.inline(TEXT)]
# Of tools that are not this project's.
FOREIGN_OPTIONS = {"--nthreads", "--nworkers"}


def table(heading):
    """Returns the rows below a row of headings, as lists of cells."""
    _, _, rest = TEXT.partition(f"\n| {heading} |")
    lines = rest.split("\n\n")[0].splitlines()[2:]
    cells = [re.split(r"(?<!\\)\|", line)[1:-1] for line in lines]
    assert cells
    return [[cell.strip() for cell in row] for row in cells]


def commands():
    """Returns `PROGRAM COMMAND` -> its options."""
    found = {}
    for program, app in (
        ("cns-drake", cli.app),
        ("cns-eval", evaluation_cli.app),
    ):
        group = typer.main.get_command(app)
        for name, command in group.commands.items():
            found[f"{program} {name}"] = {
                option for each in command.params for option in each.opts
            }
    return found


def test_the_table_has_every_command():
    rows = [cells[0].strip("`") for cells in table("command | does")]
    named = {" ".join(row.split()[:2]) for row in rows}
    assert named - {"python -m"} == commands().keys()


def test_options_exist(capsys):
    from cns_drake.city.__main__ import main

    with pytest.raises(SystemExit):
        main(["--help"])
    known = set(re.findall(r"--[a-z]+", capsys.readouterr().out))
    known = known.union(*commands().values(), ["--help"])
    named = {code.split()[0] for code in CODES if code.startswith("--")}
    assert len(named) > 8
    assert named - known - FOREIGN_OPTIONS == set()


def test_names_of_commands_exist():
    named = {
        code for code in CODES if re.fullmatch(r"cns-(drake|eval) \w+", code)
    }
    assert named
    assert named <= commands().keys()


def test_links_lead_somewhere():
    targets = re.findall(r"\]\(([^)]+)\)", TEXT)
    headings = re.findall(r"^#+ (.+)$", TEXT, re.MULTILINE)
    anchors = {
        re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-")
        for heading in headings
    }
    assert len(targets) > 10
    for target in targets:
        if target.startswith("#"):
            assert target[1:] in anchors
        elif not target.startswith("https://"):
            assert (readme.ROOT / target).exists(), target


def test_files_of_the_project_are_there():
    folders = tuple(
        f"{path.name}/" for path in readme.ROOT.iterdir() if path.is_dir()
    )
    named = [
        code
        for code in CODES
        if code.startswith(folders) and not code.startswith("output/")
    ]
    assert len(named) > 5
    for code in named:
        assert list(readme.ROOT.glob(code.replace("NN", "*"))), code


def test_names_in_modules_exist():
    named = [code for code in CODES if code.startswith("evaluation.")]
    assert named
    for code in named:
        assert pydoc.locate(code.partition("(")[0]) is not None, code


def test_lidar_presets():
    _, _, rest = TEXT.partition("LiDAR presets: ")
    listed = readme.inline(rest.split("\n\n")[0].split("A recording")[0])
    assert [piece.text for piece in listed] == list(LIDAR_PRESETS)


def test_options_of_a_lidar():
    rows = table("option of a LiDAR | effect")
    values = yaml.safe_load("\n".join(row[0].strip("`") for row in rows))
    assert len(values) == len(rows)
    config = LidarConfig.model_validate(values)
    default = LidarConfig()
    for field, value in values.items():
        assert getattr(config, field) == value != getattr(default, field)


def test_what_multiplies_families():
    lines = [
        code for code in CODES if code.startswith(("routes: {", "lidars: ["))
    ]
    assert len(lines) == 2
    values = yaml.safe_load("\n".join(["base: riverside_01", *lines]))
    family = Family.model_validate(values)
    assert family.routes.count == 10
    assert set(family.lidars) <= LIDAR_PRESETS.keys()


def test_topics(short_recording):
    said = {
        topic.strip("` "): row[1]
        for row in table("topic | type | content")
        for topic in row[0].split(",")
    }
    (file,) = short_recording.glob("*.mcap")
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        attachments = {a.name for a in make_reader(stream).iter_attachments()}
    schemas = summary.schemas
    assert said == {
        channel.topic: schemas[channel.schema_id].name
        for channel in summary.channels.values()
    }
    assert attachments == {
        code for code in CODES if code.endswith(".json") and "/" not in code
    }


def test_fields_of_points(short_recording):
    (example,) = (
        block.text
        for block in readme.fenced(TEXT)
        if "sequences.open(" in block.text
    )
    scan = open_sequence(short_recording).scan(0)
    assert f"# NumPy: {' '.join(scan.dtype.names)}\n" in example
    assert f"{scan.dtype.itemsize} bytes a point" in TEXT


def test_dependencies():
    said = {
        name
        for row in table("package | why")
        for name in row[0].replace("`", "").split(", ")
    }
    project = (readme.ROOT / "pyproject.toml").read_text()
    _, _, rest = project.partition("\ndependencies = [\n")
    needed = {
        name.removesuffix("-cpu")
        for name in re.findall(r'^  "([\w-]+)', rest.split("\n]")[0], re.M)
    }
    assert said == needed


def test_what_is_installed_is_what_ci_installs():
    script = (readme.ROOT / ".ci/run").read_text()
    (command,) = (code for code in CODES if code.startswith("apt install "))
    for package in command.split()[2:]:
        assert f" {package} " in script
    assert "npm ci" in script
    # It takes the line itself out of the README.
    pattern = re.search(r"grep -m1 '([^']+)' README\.md", script)[1]
    line = re.search(pattern, TEXT, re.MULTILINE)[0]
    assert "'.[test]'" in line
