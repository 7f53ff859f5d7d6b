"""Draws the pictures of these pages.

python docs/draw.py            lists those that are older than their data
python docs/draw.py NAME ...   draws these, and notes what they show

For each picture, `docs/pictures.yaml` has a function of `chart_pictures` or
`scene_pictures`, or a command; and the files that the picture shows, those
of a page's code, too. Commands
run in the root of the repository; what they made before is taken as it is.
"""

from collections.abc import Callable, Sequence
import hashlib
from pathlib import Path
import re
import subprocess
import sys

import yaml

ROOT = Path(__file__).resolve().parents[1]
# As a program, this file is not in the package `docs`.
sys.path.insert(0, str(ROOT))

from docs import chart_pictures, scene_pictures  # noqa: E402
from docs.picture_parts import STYLE  # noqa: E402
from evaluation.base import figure_style  # noqa: E402

PICTURES = ROOT / "docs/pictures"
REGISTRY = ROOT / "docs/pictures.yaml"
# What a picture of a shipped city shows.
_CITY = ("stage_*.sdf", "meshes/*", "sequence_*.yaml")


def digest(data: Sequence[str]) -> str:
    """Returns the digest of data: names of cities, or patterns of files.

    Of a page, only its tables count.
    """
    whole = hashlib.sha256()
    for name in data:
        patterns = [f"worlds/{name}/{part}" for part in _CITY]
        for pattern in [name] if "/" in name else patterns:
            paths = sorted(ROOT.glob(pattern))
            if not paths:
                raise FileNotFoundError(pattern)
            for path in paths:
                content = path.read_bytes()
                if path.suffix == ".md":
                    content = b"".join(re.findall(rb"(?m)^\|.*", content))
                head = f"{path.relative_to(ROOT)} {len(content)}\n"
                whole.update(head.encode() + content)
    return whole.hexdigest()[:12]


def stale() -> list[str]:
    """Returns a line for each picture that is older than its data."""
    return [
        f"{name} is older than {', '.join(entry['data'])}: "
        f"run .venv/bin/python docs/draw.py {name}"
        for name, entry in yaml.safe_load(REGISTRY.read_text()).items()
        if entry["digest"] != digest(entry["data"])
    ]


def function_of(name: str) -> Callable[..., None]:
    """Returns the function that draws a picture."""
    return {**vars(chart_pictures), **vars(scene_pictures)}[name]


def main(names: Sequence[str]) -> None:
    """Draws pictures, or lists the stale ones."""
    if not names:
        print("\n".join(stale()) or "all pictures show their data")
    for name in names:
        entry = yaml.safe_load(REGISTRY.read_text())[name]
        data, made = entry.pop("data"), entry.pop("digest")
        command, draw = entry.pop("command", None), entry.pop("draw", None)
        if command and not (ROOT / entry.get("file", " ")).exists():
            subprocess.run(command, shell=True, check=True, cwd=ROOT)
        if draw:
            with figure_style(STYLE):
                function_of(draw)(PICTURES / name, **entry)
        head, mark, rest = REGISTRY.read_text().partition(f"\n{name}:")
        rest = rest.replace(f"digest: {made}", f"digest: {digest(data)}", 1)
        REGISTRY.write_text(head + mark + rest)


if __name__ == "__main__":
    main(sys.argv[1:])
