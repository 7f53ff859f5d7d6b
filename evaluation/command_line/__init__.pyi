from evaluation.command_line.cli import app as app
from evaluation.command_line.cli import main as main
from evaluation.command_line.suggestions import name_tables as name_tables
from evaluation.command_line.suggestions import (
    suggest_comparison as suggest_comparison,
)
