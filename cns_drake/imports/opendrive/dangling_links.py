"""Counts links in an OpenDRIVE file whose targets are not in the file."""

from collections.abc import Iterator, Mapping, Sequence

from cns_drake.base.xml_elements import Element
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.lane_reader import is_single_sided

# Elements of links at the two ends of a road or lane.
_ENDS = ("predecessor", "successor")


def count_dangling_links(top: Element, faults: ImportFaults) -> None:
    """Counts links to objects that are not in the file, as faults.

    Objects are roads, lanes and junctions. `top` is the root element of the
    file.
    """
    roads = {road.attrib.get("id", ""): road for road in top.all("road")}
    junctions = {
        junction.attrib.get("id", "") for junction in top.all("junction")
    }
    for name, road in roads.items():
        own = road.attrib.get("junction", "-1")
        if own not in ("-1", "") and own not in junctions:
            faults.add("road of a junction that is not in the file", name)
        for end in _ENDS:
            kind, linked = _link_at(road, end)
            known = junctions if kind == "junction" else roads
            if linked is not None and linked not in known:
                faults.add(f"link to a {kind} that is not in the file", name)
        for _ in _dangling_lane_links(road, roads):
            faults.add("link to a lane that is not in the file", name)
    for junction in top.all("junction"):
        name = junction.attrib.get("id", "")
        for connection in junction.all("connection"):
            for key in ("incomingRoad", "connectingRoad", "linkedRoad"):
                linked = connection.attrib.get(key)
                if linked is not None and linked not in roads:
                    faults.add(
                        "connection of a junction with a road that is not in"
                        " the file",
                        f"junction {name}",
                    )


def _link_at(road: Element, end: str) -> tuple[str, str | None]:
    """Returns kind and id of the link at a road's end; None without a link."""
    link = road.first("link", end)
    if link is None:
        return "road", None
    kind = link.attrib.get("elementType", "road")
    return kind, link.attrib.get("elementId")


def _dangling_lane_links(
    road: Element, roads: Mapping[str, Element]
) -> Iterator[Element]:
    """Yields the links of a road's lanes to lanes that do not exist."""
    sections = _lane_sections(road)
    for number, section in enumerate(sections):
        for end in _ENDS:
            beyond = _lanes_beyond(road, sections, number, end, roads)
            if beyond is None:
                continue
            for lane in _section_lanes(section):
                for link in lane.all("link", end):
                    if link.attrib.get("id") not in beyond:
                        yield link


def _lanes_beyond(
    road: Element,
    sections: Sequence[Element],
    number: int,
    end: str,
    roads: Mapping[str, Element],
) -> set[str | None] | None:
    """Returns the numbers of the lanes beyond one end of a road's section.

    Args:
        road: the road.
        sections: the road's lane sections, in their order along the road.
        number: index of the section.
        end: `predecessor` or `successor`.
        roads: name of a road -> the road.

    Returns:
        The numbers as in the file. None beyond an end of the road that no
        known road follows.
    """
    step = 1 if end == "successor" else -1
    at = number + step
    if 0 <= at < len(sections):
        beside = [sections[at]]
        # One side of a road may continue through sections of the other side.
        while is_single_sided(sections[at]) and 0 < at < len(sections) - 1:
            at += step
            beside.append(sections[at])
    else:
        kind, linked = _link_at(road, end)
        if kind != "road" or linked is None or linked not in roads:
            return None
        # The link names the end of the other road; some files omit it.
        others = _lane_sections(roads[linked])
        beside = others[:1] + others[-1:]
    return {
        lane.attrib.get("id")
        for section in beside
        for lane in _section_lanes(section)
    }


def _lane_sections(road: Element) -> list[Element]:
    """Returns the sections of a road's lanes, sorted along the road."""
    sections = road.all("lanes", "laneSection")
    return sorted(sections, key=lambda section: section.number("s", 0.0))


def _section_lanes(section: Element) -> Iterator[Element]:
    """Yields the lanes of a section."""
    for side in ("left", "center", "right"):
        yield from section.all(side, "lane")
