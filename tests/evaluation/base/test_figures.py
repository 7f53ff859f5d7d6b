"""Figures with letters that no font has."""

from matplotlib.figure import Figure
import pytest

from evaluation.base import figure_style, save_figure


@pytest.mark.filterwarnings("error")
def test_missing_letters_are_at_most_one_note(tmp_path, capsys):
    # Linear A, which no font on a usual machine has.
    for number in range(2):
        with figure_style():
            figure = Figure()
            figure.text(0.5, 0.5, "\U00010600\U00010601")
            save_figure(figure, tmp_path / f"{number}.png", 50)
    assert (tmp_path / "1.png").is_file()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) <= 1
    assert all("install Noto" in line for line in lines)
