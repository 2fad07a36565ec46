"""What a conformance suite raises; encoders and formats of other packages are held to their promises by one."""


class NonConformanceError(AssertionError):
    """Something brought by a package breaks a promise; the sentence says which."""


def hold(condition: object, promise: str) -> None:
    """Raise ``NonConformanceError`` with a promise that does not hold."""
    if not condition:
        raise NonConformanceError(promise)
