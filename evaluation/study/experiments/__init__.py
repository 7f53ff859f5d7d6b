"""Experiments: fields of their files, factors, conditions; shipped files."""

from pathlib import Path

# The experiment `stages`, which is measured on recordings as well.
STAGES_FILE = Path(__file__).with_name("stages.yaml")
