"""Mutations of files: of their bytes, and of the elements of their formats."""

import json
from pathlib import Path
import re

import numpy as np
import yaml

_WORDS = (
    "", " ", "~", "nan", "NaN", ".nan", "inf", "-inf", "-.inf", "true", "-",
    "0", "-0", "-1", "1", "2", "0x10", "1e3", "1e-300", "1e308", "-1e308",
    "1e400", "9" * 30, "9" * 5000, "2147483648", "18446744073709551616",
    "4294967295", "-9223372036854775808", "1_000", "1,5", "0.1.2", "0e0",
    "../../../../../evil", "/etc/passwd", "/", ".", "a\0b", "a\nb", "\r",
    "\u00fc\u2603\u202e", "\ufeff", "\u0662", "x" * 3000, "%s%n", "{}",
    '"', "'", "[", "]", "{", ":", "#", "&a", "*a", "<", "&lt;", "]]>", ",",
)  # fmt: skip
_VALUES = (
    None, True, 0, -1, 1, 3, 10**18, 10**400, -(2**63), 0.0, -0.0, 1e-300,
    1e-9, 0.5, 1e6, 1e15, 1e308, -1e308, float("nan"), float("inf"),
    [], {}, [[]], [None], [0, 0], ["a"], {"a": 1}, {1: 2}, b"\xff\0",
    *_WORDS, [1.0] * 2000, {str(k): k for k in range(500)},
)  # fmt: skip
# Sizes and offsets that a binary file may contain.
_NUMBERS = (b"\xff" * 8, bytes(8), b"\x7f" * 8, b"\xff" * 4 + bytes(4))
_FACTORS = (-1.0, 0.0, 1e-9, 1e-3, 0.5, 1.001, 2, 3.0, 1e3, 1e6, 1e9, 1e300)
# Short files of YAML that cost a reader much.
_DOCUMENTS = (
    "",
    "---\n---\n",
    "- 1\n- 2\n",
    "just words",
    "[" * 900,
    "[" * 90 + "]" * 90,
    "[" * 5000 + "]" * 5000,
    "{a: " * 400 + "1" + "}" * 400,
    "- " * 3000,
    "a: &a [*a]\n",
    "a: &a {b: *a}\n",
    "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    + "".join(
        f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(9)
    ),
    "? [a, b]\n: 1\n",
    "? {a: b}\n: 1\n",
    "!!python/object/apply:os.system ['true']\n",
    "a: !!int x\n",
    "a: !!timestamp x\n",
    "a: 2001-99-99\n",
    "a: !!binary '*'\n",
    "<<: 3\n",
    "a: *b\n",
    "%YAML 9.9\n---\na: 1\n",
    "\ta: 1\n",
    "a: 'unended\n",
)
# Short files of OpenStreetMap that cost a reader much.
_OSM_DOCUMENTS = (
    "",
    "<osm/>",
    "<osm version='0.6'>",
    "<gpx version='1.1'/>",
    "<osm version='0.6'>" + "<node>" * 5000,
    "<osm version='0.6'><bounds minlat='x'/></osm>",
    "<osmChange version='0.6'><delete><node id='1' version='1'/></delete>"
    "<create><node id='2' version='1' lat='1' lon='1'/></create></osmChange>",
    "<!DOCTYPE osm [<!ENTITY a 'aaaaaaaaaa'>"
    + "".join(
        f"<!ENTITY {b} '{f'&{a};' * 10}'>"
        for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    + "]><osm version='0.6'><node id='1' lat='1' lon='1'>"
    "<tag k='building' v='&i;'/></node></osm>",
    "<!DOCTYPE osm [<!ENTITY e SYSTEM 'file:///etc/passwd'>]>"
    "<osm version='0.6'><note>&e;</note></osm>",
    "<osm version='0.6'><relation id='1' version='1'>"
    "<member type='relation' ref='1' role='outer'/>"
    "<tag k='type' v='multipolygon'/><tag k='building' v='yes'/>"
    "</relation></osm>",
    "<osm version='0.6'><way id='1' version='1'>"
    + "<nd ref='7'/>" * 3000
    + "<tag k='building' v='yes'/></way></osm>",
)


def mutate(path: Path, data: bytes, rng: np.random.Generator) -> bytes:
    """Returns a file's content mutated in a way that suits its kind."""
    structured = _MUTATORS.get(path.suffix)
    if structured is None or rng.random() < 0.3:
        return mutate_bytes(data, rng, count=_pick(rng, (1, 1, 1, 2, 5)))
    return structured(data, rng)


def mutate_bytes(data: bytes, rng, count: int = 1) -> bytes:
    """Flips, overwrites, cuts, inserts and repeats bytes."""
    data = bytearray(data)
    for _ in range(count):
        at = int(rng.integers(len(data) + 1))
        length = int(_pick(rng, (1, 2, 4, 8, 40, 400)))
        some = int(rng.integers(len(data) + 1))
        kind = rng.integers(8)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            data[at : at + length] = rng.bytes(length)
        elif kind == 2:
            del data[at : at + length]
        elif kind == 3:
            data[at:at] = rng.bytes(length)
        elif kind == 4:
            del data[at:]
        elif kind == 5:
            data[at : at + 8] = _pick(rng, _NUMBERS)
        elif kind == 6:
            data[at:at] = data[some : some + length]
        else:
            data[at : at + 1] = _word(rng).encode()
    return bytes(data)


def _mutate_yaml(data: bytes, rng) -> bytes:
    if rng.random() < 0.1:
        return _pick(rng, _DOCUMENTS).encode()
    if rng.random() < 0.15:
        return _mutate_lines(data, rng)
    tree = _mutate_tree(yaml.load(data, yaml.CSafeLoader), rng)
    text = yaml.dump(tree, Dumper=yaml.CSafeDumper, sort_keys=False)
    return text.encode("utf-8", "surrogatepass")


def _mutate_json(data: bytes, rng) -> bytes:
    if rng.random() < 0.1:
        return _pick(rng, ("", "[" * 5000, "{", "[]", "{}", "NaN")).encode()
    tree = _mutate_tree(json.loads(data), rng)
    return json.dumps(tree, default=repr).encode()


def _mutate_json_lines(data: bytes, rng) -> bytes:
    lines = data.split(b"\n")
    at = int(rng.integers(len(lines)))
    lines[at] = _mutate_json(lines[at], rng)
    return b"\n".join(lines)


def _mutate_tree(tree, rng):
    """Changes, drops, doubles or renames one node of a tree, or two."""
    for _ in range(int(_pick(rng, (1, 1, 2)))):
        places = list(_places(tree))
        if not places:
            return _pick(rng, _VALUES)
        holder, key = places[int(rng.integers(len(places)))]
        value = holder[key]
        kind = rng.integers(7)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(value, int | float):
            holder[key] = value * type(value)(_pick(rng, _FACTORS))
        elif kind == 2 and isinstance(holder, dict):
            holder[_word(rng)] = holder.pop(key)
        elif kind == 2:
            holder.insert(int(rng.integers(len(holder) + 1)), value)
        elif kind == 3:
            # A value that belongs elsewhere.
            other, place = places[int(rng.integers(len(places)))]
            holder[key] = json.loads(json.dumps(other[place], default=repr))
        elif kind == 4:
            holder[key] = _pick(rng, ([value], {"a": value}, str(value)))
        elif kind == 5 and isinstance(value, list):
            holder[key] = _tangled(value, rng)
        else:
            holder[key] = _pick(rng, _VALUES)
    return tree


def _tangled(corners, rng):
    """Returns corners of many laps, one after the other or to and from."""
    laps = (corners * int(_pick(rng, (2, 50, 2000))))[:20_000]
    if rng.random() < 0.5:
        laps = [laps[k] for k in rng.permutation(len(laps))]
    return laps


def _places(tree):
    """Yields holder and key of every node below the root."""
    items = []
    if isinstance(tree, dict):
        items = list(tree.items())
    elif isinstance(tree, list):
        items = list(enumerate(tree))
    for key, value in items:
        yield tree, key
        yield from _places(value)


def _mutate_table(data: bytes, rng) -> bytes:
    """Mutates cells and rows of a table in text."""
    text = data.decode("utf-8", "replace")
    separator = "," if "," in text else " "
    rows = [line.split(separator) for line in text.splitlines()] or [[""]]
    at = int(rng.integers(len(rows)))
    row = rows[at]
    column = int(rng.integers(len(row)))
    kind = rng.integers(9)
    if kind == 0:
        del rows[at]
    elif kind == 1:
        rows.insert(int(rng.integers(len(rows) + 1)), list(row))
    elif kind == 2:
        del row[column]
    elif kind == 3:
        row.insert(column, row[column])
    elif kind == 4:
        del rows[0]
    elif kind == 5:
        row[column] = _pick(rng, ('"' + "a" * 200_000, "7" * 200_000, '"'))
    elif kind == 6:
        separator = _pick(rng, (";", "\t", " , ", "\n", "\0"))
    else:
        row[column] = _word(rng)
    return "\n".join(map(separator.join, rows)).encode("utf-8", "replace")


def _mutate_tokens(data: bytes, rng, first: int = 4000) -> bytes:
    """Replaces words of a text, or of the text at a file's start."""
    if rng.random() < 0.2:
        return _mutate_lines(data, rng)
    # This is the header of a point cloud, and all of most models.
    head, tail = data[:first], data[first:]
    tokens = list(re.finditer(rb"[^\s<>\"=/]+", head))
    for _ in range(int(_pick(rng, (1, 1, 2)))):
        token = tokens[int(rng.integers(len(tokens)))]
        if rng.random() < 0.3:
            new = tokens[int(rng.integers(len(tokens)))][0]
        else:
            new = _word(rng).encode()
        head = head[: token.start()] + new + head[token.end() :]
    return head + tail


def mutate_osm(path: Path, data: bytes, rng: np.random.Generator) -> bytes:
    """Mutates OpenStreetMap's XML: words, bytes, ways, or references."""
    kind = rng.integers(7)
    if kind < 2:
        return _mutate_tokens(data, rng, first=1 << 20)
    if kind == 2:
        return mutate_bytes(data, rng, count=_pick(rng, (1, 2, 5)))
    text = data.decode()
    if kind == 3:
        return _pick(rng, _OSM_DOCUMENTS).encode()
    if kind == 4:
        nodes = "<nd [^>]*>"
        way = _pick(rng, list(re.finditer(rf"(?:{nodes}\s*)+", text)))
        laps = "".join(_tangled(re.findall(nodes, way[0]), rng))
        return (text[: way.start()] + laps + text[way.end() :]).encode()
    name, words = _pick(
        rng,
        (
            ("lat", ("nan", "91", "1e300", "-90", "90", "", "1e-9", "x")),
            ("lon", ("inf", "181", "-1e300", "-180", "180", "0", "13.00001")),
            ("ref", ("1", "2", "47", "-5", "9" * 25, "", "x")),
            ("id", ("1", "2", "0", "-5", "9" * 25, "x")),
            ("role", ("outer", "inner", "outline", "part", "x" * 3000)),
            ("v", ("1e999", "-3", "0", "nan", "9" * 400, "yes;no", "no")),
            ("k", ("building", "area", "highway", "type", "building:part")),
            ("type", ("way", "node", "relation", "x")),
        ),
    )
    places = list(re.finditer(rf' {name}="([^"]*)"', text))
    for _ in range(int(_pick(rng, (1, 3, 30)))):
        place = places[int(rng.integers(len(places)))]
        old = place[0]
        text = text.replace(old, f' {name}="{_pick(rng, words)}"', 1)
    return text.encode()


def _mutate_lines(data: bytes, rng) -> bytes:
    lines = data.split(b"\n")
    at, to = (int(k) for k in rng.integers(len(lines), size=2))
    kind = rng.integers(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(to, lines[at])
    elif kind == 2:
        lines[at], lines[to] = lines[to], lines[at]
    else:
        lines[at:at] = [lines[at]] * 50
    return b"\n".join(lines)


_MUTATORS = {
    ".yaml": _mutate_yaml,
    ".json": _mutate_json,
    ".jsonl": _mutate_json_lines,
    ".csv": _mutate_table,
    ".txt": _mutate_table,
    **dict.fromkeys((".sdf", ".obj", ".pcd", ".ply", ".npy"), _mutate_tokens),
}


def _pick(rng, choices):
    return choices[int(rng.integers(len(choices)))]


def _word(rng) -> str:
    return _pick(rng, _WORDS)
