"""Hosts and ports of options that open a socket."""

import pytest

from edge.address import parse_address
from edge.errors import InputError


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


@pytest.mark.parametrize("port", ["65536", "00000099999", "9" * 5000, "", "-1", "8 0"])
def test_a_port_that_does_not_exist_is_refused(port):
    with pytest.raises(InputError, match="give HOST:PORT, for example 47401"):
        parse_address("--joints udp:", f"localhost:{port}", "47401")
