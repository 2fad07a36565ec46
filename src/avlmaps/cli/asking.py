"""A query of the command line and its shell, answered as JSON; apart from the parser, which takes longer to load."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avlmaps.cli.output import UsageError
from avlmaps.core.frames import FrameName
from avlmaps.query.asking import Asked, AskError, Files, ask, thing_alone

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap


def answered(
    open_map: "Callable[[], AVLMap]",
    sentence: str = "",
    top: int = 3,
    *,
    image: Path | None = None,
    clip: Path | None = None,
    intrinsics: tuple[float, ...] | None = None,
    plot: Path | None = None,
    frame: FrameName = FrameName.RECORDING,
    **parts: Any,
) -> dict[str, Any]:
    """Return the answer to a query.

    Args:
        open_map: opens the map, once the query is known to fit together.
        sentence: the words.
        top: most goals.
        image: what "this photo" means.
        clip: what "this recording" means.
        intrinsics: fx, fy, cx, cy of the photo's camera, pixels.
        plot: a picture to write.
        frame: of the positions in the answer.
        parts: object, sound, area and primary; see ``Asked``.

    Raises:
        UsageError: what is given does not fit together.
    """
    if top < 1:
        raise UsageError(f"--top is {top}; it must be 1 or more.")
    photo, recording = (None if file is None else str(file) for file in (image, clip))
    try:
        asked = Asked(sentence=sentence, image=photo, clip=recording, top=top, **parts)
        avlmap = open_map()
        with _announcing(asked, avlmap, plot):
            answer = ask(avlmap, asked, Files(intrinsics))
            drawn = {} if plot is None or answer.heat is None else {"plot": str(answer.heat.plot(plot, top=top))}
    except AskError as error:
        raise UsageError(str(error)) from None
    told: dict[str, Any] = {**answer.to_dict(), **drawn}
    if frame is FrameName.RECORDING:
        return told
    from avlmaps.query.frames import answer_in

    return answer_in(told, frame, avlmap.space.level_from_recording)


def _announcing(asked: Asked, avlmap: "AVLMap", plot: Path | None) -> AbstractContextManager[None]:
    """Return what announces that loops are compiled; a question about one thing, which runs none, loads nothing."""
    if plot is None and thing_alone(asked, avlmap) is not None:
        return nullcontext()
    from avlmaps.core.compiling import announce_compiling

    return announce_compiling()
