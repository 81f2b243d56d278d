"""The addresses under which the live page's server answers, and the one to open."""

from __future__ import annotations

import contextlib
import ipaddress
import socket

from unitcad.errors import WrongArgument

LOOPBACK = "127.0.0.1"
TOKEN = "UNITCAD_TOKEN"
"""Environment variable with the token; other users of a machine can read a command's arguments."""
_OWN = ("localhost", "127.0.0.1", "[::1]")
ANY_ADDRESS = "*"
"""Stands for every Host that is an address itself, not a name: no other site's name can be made to mean one."""
_ELSEWHERE = ("192.0.2.1", 9)
"""An address for documentation. Nothing is sent to it: a way there tells this machine's own address."""


def check_address(host: str, token: str | None) -> None:
    """Raise WrongArgument for an address beyond the loopback without a token, and for a token easily guessed."""
    try:
        loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = host == "localhost"
    if not loopback and not token:
        limit = f"is not this machine's loopback address; another one needs a token of yours, in the variable {TOKEN}"
        raise WrongArgument("host", host, limit, LOOPBACK)
    if token is not None and (len(token) < 16 or not token.isascii() or not token.isprintable() or " " in token):
        raise WrongArgument(TOKEN, "(not shown)", "needs at least 16 printable ASCII characters without spaces")


def hosts(host: str, port: int) -> frozenset[str]:
    """Return the values of Host under which a browser may ask for the server at an address."""
    if _is_any(host):
        names = {*_OWN, socket.gethostname().lower(), ANY_ADDRESS}
    else:
        own = f"[{host}]" if ":" in host else host
        names = {own, *_OWN} if host in ("localhost", LOOPBACK, "::1") else {own}
    return frozenset(f"{name}:{port}" for name in names)


def means(host: str, allowed: frozenset[str]) -> bool:
    """Tell whether a Host, in lower case, is among the allowed ones of `hosts`."""
    if host in allowed:
        return True
    name, _, port = host.rpartition(":")
    if f"{ANY_ADDRESS}:{port}" not in allowed:
        return False
    bare = name[1:-1] if name.startswith("[") and name.endswith("]") else name
    with contextlib.suppress(ValueError):
        return (ipaddress.ip_address(bare).version == 6) == (bare != name)
    return False


def shown_host(host: str) -> str:
    """Return the host of the address to open: of one that means all, this machine's own."""
    if not _is_any(host):
        return f"[{host}]" if ":" in host else host
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.connect(_ELSEWHERE)
        return str(one.getsockname()[0])
    return LOOPBACK


def _is_any(host: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_unspecified
    return False
