"""The options of every verb, and of every verb that runs models."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Optional

from tyro.conf import Positional, arg

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

# The parser checks the default of a `str | None` with a package that takes longer to load than a question to answer;
# it knows these itself.
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045


@dataclass(frozen=True, kw_only=True)
class Verb:
    """Options of every verb."""

    json: bool = False
    """Print one JSON object on standard output, and nothing else there."""

    compiles: ClassVar[bool] = False
    """Whether it runs compiled loops, which the first run on a machine compiles."""

    def run(self) -> None:
        """Do it."""
        raise NotImplementedError


def idle(options: "DataclassInstance", names: Sequence[str], why: str) -> list[str]:
    """Return a note for each option that was given and has no effect."""
    defaults = {each.name: each.default for each in fields(options)}
    given = [name for name in names if getattr(options, name) != defaults[name]]
    return [f"--{name.replace('_', '-')} has no effect: {why}." for name in given]


@dataclass(frozen=True, kw_only=True)
class ModelVerb(Verb):
    """Options of every verb that runs models; the small models that ship with the package ignore them."""

    models: Annotated[OptionalPath, arg(metavar="DIR")] = None
    """Folder of models, searched before the hub's cache. Default: AVLMAPS_MODELS."""
    device: Annotated[OptionalText, arg(metavar="DEVICE")] = None
    """Device of large models: auto, cpu, cuda, cuda:1, mps. Default: AVLMAPS_DEVICE, or a GPU if there is one."""
    precision: Annotated[
        Literal["auto", "float32", "float16", "bfloat16"] | None, arg(metavar="auto|float32|float16|bfloat16")
    ] = None
    """Precision of large models. Default: AVLMAPS_PRECISION, or float16 on CUDA and float32 elsewhere."""


@dataclass(frozen=True, kw_only=True)
class MapVerb(ModelVerb):
    """A verb of one map."""

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder (NAME.avlmap)."""
