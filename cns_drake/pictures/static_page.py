"""Writes a Meshcat scene as one small HTML file."""

import base64
from html import escape
from pathlib import Path
import re
import zlib

import numpy as np
from pydrake.geometry import Meshcat

from cns_drake.base import write_text

# Level of compression. Higher levels take many times as long for a few percent.
_LEVEL = 4
# Bytes per row: the size of a vertex or of a triangle. Rows differ little from
# the row before, and the differences compress well.
_ROW = 12

# The form in which Meshcat.StaticHtml() embeds each of its commands.
_COMMAND = re.compile(
    r'fetch\("data:application/octet-binary;base64,([A-Za-z0-9+/=]*)"\)\s*'
    r"\.then\(res => res\.arrayBuffer\(\)\)\s*"
    r"\.then\(buffer => viewer\.handle_command_bytearray\("
    r"new Uint8Array\(buffer\)\)\);"
)

# Commands run one after the other. Drake's page runs all at once, so that a
# command could overtake a larger one that it needs.
_QUEUE = """
    // Undoes what `filter_rows` did in Python.
    function unfilterRows(planes, length) {
      const bytes = new Uint8Array(planes.length);
      for (let column = 0, at = 0; column < ROW; ++column) {
        let value = 0;
        for (let k = column; k < bytes.length; k += ROW) {
          value = (value + planes[at++]) & 255;
          bytes[k] = value;
        }
      }
      return bytes.subarray(0, length);
    }
    let commands = Promise.resolve();
    function enqueue(data, filteredLength) {
      commands = commands
          .then(() => fetch("data:application/octet-binary;base64," + data))
          .then(res => new Response(res.body.pipeThrough(
              new DecompressionStream("deflate"))).arrayBuffer())
          .then(buffer => new Uint8Array(buffer))
          .then(bytes => viewer.handle_command_bytearray(
              filteredLength ? unfilterRows(bytes, filteredLength) : bytes));
    }
""".replace("ROW", str(_ROW))


def make_static_page(
    meshcat: Meshcat, title: str, *, body: str = "", script: str = ""
) -> str:
    """Returns a Meshcat scene as a web page that needs no server.

    The page is Drake's page with compressed commands, so that a city takes a
    third of the space. Browsers have been able to decompress such commands
    since 2023.

    Args:
        meshcat: the server with the scene.
        title: title of the page, plain text.
        body: HTML that precedes the scene and is visible while the scene loads.
        script: JavaScript module that runs when the page is ready. In this
            module, `commands` is a JavaScript promise of the scene's commands.
    """
    html = meshcat.StaticHtml()
    first = _COMMAND.search(html)
    if first is None:
        raise RuntimeError(
            "this version of Drake writes Meshcat pages in another form; use "
            "the version in pyproject.toml"
        )
    head = html[: first.start()]
    rest = _COMMAND.sub(_compressed, html[first.start() :])
    viewport = '<meta name="viewport" content="width=device-width">'
    head = _replace(
        head,
        "<title>Drake MeshCat</title>",
        f"<title>{escape(title)}</title>\n  {viewport}",
    )
    head = _replace(head, "<body>", f"<body>\n{body}")
    module = f'<script type="module">{script}</script>'
    rest = _replace(rest, "</body>", f"{module}\n</body>")
    return head + _QUEUE + rest


def save_meshcat_page(
    meshcat: Meshcat, path: Path | str, title: str = "Meshcat"
) -> None:
    """Saves a Meshcat scene as a web page that opens without a server.

    Args:
        meshcat: the server with the scene.
        path: HTML file to write.
        title: title of the page, plain text.

    Raises:
        InputError: the page cannot be written.

    Example:
        from cns_drake import save_meshcat_page

        save_meshcat_page(meshcat, "scene.html")
    """
    write_text(Path(path), make_static_page(meshcat, title))


def filter_rows(data: bytes) -> bytes:
    """Returns bytes rearranged so that they compress well.

    The bytes are taken as rows of equal length; the last row is padded with
    zeros. Each byte is replaced by its difference from the byte above. The
    result contains the first bytes of all rows, then the second bytes, and so
    on.
    """
    padded = np.frombuffer(data + bytes(-len(data) % _ROW), np.uint8)
    rows = padded.reshape(-1, _ROW)
    difference = np.diff(rows, axis=0, prepend=np.zeros((1, _ROW), np.uint8))
    return difference.T.tobytes()


def _compressed(command: re.Match) -> str:
    raw = base64.b64decode(command[1])
    plain, filtered = (
        base64.b64encode(zlib.compress(data, _LEVEL)).decode()
        for data in (raw, filter_rows(raw))
    )
    if len(filtered) < len(plain):
        return f'    enqueue("{filtered}", {len(raw)});'
    return f'    enqueue("{plain}");'


def _replace(html: str, old: str, new: str) -> str:
    if html.count(old) != 1:
        raise RuntimeError(f"Drake's Meshcat page must have exactly one {old}")
    return html.replace(old, new)
