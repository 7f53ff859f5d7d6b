"""What the documents say of options, files, formats, packages is so."""

import pydoc
import re

from helpers import documents
from mcap.reader import make_reader
import typer

from cns_drake import command_line as cli
from evaluation import command_line as evaluation_cli
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
    "--t_offset",
    "--fcd-output.geo",
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
    group = "cns_drake.plugins"  # Of entry points: no module.
    named = [
        code
        for code in PRESENT
        if code.startswith(("evaluation.", "worlds.", "cns_drake."))
        and code != group
    ]
    assert named
    for code in named:
        assert pydoc.locate(code.partition("(")[0]) is not None, code


def test_each_command_begins_with_its_function():
    page = documents.read("CONTRIBUTING.md")
    rows = documents.table(page, "| command | function |")
    assert rows
    for _, text in rows:
        pieces = re.findall(r"`([^`]+)`", text)
        places = [one for one in pieces if "/" in one]
        code = "".join(
            path.read_text()
            for place in places
            for path in documents.ROOT.glob(
                place + "*/*.py" * ("." not in place)
            )
        )
        for name in set(pieces).difference(places):
            assert f"\ndef {name}(" in code, name


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
    page = documents.read("docs/recordings.md")
    (example,) = (
        block.text
        for block in documents.fenced(page)
        if "open_drive(" in block.text
    )
    scan = open_drive(short_recording).scan(0)
    assert f"# NumPy: {' '.join(scan.dtype.names)}\n" in example
    topics = documents.read("docs/recordings.md").text
    assert f"{scan.dtype.itemsize} bytes a point" in topics
