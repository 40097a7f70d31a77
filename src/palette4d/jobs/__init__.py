"""Many pieces of work at a time: processes on this machine, or a Dask farm."""
