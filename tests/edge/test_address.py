"""Hosts and ports of options that open a socket."""

import pytest

from edge.address import parse_address


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("localhost:65535", ("localhost", 65535)),
        ("[::1]:1", ("::1", 1)),
        ("47401", ("127.0.0.1", 47401)),
    ],
)
def test_an_address_has_a_host_or_the_default_one_and_a_port(text, address):
    assert parse_address("--joints udp:", text, "47401", "127.0.0.1") == address
