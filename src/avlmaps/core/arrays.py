"""Array types with shapes, as jaxtyping declares them: ``Float32[np.ndarray, "n 3"]``.

Tests alone check shapes: they load jaxtyping first and get its own types here. Elsewhere its import would take as long
as NumPy's, so stand-ins hold the declaration for ``maps.store``. Modules that a query of one word needs import the
types from here.
"""

import sys
from typing import TYPE_CHECKING, Any

__all__ = (
    "Bool", "Complex64", "Float", "Float16", "Float32", "Float64",
    "Int", "Int8", "Int32", "Int64", "UInt8", "UInt16",
)  # fmt: skip

if TYPE_CHECKING or "jaxtyping" in sys.modules:
    from jaxtyping import Bool, Complex64, Float, Float16, Float32, Float64, Int, Int8, Int32, Int64, UInt8, UInt16
else:

    class Declared:
        """An array type: the names of the types of number that fit, and its shape, a letter or a number an axis."""

        __slots__ = ("dim_str", "dtypes")

        def __init__(self, dtypes: tuple[str, ...], dim_str: str) -> None:
            self.dtypes = dtypes
            self.dim_str = dim_str.strip()

        def __repr__(self) -> str:
            return f"{'|'.join(self.dtypes)}[{self.dim_str}]"

        def __call__(self) -> None:
            """Make nothing: ``typing`` accepts as a type what can be called."""
            raise TypeError("an array type declares; make arrays with NumPy")

        def __or__(self, other: object) -> object:
            return Any

        __ror__ = __or__

    class _Numbers:
        __slots__ = ("dtypes",)

        def __init__(self, *dtypes: str) -> None:
            self.dtypes = dtypes

        def __getitem__(self, declared: tuple[type, str]) -> Declared:
            return Declared(self.dtypes, declared[1])

    Bool, Complex64 = _Numbers("bool"), _Numbers("complex64")
    Float16, Float32, Float64 = _Numbers("float16"), _Numbers("float32"), _Numbers("float64")
    Int8, Int32, Int64 = _Numbers("int8"), _Numbers("int32"), _Numbers("int64")
    UInt8, UInt16 = _Numbers("uint8"), _Numbers("uint16")
    Float = _Numbers("float16", "float32", "float64")
    Int = _Numbers("int8", "int16", "int32", "int64")
