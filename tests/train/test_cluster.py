"""A cluster is joblib's backend."""

import pytest

from edge.errors import InputError
from train.cluster import on_cluster


def test_an_address_without_a_scheduler_is_one_sentence(monkeypatch):
    import distributed

    def refused(address, timeout):
        raise OSError("Timed out trying to connect")

    monkeypatch.setattr(distributed, "Client", refused)
    refusal = pytest.raises(
        InputError, match="127.0.0.1:1: no Dask scheduler answers there"
    )
    with refusal, on_cluster("tcp://127.0.0.1:1"):
        pass
