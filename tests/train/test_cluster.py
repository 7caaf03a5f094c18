"""A cluster is joblib's backend."""

import pytest
from joblib.parallel import get_active_backend

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


def test_within_the_block_joblibs_backend_is_the_cluster():
    distributed = pytest.importorskip("distributed")
    where = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": None}
    with (
        distributed.LocalCluster(1, processes=False, **where) as cluster,
        on_cluster(cluster.scheduler_address),
    ):
        backend, _ = get_active_backend()
        assert type(backend).__name__ == "DaskDistributedBackend"
        assert backend.client.scheduler.address == cluster.scheduler_address
