"""What the documents say of options, files, formats, packages is so."""

import csv
import itertools
import pydoc
import re

from helpers import documents
from mcap.reader import make_reader
import pytest
import typer

from cns_drake import load_scenario
from cns_drake.city.plan.stages import load_stages
from cns_drake.command_line import cli
from evaluation.command_line import cli as evaluation_cli
from evaluation.drives import open_drive

PAGES = documents.pages()
CODES = [piece.text for page in PAGES for piece in documents.inline(page)]
# A changelog also names commands and options that are gone.
PRESENT = [
    piece.text
    for page in PAGES
    if page.name != "CHANGELOG.md"
    for piece in documents.inline(page)
]
# Options of tools of other projects, and one of the tests.
FOREIGN_OPTIONS = {
    "--nthreads",
    "--nworkers",
    "--config",
    "--tls-ca-file",
    "--tls-cert",
    "--tls-key",
    "--topic",
    "--night",
}


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
                option
                for each in command.params
                for option in (*each.opts, *each.secondary_opts)
            }
    return found


def test_options_exist():
    known = {"--help", "--version", "--traceback"}.union(*commands().values())
    named = {code.split()[0] for code in PRESENT if code.startswith("--")}
    assert len(named) > 8
    assert named - known - FOREIGN_OPTIONS == set()


def test_names_of_commands_exist():
    named = {
        code
        for code in PRESENT
        if re.fullmatch(r"cns-(drake|eval) [\w-]+", code)
    }
    assert named
    assert named <= commands().keys()


def test_files_of_the_project_are_there():
    folders = tuple(
        f"{path.name}/" for path in documents.ROOT.iterdir() if path.is_dir()
    )
    named = [
        code
        for code in CODES
        if code.startswith(folders) and not code.startswith("output/")
    ]
    assert len(named) > 5
    for code in named:
        assert list(documents.ROOT.glob(code.replace("NN", "*"))), code


def test_names_in_modules_exist():
    named = [
        code for code in CODES if code.startswith(("evaluation.", "cns_drake."))
    ]
    assert named
    for code in named:
        assert pydoc.locate(code.partition("(")[0]) is not None, code


@pytest.mark.slow
def test_only_uses_of_lots_end_from_stage_to_stage():
    """As the glossary and the page on cities have it."""
    ended = []
    for folder in sorted(documents.ROOT.glob("worlds/*/")):
        stages = [
            {
                name.partition("/")[0]
                for name in re.findall(
                    '<visual name="([^"]+)"', path.read_text()
                )
            }
            for path in sorted(folder.glob("stage_*.sdf"))
        ]
        for earlier, later in itertools.pairwise(stages):
            assert len(earlier) > 900
            ended += earlier - later
    assert any("market_stall" in name for name in ended)
    assert [name for name in ended if "_lot_" not in name] == []


def test_the_tutorial_names_the_colours_that_its_page_shows():
    folder = load_scenario("riverside_01").folder
    with folder.structures.open() as table:
        names = [row["name"] for row in csv.DictReader(table)]
    stages = load_stages(folder.path / "stages.yaml", names)
    # The page has an entry for each layer that is not empty.
    assert stages.absent("01")
    assert any("_lot_" in name for name in names)
    assert not stages.heights("01").keys() | stages.sites("01").keys()
    (said,) = re.findall(
        r"Tick \*What\s+changed\*\.\s+The page then\s+shows ([^.]+)\.",
        documents.read("docs/tutorial.md").text,
    )
    assert " ".join(said.split()) == (
        "in red all structures that stage 02 adds, "
        "and in violet all structures that stage 02 clears away"
    )


def test_the_home_says_what_the_program_is_before_any_link():
    home = documents.read("docs/index.md").text
    picture = home.index("![")
    assert picture < re.search(r"(?<!!)\[", home).start()
    assert "LiDAR" in home[:picture]


def test_topics(short_recording):
    page = documents.read("docs/recordings.md")
    said = {
        topic.strip("` "): row[1]
        for row in documents.table(page, "## Topics")
        for topic in row[0].split(",")
    }
    # This recording has no traffic.
    of_traffic = {name for name in said if name.startswith("/objects")}
    assert {name: said.pop(name) for name in of_traffic} == {
        "/objects": "vision_msgs/msg/Detection3DArray",
        "/objects/boxes": "foxglove_msgs/msg/SceneUpdate",
        "/objects/motion": "sensor_msgs/msg/PointCloud2",
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
    rows = documents.table(page, "| attachment | holds |")
    assert attachments == {row[0].strip("`") for row in rows}


def test_fields_of_points(short_recording):
    page = documents.read("docs/how-to/open_recordings.md")
    (example,) = (
        block.text
        for block in documents.fenced(page)
        if "open_drive(" in block.text
    )
    scan = open_drive(short_recording).scan(0)
    assert f"# NumPy: {' '.join(scan.dtype.names)}\n" in example
    topics = documents.read("docs/recordings.md").text
    assert f"{scan.dtype.itemsize} bytes a point" in topics


def test_dependencies():
    said = {
        name
        for row in documents.table(
            documents.read("CONTRIBUTING.md"), "| package | why |"
        )
        for name in row[0].replace("`", "").split(", ")
    }
    project = (documents.ROOT / "pyproject.toml").read_text()
    _, _, rest = project.partition("\ndependencies = [\n")
    needed = {
        name.removesuffix("-cpu")
        for name in re.findall(r'^  "([\w-]+)', rest.split("\n]")[0], re.M)
    }
    assert said == needed


def test_ci_installs_the_documented_packages():
    script = (documents.ROOT / ".ci/run").read_text()
    (command,) = (code for code in CODES if code.startswith("apt install "))
    image = (documents.ROOT / "Dockerfile").read_text()
    for package in command.split()[2:]:
        assert f" {package} " in script
        assert f" {package} " in image
    assert "npm ci" in script
    # It takes the line itself out of the page.
    pattern = re.search(r"grep -m1 '([^']+)' README\.md", script)[1]
    text = documents.read("README.md").text
    line = re.search(pattern, text, re.MULTILINE)[0]
    assert "'.[test]'" in line
