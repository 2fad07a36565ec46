"""Refusing to run in an address space that is too small: there, libraries end the process by abort()."""

import sys

# A question about a small map needs 0.9 GB of addresses (not of memory): libraries reserve more than they use.
LEAST_BYTES = 1_000_000_000


class AddressSpaceError(MemoryError):
    """The limit on this process's address space is too low; its sentence has the numbers."""


def require_address_space() -> None:
    """Raise ``AddressSpaceError`` where the system lets this process have less than ``LEAST_BYTES`` of addresses."""
    if sys.platform == "win32":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_BYTES:
        raise AddressSpaceError(
            f"this process may have {limit / 1e6:,.0f} MB of address space, which is too little memory: this needs "
            f"{LEAST_BYTES / 1e6:,.0f} MB or more; raise the limit (ulimit -v)"
        )
