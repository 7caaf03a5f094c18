"""A Dask cluster as joblib's backend, so that the same work runs there as on local
cores."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from typing import Any

from edge.errors import InputError


@contextmanager
def on_cluster(address: str | None) -> Iterator[None]:
    """Within the block, `joblib.Parallel` runs on the cluster whose scheduler is at
    `address`.

    Args:
        address: like `tcp://127.0.0.1:8786`.

    Raises:
        InputError: Dask is not installed, or no scheduler answers there.
    """
    import joblib

    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise InputError("a cluster needs Dask: pip install --group cluster") from None
    try:
        client = distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(
            f"--address {address}: no Dask scheduler answers there: {error}"
        ) from None
    with closing(client), joblib.parallel_config("dask"):
        yield
