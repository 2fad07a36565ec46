"""Faces of small things: screens, keyboards, clocks, rows of books."""

import cv2
import numpy as np
from jaxtyping import Float32

from avlmaps_sim.textures.outdoors import landscape
from avlmaps_sim.textures.pictures import text
from avlmaps_sim.textures.texture import FILL, Texture, cloud, coloured, earthy, grid, harmony

Picture = Float32[np.ndarray, "h w 3"]


def _dark_screen(rng: np.random.Generator, size: int) -> Picture:
    x, y = grid(size)
    a, b = rng.uniform(0.1, 0.9, 2)
    near = np.maximum(np.abs(x - a) / rng.uniform(0.05, 0.2), np.abs(y - b) / rng.uniform(0.05, 0.3))
    value = 0.035 + float(rng.uniform(0.0, 0.18)) * np.clip(1.3 - near, 0.0, 1.0) + 0.03 * (1 - y) * rng.random()
    return (value * (1.0 + 0.1 * cloud(rng, size, 2.0)))[..., None] * np.array((0.95, 1.0, 1.08), np.float32)


def _desktop(rng: np.random.Generator, size: int) -> Picture:
    image = landscape(rng, size) if rng.random() < 0.4 else np.ones((size, size, 3), np.float32)
    if image.min() == 1.0:
        image *= harmony(rng, 1)[0].astype(np.float32) * 0.6
    for _ in range(int(rng.integers(0, 4))):
        dark = rng.random() < 0.4
        left, top = int(rng.integers(0, size // 2)), int(rng.integers(0, size // 2))
        right, bottom = left + int(rng.integers(60, size - 30)), top + int(rng.integers(50, size - 40))
        image[top:bottom, left:right] = 0.12 if dark else 0.96
        image[top : top + 7, left:right] = harmony(rng, 1)[0] * 0.8
        ink = (0.8, 0.82, 0.8) if dark else (0.15, 0.15, 0.17)
        box = (left + 5, top + 12, min(right, size) - 5, min(bottom, size - 8))
        text(rng, image, box, ink, int(rng.integers(2, 4)))
        if rng.random() < 0.3:
            image[top + 7 : bottom, left : left + 20] *= 0.7
    image[-9:] = float(rng.choice((0.1, 0.85)))
    for x in range(4, int(rng.integers(20, size - 20)), 12):
        image[-7:-2, x : x + 6] = harmony(rng, 1)[0]
    return image


def _page(rng: np.random.Generator, size: int) -> Picture:
    dark = rng.random() < 0.5
    image = np.full((size, size, 3), 0.11 if dark else 0.96, np.float32)
    if rng.random() < 0.3:
        for x in range(12, size - 20, 14):
            image[size - 15 - int(rng.integers(10, size - 50)) : size - 15, x : x + 9] = harmony(rng, 1)[0]
        return image
    for top in range(8, size - 10, 40):
        ink = harmony(rng, 1)[0] if dark else np.array((0.15, 0.15, 0.2))
        text(rng, image, (10 + 12 * int(rng.integers(3)), top, size - 10, top + 36), (*ink.tolist(),), 3)
    return image


def screen(rng: np.random.Generator) -> Texture:
    """Draw a television or monitor: off, or on and shining."""
    size = 160
    if rng.random() < 0.45:
        return coloured(_dark_screen(rng, size))
    makers = (_desktop, _page, landscape)
    image = makers[int(rng.integers(3))](rng, size)
    return coloured(image, FILL, emission=float(rng.uniform(0.5, 0.85)))


def books(rng: np.random.Generator) -> Texture:
    """Draw a row of spines on a shelf: widths, heights, colours, titles, a gap, a leaning one."""
    size = 192
    back = float(rng.uniform(0.04, 0.25))
    image = np.full((size, size, 3), back, np.float32)
    tones = np.concatenate([harmony(rng, 5), earthy(rng, 4), rng.uniform(0.05, 0.95, (3, 3))])
    x, series = 0, np.zeros(3)
    while x < size:
        if rng.random() < 0.06:
            x += int(rng.integers(4, 25))
            continue
        wide, tall = int(rng.integers(5, 20)), int(size * rng.uniform(0.62, 0.97))
        cloth = series if rng.random() < 0.2 else tones[int(rng.integers(len(tones)))]
        series = cloth
        end, top = min(x + wide, size), size - tall
        curve = 0.72 + 0.28 * np.sin(np.pi * (np.arange(x, end) - x + 0.5) / wide)
        image[top:, x:end] = cloth * curve[None, :, None]
        ink = (0.92, 0.86, 0.6) if cloth.mean() < 0.5 else (0.12, 0.1, 0.12)
        _spine(rng, image[top:, x:end], ink)
        image[top:, max(end - 1, 0) : end] *= 0.45
        x += wide
    return coloured(image * (1.0 + 0.03 * cloud(rng, size, 0.6))[..., None])


def _spine(rng: np.random.Generator, spine: Picture, ink: tuple[float, float, float]) -> None:
    high, wide = spine.shape[:2]
    if wide >= 6 and rng.random() < 0.8:
        start, stop = int(high * rng.uniform(0.08, 0.3)), int(high * rng.uniform(0.45, 0.85))
        letters = np.flatnonzero(rng.random(stop - start) < 0.7) + start
        margin = int(rng.integers(2, max(3, wide // 2)))
        spine[letters, margin : wide - margin] = ink
    for share in rng.uniform(0.03, 0.97, int(rng.integers(0, 4))).tolist():
        row = int(high * share)
        spine[row : row + int(rng.integers(1, 7))] = ink if rng.random() < 0.5 else spine[row, :1] * 0.6


def keyboard(rng: np.random.Generator) -> Texture:
    """Draw the keys of a keyboard, letters and a space bar."""
    high, wide = 80, 224
    dark = rng.random() < 0.65
    case, cap = (0.08, 0.15) if dark else (float(rng.uniform(0.6, 0.85)), 0.93)
    image = np.full((high, wide, 3), case, np.float32)
    ink = (0.8, 0.8, 0.8) if dark else (0.2, 0.2, 0.22)
    pitch, rows = 14, 5
    for row in range(rows):
        x, y = 6, 6 + row * pitch
        while x < wide - 14:
            keys = 1.0 if rng.random() < 0.85 else 1.6
            keys = 6.0 if row == rows - 1 and 45 < x < 60 else keys
            end = min(int(x + keys * pitch) - 3, wide - 6)
            cv2.rectangle(image, (x, y), (end, y + pitch - 4), (cap * 0.85,) * 3, -1)
            cv2.rectangle(image, (x + 1, y), (end - 1, y + pitch - 6), (cap,) * 3, -1)
            if keys < 5:
                image[y + 2 : y + 6, x + 3 : x + 6] = ink
            x = end + 3
    return coloured(cv2.GaussianBlur(image, (0, 0), 0.5))


def clockface(rng: np.random.Generator) -> Texture:
    """Draw a dial with marks and hands at some time of the day."""
    size, middle = 160, 80
    light = rng.random() < 0.7
    face, ink = ((0.94, 0.93, 0.89), (0.08, 0.08, 0.09)) if light else ((0.12, 0.12, 0.14), (0.9, 0.88, 0.8))
    image = np.full((size, size, 3), face, np.float32)
    radius = 72
    cv2.circle(image, (middle, middle), 77, harmony(rng, 1)[0].tolist(), int(rng.integers(2, 9)), 16)
    numbers = rng.random() < 0.6
    for hour in range(12):
        c, s = np.sin(np.pi * hour / 6), -np.cos(np.pi * hour / 6)
        outer = (int(middle + radius * 0.95 * c), int(middle + radius * 0.95 * s))
        if numbers:
            place = (int(middle + radius * 0.8 * c) - 8, int(middle + radius * 0.8 * s) + 6)
            mark = np.zeros((size, size), np.uint8)  # letters are drawn into 8 bits only
            cv2.putText(mark, str(hour or 12), place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 255, 2, 16)
            image += (mark[..., None] / 255.0 * (np.array(ink) - image)).astype(np.float32)
        else:
            length = 0.78 if hour % 3 else 0.68
            cv2.line(image, (int(middle + radius * length * c), int(middle + radius * length * s)), outer, ink, 4, 16)
    minutes = float(rng.uniform(0, 720))
    for turn, length, thick in ((minutes / 720, 0.5, 5), (minutes / 60, 0.75, 3)):
        tip = (
            int(middle + radius * length * np.sin(2 * np.pi * turn)),
            int(middle - radius * length * np.cos(2 * np.pi * turn)),
        )
        cv2.line(image, (middle, middle), tip, ink, thick, 16)
    return coloured(cv2.GaussianBlur(image, (0, 0), 0.6))
