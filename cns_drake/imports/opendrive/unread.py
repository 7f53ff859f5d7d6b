"""Counts parts of an OpenDRIVE file that matter but are not read."""

import contextlib
from pathlib import Path

from cns_drake.base.xml_elements import Element
from cns_drake.base.yaml_files import parse_yaml
from cns_drake.imports.faults import ImportFaults

_KNOWN = parse_yaml(Path(__file__).with_name("unread.yaml").read_bytes())


def count_unread(element: Element, faults: ImportFaults, name: str) -> None:
    """Counts parts of an element that affect the roads but are not read.

    `name` is the name of the road or junction that contains the element.
    """
    known = _KNOWN["elements"].get(element.tag)
    for key, usual in _KNOWN["attributes"].get(element.tag, {}).items():
        value = element.attrib.get(key)
        with contextlib.suppress(TypeError, ValueError):
            value = f"{float(value or ''):g}"
        if value is not None and value not in usual:
            faults.add(f"{key} of {element.tag}, not read", name)
    for child in element.all("*"):
        own = name
        if child.tag in ("road", "junction"):
            own = child.attrib.get("id", "")
        if not child.attrib and not len(child):
            continue
        if known is not None and child.tag not in known:
            faults.add(f"{child.tag} of {element.tag}, not read", own)
        elif child.tag != "userData":
            count_unread(child, faults, own)
