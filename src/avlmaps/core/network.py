"""Which hosts are this machine; the servers and the clients of avlmaps ask the same question."""

from ipaddress import ip_address


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a host name or address; an IPv6 address may stand in brackets."""
    name = host.strip("[]")
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"
