"""Workers of a Dask cluster, whose client gives an executor; the extra ``cluster``."""

from __future__ import annotations

import importlib
import logging
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from tcrctl.errors import DeviceError, InputError
from tcrctl.executors.workers import Workers

#: Pieces of work per worker thread that the scheduler holds at a time: one is done, one waits beside it.
AHEAD: Final = 2
#: Time in which a scheduler has to answer [s].
PATIENCE_S: Final = 10
#: Variables that numbers or their speed depend on.
_VARIABLES: Final = ("NUMBA_OPT", "OPENBLAS_NUM_THREADS")


@contextmanager
def cluster_workers(
    address: str | None, jobs: int, warm: Callable[[], object] | None = None
) -> Iterator[Workers]:
    """Connect to a scheduler, or start one with workers on this computer.

    Args:
        address: Of the scheduler, ``tcp://host:8786``; None starts one here.
        jobs: Worker processes, if they are started here.
        warm: Is called once per computer.

    Raises:
        InputError: If Dask is not installed.
        DeviceError: If the scheduler does not answer or has no workers.
    """
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "--dask needs the package distributed, which is not installed",
            hint="pip install 'tcrctl[cluster]'",
        ) from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what ends badly is an error here, not a log
    if address is None:
        cluster = distributed.LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        )
        with cluster, distributed.Client(cluster) as client:
            yield _workers(client, warm)
        return
    try:
        client = distributed.Client(address, timeout=PATIENCE_S)
    except (OSError, ValueError) as error:
        raise DeviceError(f"{address}: there is no Dask scheduler: {error}") from None
    with client:
        yield _workers(client, warm)


def environment() -> dict[str, str]:
    """Return what libraries of this process read from the environment, and those of workers should too."""
    return {name: os.environ[name] for name in _VARIABLES if name in os.environ}


def set_environment(values: Mapping[str, str]) -> None:
    """Set variables that are not set yet; for workers, before the numerical packages are loaded there.

    Args:
        values: By name.
    """
    for name, value in values.items():
        os.environ.setdefault(name, value)


def _workers(client: Any, warm: Callable[[], object] | None) -> Workers:
    client.register_worker_callbacks(setup=partial(set_environment, environment()))
    threads = client.nthreads()
    if not threads:
        raise DeviceError("the Dask scheduler has no workers", hint="Start some: dask worker ADDRESS")
    if warm is not None:
        by_host = {address.rpartition(":")[0]: address for address in threads}
        client.run(warm, workers=list(by_host.values()), on_error="ignore")
    return Workers(client.get_executor(pure=False), AHEAD * sum(threads.values()))
