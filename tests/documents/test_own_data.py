"""The program that converts scans of your own."""

from helpers import documents
import numpy as np
import pytest


def test_scans_are_in_the_order_of_their_numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = documents.read("docs/real.md")
    (program,) = (
        piece.text
        for piece in documents.fenced(page)
        if piece.text.startswith("from pathlib")
    )
    for stage in ("01", "02"):
        (tmp_path / f"scans_{stage}").mkdir()
        for k in range(12):
            np.save(f"scans_{stage}/{k}.npy", np.full((5, 4), float(k)))
        rows = [[k, k, 0, 0, 0, 0, 0, 1] for k in range(12)]
        np.savetxt(f"poses_{stage}.tum", rows)
    exec(program, {})
    for k in range(12):
        path = f"mine/sequences/02/velodyne/{k:06d}.bin"
        assert np.fromfile(path, "<f4").tolist() == [k] * 20
    (tmp_path / "scans_01/7.npy").unlink()
    with pytest.raises(SystemExit, match="11 scans, 12 poses of 01"):
        exec(program, {})
