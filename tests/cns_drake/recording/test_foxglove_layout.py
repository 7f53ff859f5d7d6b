"""The Foxglove layout that ships with the data shows what recordings hold."""

import json

import pytest
from rosbags.highlevel import AnyReader

from worlds.maps import worlds_folder


@pytest.fixture(scope="module")
def layout():
    return json.loads((worlds_folder() / "foxglove_layout.json").read_text())


@pytest.fixture(scope="module")
def messages(short_recording):
    """Topic -> its first message, as read by an independent library."""
    first = {}
    with AnyReader([short_recording]) as reader:
        for connection, _, data in reader.messages():
            if connection.topic not in first:
                first[connection.topic] = reader.deserialize(
                    data, connection.msgtype
                )
    return first


def panels_of(node):
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    return panels_of(node["first"]) + panels_of(node["second"])


def test_panels_are_those_configured(layout):
    # The keys that an import needs.
    for name in ("configById", "globalVariables", "playbackConfig"):
        assert isinstance(layout[name], dict)
    assert layout["playbackConfig"]["speed"] == 1
    panels = panels_of(layout["layout"])
    assert sorted(panels) == sorted(layout["configById"])
    assert {name.split("!")[0] for name in panels} == {"3D", "Plot"}


def test_clouds_are_coloured_by_their_fields(layout, messages):
    coloured_by = []
    frames = {
        transform.child_frame_id
        for transform in messages["/tf_static"].transforms
    } | {"map", "base_link"}
    for name, panel in layout["configById"].items():
        if not name.startswith("3D!"):
            continue
        assert panel["followTf"] in frames
        shown = {key.removeprefix("frame:") for key in panel["transforms"]}
        assert shown <= frames
        # Foxglove hides topics unless a layout shows them.
        assert panel["topics"].pop("/objects/boxes") == {"visible": True}
        for topic, settings in panel["topics"].items():
            assert settings["visible"] is True
            assert settings["colorMode"] == "colormap"
            fields = {field.name for field in messages[topic].fields}
            assert settings["colorField"] in fields
            coloured_by.append(settings["colorField"])
    assert sorted(coloured_by) == ["intensity", "label"]


def test_plots_lead_to_numbers(layout, messages):
    plotted = [
        path["value"]
        for panel in layout["configById"].values()
        for path in [*panel.get("paths", []), panel.get("xAxisPath")]
        if path is not None
    ]
    assert len(plotted) == 9
    for path in plotted:
        topic, *fields = path.split(".")
        value = messages[topic]
        for field in fields:
            value = getattr(value, field)
        assert isinstance(value, float)
