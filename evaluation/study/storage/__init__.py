"""The files that keep the results of jobs, with the inputs they are made of."""
