"""What the simulator and the evaluation share: errors, files, jobs, formats."""
