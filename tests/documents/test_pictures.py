"""Every picture is made by a command, from the data of today."""

from pathlib import Path

from helpers import documents
import pytest
import yaml

from docs import draw

pytestmark = pytest.mark.slow

REGISTRY = yaml.safe_load(draw.REGISTRY.read_text())


def test_every_picture_is_registered_and_shown():
    drawn = {path.name for path in draw.PICTURES.iterdir()}
    assert drawn == REGISTRY.keys()
    shown = "\n".join(page.text for page in documents.pages())
    for name in drawn:
        assert f"pictures/{name})" in shown, name


@pytest.mark.parametrize("name", REGISTRY)
def test_a_picture_has_a_command(name):
    entry = REGISTRY[name]
    assert "command" in entry or "draw" in entry
    if "draw" in entry:
        assert callable(draw.function_of(entry["draw"]))


def test_no_picture_is_older_than_its_data():
    assert draw.stale() == []


def test_a_picture_is_stale_after_a_change_of_its_data(tmp_path, monkeypatch):
    city = tmp_path / "worlds/town"
    (city / "meshes").mkdir(parents=True)
    for name in ("stage_01.sdf", "sequence_01.yaml", "meshes/a.obj"):
        (city / name).write_text("1")
    (tmp_path / "page.md").write_text("text\n| a | 1 |\n")
    monkeypatch.setattr(draw, "ROOT", tmp_path)
    monkeypatch.setattr(draw, "REGISTRY", tmp_path / "pictures.yaml")
    entry = {"data": ["town", "./page.md"]}
    entry["digest"] = draw.digest(entry["data"])
    draw.REGISTRY.write_text(yaml.safe_dump({"a.png": entry}))
    assert draw.stale() == []
    # Sentences of a page, and other files of a city, are no data.
    (tmp_path / "page.md").write_text("other text\n| a | 1 |\n")
    (city / "city.yaml").write_text("1")
    assert draw.stale() == []
    for path, text in (
        (city / "meshes/a.obj", "2"),
        (tmp_path / "page.md", "text\n| a | 2 |\n"),
    ):
        before = path.read_text()
        path.write_text(text)
        assert draw.stale() == [
            "a.png is older than town, ./page.md: "
            "run .venv/bin/python docs/draw.py a.png"
        ]
        path.write_text(before)
    with pytest.raises(FileNotFoundError, match=r"nothing\.csv"):
        draw.digest(["./nothing.csv"])


def test_a_drawn_picture_is_noted(tmp_path, monkeypatch):
    monkeypatch.setattr(draw, "REGISTRY", tmp_path / "pictures.yaml")
    monkeypatch.setattr(draw, "PICTURES", tmp_path)
    monkeypatch.setattr(draw, "ROOT", tmp_path)
    (tmp_path / "n.csv").write_text("1")
    draw.REGISTRY.write_text(
        "# Kept.\na.png:\n  command: cp n.csv a.png\n  data: [./n.csv]\n"
        "  digest: none\nb.png:\n  command: 'false'\n  data: [./n.csv]\n"
        "  digest: none\n"
    )
    draw.main(["a.png"])
    assert Path(tmp_path / "a.png").read_text() == "1"
    assert draw.REGISTRY.read_text().startswith("# Kept.\na.png:\n")
    (line,) = draw.stale()
    assert line.startswith("b.png is older")
