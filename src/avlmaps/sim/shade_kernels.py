"""Compiled shading: the colour of every pixel whose triangle is known. One thread."""

import numpy as np
from numba import njit


@njit(cache=True)
def shade(inverse, shown, camera, look, curve, sky, rgb, depth, instance):  # pragma: no cover - compiled
    """Colour the pixels of one view; see `render.Renderer` for the tables."""
    lens, rotation, origin = camera
    normal, uv_map, material, owner, colour, glow = look
    height, width = depth.shape
    for y in range(height):
        b = (y + 0.5 - lens[3]) / lens[1]
        for x in range(width):
            t = shown[y * width + x]
            if t < 0:
                depth[y, x], instance[y, x] = 0.0, -1
                for c in range(3):
                    rgb[y, x, c] = sky[c]
                continue
            z = np.float32(1.0) / inverse[y * width + x]
            depth[y, x], instance[y, x] = z, owner[t]
            a = (x + 0.5 - lens[2]) / lens[0]
            # camera from world is orthonormal: its rows are the camera's axes in the world
            rx = rotation[0, 0] * a + rotation[1, 0] * b + rotation[2, 0]
            ry = rotation[0, 1] * a + rotation[1, 1] * b + rotation[2, 1]
            rz = rotation[0, 2] * a + rotation[1, 2] * b + rotation[2, 2]
            facing = -(rx * normal[t, 0] + ry * normal[t, 1] + rz * normal[t, 2])
            side = 1.0 if facing >= 0 else -1.0
            light = 0.62 + 0.18 * side * normal[t, 2] + 0.1 * side * normal[t, 0] + 0.05 * side * normal[t, 1]
            m = material[t]
            for c in range(3):
                e = colour[m, c] * max(light, glow[m])
                rgb[y, x, c] = curve[min(4095, max(0, int(e * 2048.0)))]
