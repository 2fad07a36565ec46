"""The world beyond a window, and landscapes in general."""

import cv2
import numpy as np
from jaxtyping import Float32

from avlmaps_sim.textures.texture import FILL, Texture, cloud, coloured, grid

Picture = Float32[np.ndarray, "s s 3"]

# Colours of the sky overhead and at the horizon: noon, haze, dull, evening, dawn.
_SKIES = (((0.25, 0.48, 0.85), (0.75, 0.86, 0.95)), ((0.6, 0.72, 0.85), (0.88, 0.9, 0.92)),
          ((0.68, 0.7, 0.73), (0.82, 0.83, 0.84)), ((0.25, 0.28, 0.5), (0.95, 0.6, 0.38)),
          ((0.5, 0.6, 0.8), (0.98, 0.82, 0.74)))  # fmt: skip


def _sky(rng: np.random.Generator, size: int) -> Picture:
    over, far = (np.array(c) for c in _SKIES[int(rng.integers(len(_SKIES)))])
    _, y = grid(size)
    sky = over + (far - over) * np.minimum(y * 1.5, 1.0)[..., None]
    cover = np.clip(cloud(rng, size, 1.6, stretch=0.5) - float(rng.uniform(-0.5, 1.5)), 0.0, 1.0)[..., None]
    return (sky * (1 - 0.8 * cover) + 0.95 * 0.8 * cover).astype(np.float32)


def _ridge(rng: np.random.Generator, size: int, height: float, rough: float) -> np.ndarray:
    line = cloud(rng, 64, rough)[0]
    wide = np.interp(np.linspace(0, 63, size), np.arange(64), line)
    return size * (height + float(rng.uniform(0.01, 0.06)) * wide)


def _houses(rng: np.random.Generator, image: Picture, ground: float) -> None:
    size = len(image)
    x, tall = int(rng.integers(-20, 10)), rng.random() < 0.4
    while x < size:
        w = int(rng.integers(18, 60))
        h = int(rng.integers(50, 130)) if tall else int(rng.integers(18, 50))
        wall = np.array((0.8, 0.74, 0.66)) * rng.uniform(0.5, 1.15) + rng.normal(0, 0.05, 3)
        top, foot = int(ground) - h, int(ground) + 4
        cv2.rectangle(image, (x, top), (x + w, foot), wall.tolist(), -1)
        for wy in range(top + 5, foot - 7, 12):
            for wx in range(x + 4, x + w - 5, 10):
                cv2.rectangle(
                    image,
                    (wx, wy),
                    (wx + 4, wy + 6),
                    (np.array((0.3, 0.36, 0.42)) * rng.uniform(0.5, 1.5)).tolist(),
                    -1,
                )
        if not tall:
            roof = np.array(((x - 3, top), (x + w // 2, top - int(rng.integers(8, 22))), (x + w + 3, top)), np.int32)
            cv2.fillPoly(image, [roof], (np.array((0.5, 0.27, 0.2)) * rng.uniform(0.5, 1.2)).tolist())
        x += w + int(rng.integers(0, 25))


def _trees(rng: np.random.Generator, image: Picture, ground: float) -> None:
    size = len(image)
    for _ in range(int(rng.integers(1, 7))):
        x, r = int(rng.integers(0, size)), int(rng.integers(10, 42))
        foot = int(ground + rng.uniform(0, 25))
        top = foot - int(r * rng.uniform(1.5, 2.5))
        cv2.line(image, (x, foot), (x, top), (0.22, 0.16, 0.11), max(2, r // 7))
        green = np.array((0.2, 0.36, 0.13)) * rng.uniform(0.5, 1.4) + rng.normal(0, 0.03, 3)
        for _ in range(int(rng.integers(20, 60))):
            a, b = rng.normal(0, 0.45 * r, 2)
            lit = 0.75 + 0.35 * float(rng.random()) - 0.3 * b / r
            cv2.circle(
                image, (int(x + a), int(top + b)), max(2, int(r * rng.uniform(0.12, 0.3))), (green * lit).tolist(), -1
            )


def landscape(rng: np.random.Generator, size: int) -> Picture:
    """Return hills, fields, sea, a street or a garden under a sky."""
    image = _sky(rng, size)
    row = np.arange(size)[:, None]
    horizon = float(rng.uniform(0.4, 0.75))
    haze = image[int(horizon * size)].mean(axis=0)
    for depth in range(int(rng.integers(0, 4))):
        tone = np.array((0.25, 0.36, 0.22)) * rng.uniform(0.6, 1.3) * (0.4 + 0.2 * depth) + haze * (0.5 - 0.15 * depth)
        image[row >= _ridge(rng, size, horizon - 0.12 + 0.05 * depth, float(rng.uniform(1.0, 2.2)))[None, :]] = tone
    lands = (
        (0.3, 0.42, 0.18),
        (0.45, 0.55, 0.25),
        (0.72, 0.62, 0.42),
        (0.25, 0.4, 0.5),
        (0.45, 0.45, 0.44),
        (0.9, 0.92, 0.95),
    )
    land = np.array(lands[int(rng.integers(len(lands)))])
    ground = land * (1.0 + 0.1 * cloud(rng, size, 1.0, stretch=0.4))[..., None]
    image = np.where((row >= horizon * size)[..., None], ground, image).astype(np.float32)
    if rng.random() < 0.5:
        _houses(rng, image, horizon * size)
    if rng.random() < 0.75:
        _trees(rng, image, horizon * size)
    return np.clip(image * (1.0 + 0.03 * cloud(rng, size, 0.4))[..., None], 0.0, 1.0).astype(np.float32)


def _night(rng: np.random.Generator, size: int) -> Picture:
    image = np.full((size, size, 3), 0.03, np.float32) + np.array((0.0, 0.01, 0.03), np.float32)
    for _ in range(int(rng.integers(3, 50))):
        x, y = int(rng.integers(0, size)), int(rng.integers(size // 3, size))
        glow = (np.array((1.0, 0.82, 0.5)) * rng.uniform(0.3, 1.0)).tolist()
        cv2.rectangle(image, (x, y), (x + int(rng.integers(1, 6)), y + int(rng.integers(1, 7))), glow, -1)
    return image


def outdoors(rng: np.random.Generator) -> Texture:
    """Draw the view through a window, mostly by day and then shining."""
    size = 192
    if rng.random() < 0.12:
        return coloured(_night(rng, size), FILL, emission=0.1)
    view = cv2.GaussianBlur(landscape(rng, size), (0, 0), float(rng.uniform(0.3, 1.2)))
    bright = float(rng.uniform(0.0, 0.45))  # the camera is set for the room: what is outside washes out
    return coloured(view * (1 - bright) + bright, FILL, emission=float(rng.uniform(0.5, 0.7)))
