"""The options --jobs and --cluster of verbs with many shots or frames."""

import argparse

from palette4d.common.arguments import checked, whole
from palette4d.jobs.dask_farm import check_address


def add_worker_options(
    parser: argparse.ArgumentParser | argparse._ArgumentGroup, what: str
) -> None:
    """Add --jobs and --cluster to a verb that works on many of `what`."""
    parser.add_argument(
        "--jobs",
        metavar="N",
        type=whole(0, 1024),
        default=0,
        help=f"{what} worked on at a time; 0: one per processor (default)",
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        type=checked(str, check_address),
        help=f"work on the {what} on a Dask farm instead: its scheduler's address "
        "(tls://farm:8786)",
    )
