"""Code that the simulator and the evaluation share: errors, files, jobs."""
