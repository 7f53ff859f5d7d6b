from cns_drake.command_line.cli import app as app
from cns_drake.command_line.cli import main as main
from cns_drake.command_line.drive_script import run_drive as run_drive
from cns_drake.command_line.drive_script import run_script as run_script
