from evaluation.command_line.cli import app as app
from evaluation.command_line.cli import main as main
from evaluation.command_line.suggestions import show_results as show_results
