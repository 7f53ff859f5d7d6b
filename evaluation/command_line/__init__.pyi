from .cli import app as app
from .cli import main as main
from .options import Align as Align
from .suggestions import show_results as show_results
