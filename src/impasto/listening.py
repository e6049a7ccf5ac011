"""Listen at an address of this machine, for the pages that the program serves."""

from __future__ import annotations

import socket

from impasto.errors import OptionError, Problem


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Parameters
    ----------
    host : str
        ``0.0.0.0`` for all addresses of this machine.
    port : int
        0 for any that is free.

    Raises
    ------
    OptionError
        If the address is taken or is not one of this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(128)
    except OSError as error:
        listening.close()
        do = "Choose another --port, 0 for any that is free, or the --host of this machine"
        raise OptionError(
            Problem(f"{host}:{port}", f"cannot be listened at: {error.strerror}", do)
        ) from error
    return listening


def shown_host(host: str) -> str:
    """Return the name under which others reach an address that was listened at."""
    if host in ("0.0.0.0", "::"):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
