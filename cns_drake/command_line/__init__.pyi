from .cli import app as app
from .cli import main as main
from .drive_script import run_drive as run_drive
from .drive_script import run_script as run_script
