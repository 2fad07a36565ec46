"""Pictures of answers: a small one drawn in a few milliseconds, and the full one of the command line."""

import io
import threading
from typing import TYPE_CHECKING

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from avlmaps.core.printable import plot_text
from avlmaps.query.answer import Answer
from avlmaps.query.plots import draw_map

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from avlmaps.serve.shelf import ServedMap

SMALL_PIXELS = 480
# Matplotlib's registries are not made for several threads at once.
_drawing = threading.Lock()
_INK, _PATH = (38, 41, 46), (47, 111, 176)


def full_picture(served: "ServedMap", answer: Answer) -> bytes:
    """Return the PNG that ``avlmaps query --plot`` writes; of an answer from a list the small one, with its places."""
    if answer.heat is None:
        return small_picture(served, answer)
    with _drawing:
        return _png(answer.heat.plot(top=max(len(answer.goals), 1)))


def map_picture(served: "ServedMap") -> bytes:
    """Return the PNG of a map from above, with its path and sounds."""
    with _drawing:
        return _png(draw_map(served.avlmap.stored, title=plot_text(served.name)))


def _png(figure: "Figure") -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", bbox_inches="tight", pad_inches=0.15)
    return stream.getvalue()


def small_picture(
    served: "ServedMap", answer: Answer | None = None, places: "list[Float[np.ndarray, '3']] | None" = None
) -> bytes:
    """Return a small PNG: the map from above, the heat, the goals numbered.

    Args:
        served: the map.
        answer: its heat and goals are drawn.
        places: further places to number, metres, recording frame; instead of the goals.
    """
    view, space = served.top_down, served.avlmap.space
    ground = np.where(view.seen[..., None], 0.72 * view.rgb + 0.28 * 255.0, 246.0)
    if answer is not None and answer.heat is not None:
        heat = view.heat(answer.heat.shown)[..., None]
        colour = _heat_colours(heat[..., 0])
        opacity = 0.85 * np.power(heat / max(float(heat.max(initial=0.0)), 1e-9), 0.8)
        ground = ground * (1.0 - opacity) + colour * opacity
    left, _, bottom, _ = view.extent
    rows, columns = view.seen.shape
    scale = SMALL_PIXELS / max(rows, columns, 1)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    mode = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_NEAREST
    picture = np.ascontiguousarray(cv2.resize(ground.astype(np.uint8)[::-1], size, interpolation=mode))
    cell_m = (view.extent[1] - left) / max(columns, 1)
    points = places if places is not None else [np.array(goal.position) for goal in answer.goals] if answer else []
    for number, point in enumerate(points, 1):
        x, y = space.level(point)[:2]
        at = round((x - left) / cell_m * scale), size[1] - 1 - round((y - bottom) / cell_m * scale)
        _mark(picture, at, str(number))
    done, encoded = cv2.imencode(".png", picture[..., ::-1])
    return encoded.tobytes() if done else b""


def _mark(picture: UInt8[np.ndarray, "h w 3"], at: tuple[int, int], text: str) -> None:
    cv2.circle(picture, at, 9, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(picture, at, 8, _INK, -1, cv2.LINE_AA)
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
    corner = at[0] - width // 2, at[1] + height // 2
    cv2.putText(picture, text, corner, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1, cv2.LINE_AA)


def _heat_colours(heat: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
    levels = np.clip(255.0 * (0.15 + 0.8 * heat), 0, 255).astype(np.uint8)
    return cv2.applyColorMap(levels, cv2.COLORMAP_INFERNO)[..., ::-1].astype(np.float64)
