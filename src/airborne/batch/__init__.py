"""Many trials, one command: what is run, each trial as a task on Dask's scheduler, one table and one page of all."""
