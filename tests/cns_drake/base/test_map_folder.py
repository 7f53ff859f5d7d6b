"""The files in the folder of a map."""

from cns_drake.base.map_folder import MapFolder, sequence_name


def test_existing_files(tmp_path):
    folder = MapFolder(tmp_path / "town")
    folder.path.mkdir()
    assert folder.name == "town"
    assert (folder.stages(), folder.sequences()) == ({}, [])
    for name in ("10", "02", "new"):
        folder.stage(name).touch()
    for number in ("10", "03"):
        folder.sequence(number).touch()
    (folder.path / "stage_01.yaml").touch()
    (folder.path / "other_02.yaml").touch()
    stages = folder.stages()
    assert list(stages) == ["02", "10", "new"]
    assert stages["10"] == folder.path / "stage_10.sdf"
    assert folder.sequences() == [folder.sequence("03"), folder.sequence("10")]
    assert folder.recordable_sequences() == [folder.sequence("10")]


def test_names_of_sequences(tmp_path):
    folder = MapFolder(tmp_path / "town")
    assert sequence_name(folder.sequence("04")) == "town_04"
    assert sequence_name(folder.path / "my_drive.yaml") == "my_drive"
