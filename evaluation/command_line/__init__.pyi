from .cli import app as app
from .cli import main as main
from .suggestions import show_results as show_results
