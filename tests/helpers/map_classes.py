"""Takes structures out of a map."""

import csv
from xml.etree import ElementTree


def take_away(town, classes):
    """Takes the structures of some classes out of all stages of a map."""
    rows = list(csv.DictReader((town / "structures.csv").open()))
    gone = {row["name"] for row in rows if row["class"] in classes}
    for path in town.glob("stage_*.sdf"):
        tree = ElementTree.parse(path)
        for parent in tree.iter():
            for visual in parent.findall("visual"):
                if visual.get("name").split("/")[0] in gone:
                    parent.remove(visual)
        tree.write(path)
    kept = [row for row in rows if row["name"] not in gone]
    with (town / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0].keys())
        table.writeheader()
        table.writerows(kept)
