"""Labels of two maps by rays: walls, screens, leaves, glass, another caster."""

import json
import shutil

from helpers.internal import eval_program
from helpers.internal.eval_program import run_program
import numpy as np
import pytest
import yaml

from cns_drake.__main__ import main
from cns_drake.ground_truth import write_truth
from evaluation.base import InputError
from evaluation.map_update import Label, read_pair


@pytest.mark.slow
def test_recordings_are_labelled_and_scored(short_recording, tmp_path, capsys):
    output = tmp_path / "pair"
    command = ("truth", *2 * [short_recording])
    status, out, err = run_program(
        capsys, "cns-drake", main, *command, "--output", output
    )
    assert (status, out) == (0, f"{output}\n"), err
    names = {path.name for path in (output / "A").iterdir()}
    assert names == {
        "Scans",
        "map.ply",
        "poses.txt",
        "singlesession_posegraph.g2o",
        "truth.npy",
    }
    assert "new" in (output / "index.html").read_text()
    labels = [f"--labels-{s}={output / s.upper() / 'truth.npy'}" for s in "ab"]
    status, out, err = eval_program.run(
        capsys, "map-update", output, *labels, "--json"
    )
    assert status == 0, err
    found = json.loads(out)
    assert found["miou"] == found["iou_kept"] == 1.0
    assert found["iou_gone"] is None
    session = read_pair(output).A
    assert (session.instances > 0).all()
    assert (np.load(output / "A" / "truth.npy") == Label.KEPT).all()
    status, _, err = run_program(
        capsys, "cns-drake", main, *command, "--output", output
    )
    assert status == 2
    assert "exists already" in err


def test_files_beside_a_recording_may_be_those_of_another(
    short_recording, tmp_path
):
    folder = tmp_path / "town" / short_recording.name
    shutil.copytree(short_recording, folder)
    file = folder / "scenario.yaml"
    values = yaml.safe_load(file.read_text())
    # The folder has moved, not the map.
    values["map"] = str((short_recording / values["map"]).resolve())
    file.write_text(yaml.safe_dump(values))
    write_truth(folder, folder, tmp_path / "truth")
    (lidar,) = values["lidars"]
    for change, field in (
        ({"seed": 77}, "seed"),
        ({"lidars": {lidar: {"preset": "vlp-16"}}}, "lidars"),
        ({"without": ["tower_000"]}, "without"),
    ):
        file.write_text(yaml.safe_dump(values | change))
        with pytest.raises(InputError, match=f"{field}: .* of another drive"):
            write_truth(folder, folder, tmp_path / "other")
