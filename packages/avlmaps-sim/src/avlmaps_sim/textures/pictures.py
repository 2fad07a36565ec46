"""Pictures on walls: paintings and posters, composed by rule."""

import colorsys

import cv2
import numpy as np
from jaxtyping import Float32

from avlmaps_sim.textures.outdoors import landscape
from avlmaps_sim.textures.texture import Texture, cloud, coloured, earthy, grid, harmony, levels, warped

Picture = Float32[np.ndarray, "h w 3"]
Colour = tuple[float, float, float]


def shade(colour: np.ndarray) -> Colour:
    """Return a row of numbers as the colour OpenCV draws with."""
    return float(colour[0]), float(colour[1]), float(colour[2])


def _plane(colour: np.ndarray, size: int) -> Picture:
    return np.broadcast_to(colour.astype(np.float32), (size, size, 3)).copy()


def _shapes(rng: np.random.Generator, size: int) -> Picture:
    """Return discs, bars and polygons of a few colours over each other."""
    colours = harmony(rng, 6)
    image = _plane(colours[0], size)
    for _ in range(int(rng.integers(5, 26))):
        paint = shade(colours[int(rng.integers(1, 6))])
        a, b = rng.integers(0, size, 2).tolist(), rng.integers(0, size, 2).tolist()
        sort = int(rng.integers(4))
        if sort == 0:
            cv2.circle(image, a, int(rng.integers(5, size // 4)), paint, int(rng.choice((-1, 3, 8))), cv2.LINE_AA)
        elif sort == 1:
            cv2.rectangle(image, a, b, paint, -1)
        elif sort == 2:
            cv2.line(image, a, b, paint, int(rng.integers(2, 14)), cv2.LINE_AA)
        else:
            cv2.fillPoly(image, [rng.integers(0, size, (int(rng.integers(3, 6)), 2)).astype(np.int32)], paint)
    return image


def _fields(rng: np.random.Generator, size: int) -> Picture:
    colours = harmony(rng, 5)
    cuts = [np.sort(rng.choice(np.arange(10, size - 10), int(rng.integers(1, 5)), replace=False)) for _ in range(2)]
    column, row = (np.searchsorted(c, np.arange(size)) for c in cuts)
    choice = rng.integers(0, 5, (len(cuts[1]) + 1, len(cuts[0]) + 1))
    image = colours[choice[row[:, None], column[None, :]]].astype(np.float32)
    if rng.random() < 0.5:
        bar = int(rng.integers(2, 8))
        for x in cuts[0].tolist():
            image[:, x : x + bar] = 0.05
        for y in cuts[1].tolist():
            image[y : y + bar] = 0.05
        return image
    return cv2.GaussianBlur(image, (0, 0), float(rng.uniform(2.0, 6.0)))


def _poured(rng: np.random.Generator, size: int) -> Picture:
    colours = harmony(rng, 7)
    field = cloud(rng, size, float(rng.uniform(1.2, 2.2)))
    stir = float(rng.uniform(4.0, 25.0))
    field = warped(field, stir * cloud(rng, size, 2.0), stir * cloud(rng, size, 2.0))
    return colours[np.clip(((field + 2.0) * 1.6).astype(np.int64), 0, 6)].astype(np.float32)


def _portrait(rng: np.random.Generator, size: int) -> Picture:
    colours = harmony(rng, 3) * 0.6
    skin = np.array((0.92, 0.72, 0.58)) * float(rng.uniform(0.35, 1.0))
    image = _plane(colours[0], size) * (1.0 + 0.2 * cloud(rng, size, 1.8))[..., None]
    x, y = int(size * rng.uniform(0.42, 0.58)), int(size * rng.uniform(0.32, 0.42))
    w, h = int(size * rng.uniform(0.11, 0.17)), int(size * rng.uniform(0.16, 0.22))
    hair = shade(np.array((0.25, 0.16, 0.1)) * float(rng.uniform(0.2, 3.0)))
    cv2.ellipse(image, (x, y - h // 5), (int(w * 1.25), int(h * rng.uniform(1.05, 1.6))), 0, 0, 360, hair, -1, 16)
    cv2.ellipse(image, (x, size + h // 3), (int(w * 2.6), int(size * 0.47)), 0, 0, 360, shade(colours[1]), -1, 16)
    cv2.rectangle(image, (x - w // 2, y), (x + w // 2, y + int(1.5 * h)), shade(skin * 0.8), -1)
    cv2.ellipse(image, (x, y), (w, h), 0, 0, 360, shade(skin), -1, 16)
    for side in (-1, 1):
        cv2.ellipse(image, (x + side * w * 2 // 5, y - h // 8), (w // 5, h // 12), 0, 0, 360, (0.1, 0.08, 0.08), -1, 16)
    cv2.line(image, (x, y), (x - w // 8, y + h // 4), shade(skin * 0.7), 2, 16)
    cv2.ellipse(image, (x, y + h // 2), (w // 3, h // 14), 0, 0, 360, (0.6, 0.25, 0.22), -1, 16)
    lit, _ = grid(size)
    return image * (0.75 + 0.5 * (lit if rng.random() < 0.5 else 1 - lit))[..., None]


def _still_life(rng: np.random.Generator, size: int) -> Picture:
    ground, table = earthy(rng, 2)
    image = _plane(ground * 0.6, size)
    image[int(size * rng.uniform(0.55, 0.75)) :] = table * 0.8
    for _ in range(int(rng.integers(4, 12))):
        hue = colorsys.hsv_to_rgb(
            float(rng.choice((0.0, 0.05, 0.1, 0.15, 0.25, 0.6, 0.85))), rng.uniform(0.3, 0.9), 0.8
        )
        x, y, r = (
            int(rng.integers(size // 5, 4 * size // 5)),
            int(size * rng.uniform(0.6, 0.8)),
            int(rng.integers(8, 28)),
        )
        paint, dark = np.array(hue), shade(np.array(hue) * 0.5)
        if rng.random() < 0.3:
            cv2.rectangle(image, (x - r // 2, y - 3 * r), (x + r // 2, y), shade(paint * 0.7), -1)
            cv2.rectangle(image, (x - r // 5, y - 4 * r), (x + r // 5, y - 3 * r), dark, -1)
            continue
        if rng.random() < 0.35:
            cv2.line(image, (x, y), (x + int(rng.integers(-20, 20)), y - 4 * r), (0.2, 0.4, 0.18), 3, 16)
            x, y = x, y - 4 * r
        for step in np.linspace(0.0, 1.0, 4):
            away = int(-0.3 * r * step)
            cv2.circle(
                image, (x + away, y + away), int(r * (1 - 0.75 * step)), shade(paint * (0.6 + 0.5 * step)), -1, 16
            )
    return image


def _print(rng: np.random.Generator, size: int) -> Picture:
    return harmony(rng, 4)[levels(rng, size)].astype(np.float32)


def _photograph(rng: np.random.Generator, size: int) -> Picture:
    image = landscape(rng, size)
    return np.repeat(image.mean(axis=2, keepdims=True), 3, axis=2) if rng.random() < 0.25 else image


def painting(rng: np.random.Generator) -> Texture:
    """Draw a painting, print or photograph, now and then on a passe-partout."""
    size = 192
    makers = (_shapes, _fields, _poured, _portrait, _still_life, _print, _photograph, _photograph)
    image = makers[int(rng.integers(len(makers)))](rng, size)
    brush = 1.0 + float(rng.uniform(0.0, 0.1)) * cloud(rng, size, 0.7, stretch=float(rng.uniform(0.3, 3.0)))
    image = cv2.GaussianBlur(image, (0, 0), 0.6) * brush[..., None]
    if rng.random() < 0.3:
        rim = int(size * rng.uniform(0.06, 0.2))
        inner = cv2.resize(image, (size - 2 * rim, size - 2 * rim), interpolation=cv2.INTER_AREA)
        image = _plane(np.array((0.95, 0.94, 0.9)), size)
        image[rim : size - rim, rim : size - rim] = inner
    return coloured(image)


def text(rng: np.random.Generator, image: Picture, box: tuple[int, int, int, int], ink: Colour, height_px: int) -> None:
    """Set lines of words in made-up letters into the box (left, top, right, bottom) of a picture."""
    left, top, right, bottom = box
    letter = max(2, height_px * 2 // 3)
    for y in range(top, bottom - height_px, max(2 * height_px, height_px + 2)):
        end = right - int((right - left) * (rng.random() ** 3))
        count = (end - left) // letter
        if count < 1:
            continue
        strokes = rng.random((3, count, 3)) < 0.72
        strokes[:, :, 2] = False  # between letters
        strokes[:, rng.random(count) < 0.18] = False  # between words
        down, across = np.arange(height_px) * 3 // height_px, np.arange(count * letter) * 3 // letter
        line = image[y : y + height_px, left : left + count * letter]
        mask = strokes.reshape(3, -1)[down][:, across][: line.shape[0], : line.shape[1]]
        line[mask] = ink


def poster(rng: np.random.Generator) -> Texture:
    """Draw a poster, calendar or notice: a headline, a picture, blocks of text, a band of colour."""
    size = 192
    colours = harmony(rng, 4)
    paper = colours[0] if rng.random() < 0.5 else np.array((0.95, 0.95, 0.93))
    image = _plane(paper, size)
    ink = (0.08, 0.08, 0.1) if paper.mean() > 0.5 else (0.95, 0.95, 0.93)
    if rng.random() < 0.6:
        high = int(rng.integers(60, 140))
        maker = (_shapes, _photograph, _portrait, _print, _poured)[int(rng.integers(5))]
        inset, top = int(rng.choice((0, 12))), int(rng.choice((0, 40)))
        shown = cv2.resize(maker(rng, 128), (size - 2 * inset, high), interpolation=cv2.INTER_AREA)
        image[top : top + high, inset : size - inset] = shown
        text(rng, image, (14, top + high + 8, size - 14, size - 6), ink, int(rng.integers(2, 7)))
        text(rng, image, (14, 8, size - 14, 36), ink, int(rng.integers(8, 14)))
    else:
        image[: int(rng.integers(10, 50))] = colours[1]
        text(rng, image, (14, 10, size - 20, 50), ink, int(rng.integers(8, 14)))
        columns = int(rng.integers(1, 4))
        for i in range(columns):
            wide = (size - 24) // columns
            text(rng, image, (12 + i * wide, 60, 4 + (i + 1) * wide, size - 10), ink, int(rng.integers(2, 5)))
    return coloured(image)
