"""Impossible road networks: errors name file, field and fault."""

import pytest

from evaluation.base import InputError
from worlds.roads import load_road_network

FAULTS = {
    "unknown key": (
        lambda c: c["roads"]["e"].update(colour="red"),
        r"roads\.e\.colour: Extra inputs",
    ),
    "wrong type": (
        lambda c: c["roads"]["e"].update(lane_width="wide"),
        r"roads\.e\.lane_width: Input should be a valid number",
    ),
    "number as text": (
        lambda c: c["junctions"]["east"].update(kerb_radius="6"),
        r"junctions\.east\.kerb_radius: Input should be a valid number",
    ),
    "not finite": (
        lambda c: c["junctions"]["east"].update(position=[float("nan"), 0]),
        r"junctions\.east\.position\.0: Input should be a finite number",
    ),
    "default": (
        lambda c: c["defaults"].update(lane_width=-3.0),
        r"defaults\.lane_width: Input should be greater than 0",
    ),
    "missing": (
        lambda c: c["roads"]["e"].pop("end"),
        r"roads\.e\.end: Field required",
    ),
    "name that leads to another folder": (
        lambda c: c["roads"].update({"../../e": c["roads"].pop("e")}),
        r"roads\.\.\./\.\./e\.\[key\]: String should match pattern",
    ),
    "name of a junction with a control character": (
        lambda c: c["junctions"].update({"a\x1b": c["junctions"]["east"]}),
        r"junctions\..*\[key\]: String should match pattern",
    ),
    "unknown junction": (
        lambda c: c["roads"]["e"].update(end="nowhere"),
        r"roads\.e\.end: no junction 'nowhere'",
    ),
    "dangling": (
        lambda c: [c["roads"].pop(name) for name in ("ne", "se")],
        r"junctions\.east: 1 road\(s\) end here",
    ),
    "dead end that is none": (
        lambda c: c["junctions"]["east"].update(dead_end=True),
        r"junctions\.east: 3 road\(s\) end here, exactly 1 at a dead end must",
    ),
    "unused junction": (
        lambda c: c["junctions"].update(far={"position": [900, 900]}),
        r"junctions\.far: 0 road\(s\) end here",
    ),
    "crossing": (
        lambda c: c["roads"].update(
            bad={"start": "west", "end": "east", "via": [[0, 40, 10]]}
        ),
        r"roads\.\w+: meets road \w+ outside a junction",
    ),
    "tight corner": (
        lambda c: c["roads"]["ne"].update(via=[[80, 80, 90]]),
        r"roads\.ne\.via: the rounded corners .* need 90\.00 m",
    ),
    "no lanes": (
        lambda c: c["roads"]["e"].update(lanes=[0, 0]),
        r"roads\.e\.lanes: the road has no lane",
    ),
    "too short": (
        lambda c: c["junctions"]["centre"].update(kerb_radius=70.0),
        r"roads\.e: its junctions need",
    ),
    "heights": (
        lambda c: c["roads"]["e"].update(heights=[[2, 1.0]]),
        r"roads\.e: heights must lie between the junctions",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_file_field_and_fault(load, cross, fault):
    spoil, message = FAULTS[fault]
    spoil(cross)
    with pytest.raises(InputError, match=r"roads\.yaml: " + message) as error:
        load(cross)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("- 1", r"\(top level\)"),
        ("roads: {}\njunctions: {}", "junctions: at least 1 needed"),
    ],
)
def test_files_that_hold_no_network(tmp_path, text, fault):
    path = tmp_path / "roads.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=f"roads.yaml: {fault}") as error:
        load_road_network(path)
    assert "\n" not in str(error.value)


_TWO_ROADS = """
junctions: {{a: {{position: [0, 0]}}, b: {{position: [{far}, 0]}}}}
roads:
  one: {{start: a, end: b, via: [{via}]}}
  two: {{start: a, end: b}}
"""


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("far", "via", "fault"),
    [
        # The roads lie on each other and would never part.
        (200, "", r"roads\.one: it leaves a junction .* via"),
        ("1.0e+308", "", r"junctions\.b\.position\.0: .*less than or equal"),
        # On the inside of the bend the road's edge crosses itself.
        (200, "[0, 80, 20], [200, 80, 0]", r"roads\.one: the outline crosses"),
    ],
)
def test_roads_of_no_shape(tmp_path, far, via, fault):
    path = tmp_path / "roads.yaml"
    path.write_text(_TWO_ROADS.format(far=far, via=via))
    with pytest.raises(InputError, match=rf"roads\.yaml: {fault}"):
        load_road_network(path)
    if "via" in fault:
        path.write_text(_TWO_ROADS.format(far=far, via="[100, 120, 40]"))
        load_road_network(path)
