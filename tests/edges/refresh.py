"""Writes the pins of edges anew, and prints what changed.

python tests/edges/refresh.py [NAME...]
"""

from pathlib import Path
import sys
import tempfile

sys.path.insert(0, str(Path(__file__).parents[1]))

from edges.measured import BY_NIGHT, EDGES, PINS, differences


def main() -> None:
    edges = {**EDGES, **BY_NIGHT}
    names = sys.argv[1:] or list(edges)
    for name in names:
        if name not in edges:
            sys.exit(f"{name}: no edge; there are {', '.join(edges)}")
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            found = edges[name](Path(folder))
        for file, text in found.items():
            pin = PINS / file
            if not pin.exists():
                print(f"{file}: new")
            for line in differences(
                file, pin.read_text() if pin.exists() else text, text
            ):
                print(f"{file}: {line}")
            pin.write_text(text)


if __name__ == "__main__":
    main()
