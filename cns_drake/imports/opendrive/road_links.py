"""Links between roads, lanes and junctions that lead nowhere.

The import joins lanes where they meet and does not use the links. A link to
something that is not in the file is still reported as a fault.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cns_drake.base.xml_elements import Element
from cns_drake.imports.import_faults import ImportFaults

_ENDS = ("predecessor", "successor")


def count_dangling_links(top: Element, faults: ImportFaults) -> None:
    """Counts the links of a file to things that are not in it.

    Args:
        top: the outermost element.
        faults: the counts.
    """
    roads = {one.attributes.get("id", ""): one for one in top.all("road")}
    junctions = {one.attributes.get("id", "") for one in top.all("junction")}
    for name, road in roads.items():
        own = road.attributes.get("junction", "-1")
        if own not in ("-1", "") and own not in junctions:
            faults.add("road of a junction that is not in the file", name)
        for end in _ENDS:
            kind, linked = _linked(road, end)
            known = junctions if kind == "junction" else roads
            if linked is not None and linked not in known:
                faults.add(f"link to a {kind} that is not in the file", name)
        for _ in _dangling_lanes(road, roads):
            faults.add("link to a lane that is not in the file", name)
    for junction in top.all("junction"):
        name = junction.attributes.get("id", "")
        for connection in junction.all("connection"):
            for key in ("incomingRoad", "connectingRoad", "linkedRoad"):
                linked = connection.attributes.get(key)
                if linked is not None and linked not in roads:
                    faults.add(
                        "connection of a junction with a road that is not in"
                        " the file",
                        f"junction {name}",
                    )


def _linked(road: Element, end: str) -> tuple[str, str | None]:
    """Returns kind and id of the link at an end of a road, if any."""
    link = road.first("link", end)
    if link is None:
        return "road", None
    kind = link.attributes.get("elementType", "road")
    return kind, link.attributes.get("elementId")


def _dangling_lanes(
    road: Element, roads: Mapping[str, Element]
) -> Iterator[Element]:
    """Yields the links of a road's lanes to lanes that are not there."""
    sections = _sections(road)
    for k, section in enumerate(sections):
        for end, at in zip(_ENDS, (k - 1, k + 1), strict=True):
            if 0 <= at < len(sections):
                beside = [sections[at]]
            else:
                kind, linked = _linked(road, end)
                if kind != "road" or linked is None or linked not in roads:
                    continue
                # The link names the end of the other road, which some files
                # omit.
                others = _sections(roads[linked])
                beside = others[:1] + others[-1:]
            there = {
                lane.attributes.get("id")
                for other in beside
                for lane in _lanes(other)
            }
            for lane in _lanes(section):
                for link in lane.all("link", end):
                    if link.attributes.get("id") not in there:
                        yield link


def _sections(road: Element) -> list[Element]:
    found = list(road.all("lanes", "laneSection"))
    return sorted(found, key=lambda one: one.number("s", 0.0))


def _lanes(section: Element) -> Iterator[Element]:
    for side in ("left", "center", "right"):
        yield from section.all(side, "lane")
