"""Addresses of options that open a socket."""

from edge.errors import InputError


def parse_address(
    option: str,
    text: str,
    example: str,
    host: str = "",
) -> tuple[str, int]:
    """Host and port of `HOST:PORT`, or of `PORT` alone where there is a default host.

    Raises:
        InputError: the text is not of that form; the message names the option and an
            example.
    """
    host_text, _, port = text.rpartition(":")
    host = host_text.strip("[]") or host
    is_port = port.isascii() and port.isdecimal() and len(port) <= 5
    if not (host and is_port and int(port) < 65536):
        raise InputError(f"{option}{text}: give HOST:PORT, for example {example}")
    return host, int(port)
