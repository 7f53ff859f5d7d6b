"""No tag, attribute or member of what an import builds is dropped in silence.

For each of the most used keys on each element that is built: the triangles
change, or the counts name the key, or the report says that the key is read or
changes no shape.
"""

import json
from pathlib import Path
from xml.etree import ElementTree

from helpers.imported_cities import read_city
from helpers.small_cityjson import house
import pytest
import yaml

from worlds.imports import cityjson, opendrive
from worlds.imports.faults import ImportFaults
from worlds.imports.opendrive.road_reader import read_roads

# The most used attributes of OpenDRIVE, and some of none of its versions.
ATTRIBUTES = (
    "id name length junction rule s t x y z a b c d hdg sOffset tOffset zOffset"
    " hOffset width height radius inner outer type subtype level direction"
    " value unit max country text dynamic orientation pitch roll validLength"
    " side weight color material laneChange space speed restriction code"
    " distance tStart tEnd widthStart widthEnd heightStart heightEnd"
    " zOffsetStart zOffsetEnd radiusStart radiusEnd lengthStart lengthEnd"
    " detachFromReferenceLine perpToRoad closed outer fillType laneType"
    " elementId contactPoint singleSide roadWorks curvature travelDir new"
)
OF_ALL = """<road id="1" length="200" junction="-1" name="a"><link><predecessor
elementType="road" elementId="9"/><successor elementType="road"
elementId="8"/></link><type s="0" type="town"><speed max="50" unit="km/h"/>
</type><planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/>
</geometry><geometry s="100" x="100" y="0" hdg="0" length="100"><arc
curvature="0.001"/></geometry></planView><elevationProfile><elevation s="0"
a="0" b="0" c="0" d="0"/></elevationProfile><lateralProfile><superelevation
s="0" a="0" b="0" c="0" d="0"/></lateralProfile><lanes><laneOffset s="0"
a="0" b="0" c="0" d="0"/><laneSection s="0"><left><lane id="1"
type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/><height
sOffset="0" inner="0" outer="0"/><roadMark sOffset="0" type="solid"><type
name="solid"><line length="3" space="3" tOffset="0" sOffset="0"/></type>
</roadMark></lane></left><center><lane id="0" type="none"/></center>
</laneSection></lanes><objects><object id="1" type="pole" s="10" t="9"
height="3" radius="1"><repeat s="10" length="20" distance="5" tStart="9"
tEnd="9"/></object><object id="2" type="building" s="50"
t="20"><outlines><outline><cornerLocal u="0" v="0" z="0"
height="3"/><cornerLocal u="5" v="0" z="0" height="3"/><cornerLocal u="5"
v="5" z="0" height="3"/></outline></outlines>
</object></objects><signals><signal id="3" s="40" t="9" type="274"
dynamic="no"/></signals></road><junction id="7" name="j"><connection id="0"
incomingRoad="1" connectingRoad="1" contactPoint="start"/></junction>"""


def table(source):
    page = Path(source.__file__).with_name("parts.yaml")
    return yaml.safe_load(page.read_text("utf-8"))["elements"]


def check_accounted(faults, element, keys):
    told = {fault.kind for fault in faults.rows()}
    lines = {
        word
        for line in faults.parts()
        if line.startswith(f"{element}: ")
        for word in line.split(": ")[-1].split()
    }
    for key in keys:
        assert key in lines or f"{key} of {element}, not read" in told, key


@pytest.mark.parametrize(
    "tag",
    sorted({e.tag for e in ElementTree.fromstring(f"<a>{OF_ALL}</a>").iter()}
           - {"a", "left", "center"}),
)  # fmt: skip
def test_each_attribute_of_each_element_of_opendrive_is_accounted_for(
    tmp_path, tag
):
    read = table(opendrive)[tag].get("read", [])
    more = [
        key for key in ATTRIBUTES.split() if key not in " ".join(read).split()
    ]
    root = ElementTree.fromstring(f"<OpenDRIVE>{OF_ALL}</OpenDRIVE>")
    element = next(root.iter(tag))
    for key in more:
        # The names of things may refer to each other.
        element.set(key, element.get(key, "1.5"))
    path = tmp_path / "a.xodr"
    path.write_text(ElementTree.tostring(root, "unicode"))
    faults = ImportFaults()
    read_roads(path, faults)
    check_accounted(faults, tag, more)


# Names that files of CityJSON use on things of any kind, and some of none.
MEMBERS = (
    "type lod boundaries semantics template transformationMatrix texture"
    " material geographicalExtent address extent attributes parents children"
    " geometry surfaces values name id identifier description function class"
    " usage roofType storeysAboveGround storeysBelowGround measuredHeight"
    " storeyHeightsAboveGround yearOfConstruction yearOfDemolition"
    " relativeToTerrain relativeToWater conditionOfConstruction creationDate"
    " terminationDate validFrom validTo h_min h_max h_dak height roofheight"
    " slope azimuth inclination orientation area volume color colour"
    " identificatie b3_h_maaiveld b3_dak_type bgt_status plus_status gml_id"
    " trunkDiameter crownDiameter species direction occupancy dimension"
    " elevation appearance version title"
)


@pytest.mark.parametrize(
    "element", ["object", "geometry", "attributes", "semantics", "surface"]
)
def test_each_member_of_each_thing_of_cityjson_is_accounted_for(
    tmp_path, element
):
    document = house({"function": "house"})
    one = document["CityObjects"]["a"]
    geometry = one["geometry"][0]
    semantics = {
        "surfaces": [{"type": "RoofSurface"}],
        "values": [[None, 0, None, None, None, None]],
    }
    geometry["semantics"] = semantics
    thing = {
        "object": one,
        "geometry": geometry,
        "attributes": one["attributes"],
        "semantics": semantics,
        "surface": semantics["surfaces"][0],
    }[element]
    read = set(table(cityjson)[element]["read"])
    more = [key for key in MEMBERS.split() if key not in read | set(thing)]
    for key in more:
        thing[key] = "1.5"
    path = tmp_path / "a.json"
    path.write_text(json.dumps(document))
    city = read_city(path)
    assert len(city.objects) == 1
    check_accounted(city.faults, element, more)
