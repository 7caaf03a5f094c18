"""Addresses of options that open a socket."""

import socket

from edge.errors import InputError
from edge.files import refusing


def parse_address(
    option: str,
    text: str,
    example: str,
    host: str = "",
    ports: range = range(65536),
) -> tuple[str, int]:
    """Host and port of `HOST:PORT`, or of `PORT` alone where there is a default host.

    Raises:
        InputError: the text is not of that form; the message names the option and an
            example.
    """
    host_text, _, port = text.rpartition(":")
    host = host_text.strip("[]") or host
    is_port = port.isascii() and port.isdecimal() and len(port) <= 5
    if not (host and is_port and int(port) in ports):
        raise InputError(f"{option}{text}: give HOST:PORT, for example {example}")
    return host, int(port)


def sender_to(option: str, address: str) -> socket.socket:
    """A socket that sends datagrams to `HOST:PORT`, and never waits.

    Raises:
        InputError: the address is not of that form, or its host is unknown.
    """
    host, port = parse_address(
        option,
        address,
        "127.0.0.1:47400",
        ports=range(1, 65536),
    )
    with refusing(f"{option}{address}: cannot be reached"):
        family, kind, protocol, _, where = socket.getaddrinfo(
            host,
            port,
            type=socket.SOCK_DGRAM,
        )[0]
        sender = socket.socket(family, kind, protocol)
        sender.setblocking(False)
        sender.connect(where)
    return sender
