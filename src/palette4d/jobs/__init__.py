"""Many tasks at a time, in processes on this machine or on a Dask farm."""
