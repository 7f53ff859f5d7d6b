"""Other ways to write the same world, which must be read alike."""

from collections.abc import Callable
from pathlib import Path
import re
from xml.etree.ElementTree import Comment, Element, fromstring, tostring


def same_worlds(path: Path) -> dict[str, str]:
    """Returns texts that mean what an SDF or URDF file means, by change.

    Poses of the file must not refer to models.
    """
    text = path.read_text("utf-8")
    changes = dict(_SPELLINGS)
    tag = fromstring(text).tag
    if tag == "robot":
        changes["another name"] = lambda root: root.set("name", "other")
    changes |= _ADDITIONS.get(tag, _ADDITIONS["sdf"])
    body = re.sub(r"\A<\?xml.*?\?>\s*", "", text)
    found = {
        "a declaration": f"<?xml version='1.0' encoding='utf-8'?>\n{body}",
        "no declaration": body,
        "a byte order mark": f"\ufeff{text}",
        "other line ends": text.replace("\n", "\r\n"),
    }
    for name, change in changes.items():
        root = fromstring(text)
        change(root)
        found[name] = tostring(root, "unicode")
    return found


def _comment(root: Element) -> None:
    for element in list(root.iter()):
        if len(element):
            element.insert(0, Comment(" a <light/> -- that is none "))


def _reorder_attributes(root: Element) -> None:
    for element in root.iter():
        items = list(element.items())[::-1]
        element.attrib.clear()
        element.attrib.update(items)


def _reorder_children(root: Element) -> None:
    for element in list(root.iter()):
        element[:] = list(element)[::-1]


def _add_blanks(root: Element) -> None:
    for element in root.iter():
        if element.text and element.text.strip():
            element.text = f"\n\t {element.text.strip()} \n"


def _rename_models(root: Element) -> None:
    for element in root.iter():
        name = element.get("name", "")
        if element.tag in ("world", "model") and name[:2] not in ("", "__"):
            element.set("name", f"{name}_other")


def _adding(parents: tuple[str, ...], text: str) -> Callable[[Element], object]:
    def add(root: Element) -> None:
        for element in list(root.iter()):
            if element.tag in parents:
                element.append(fromstring(text))

    return add


_SPELLINGS: dict[str, Callable[[Element], object]] = {
    "comments": _comment,
    "attributes in another order": _reorder_attributes,
    "children in another order": _reorder_children,
    "blanks": _add_blanks,
}
_ADDITIONS: dict[str, dict[str, Callable[[Element], object]]] = {
    "sdf": {
        "other names": _rename_models,
        "a light": _adding(("world",), "<light name='zz' type='point'/>"),
        "a plugin": _adding(
            ("world", "model"), "<plugin name='zz' filename='zz.so'/>"
        ),
        "an included sun": _adding(
            ("world",), "<include><uri>model://sun</uri></include>"
        ),
        "a frame": _adding(("world", "model"), "<frame name='zz'/>"),
    },
    "robot": {
        "a plugin": _adding(
            ("robot",),
            "<gazebo><plugin name='zz' filename='zz.so'/></gazebo>",
        ),
        "a transmission": _adding(("robot",), "<transmission name='zz'/>"),
    },
}
