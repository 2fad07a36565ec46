"""The size at which a transformer sees a picture. Needs no torch."""

Size = tuple[int, int]
# A panorama of 10:1 would else become thousands of patches, whose attention fills any memory.
_MOST_PATCHES = 4096


def working_size(height: int, width: int, short_side: int, patch: int, most_patches: int = _MOST_PATCHES) -> Size:
    """Return (height, width) to resize a picture to: whole patches, its shape preserved as nearly as they allow.

    Args:
        height: of the picture.
        width: of the picture.
        short_side: what the shorter side shall be, pixels.
        patch: edge of a patch, pixels.
        most_patches: of a picture; a very long one is looked at smaller.
    """
    scale = short_side / (patch * min(height, width))
    scale = min(scale, (most_patches / (height * width)) ** 0.5)
    rows, columns = max(1, round(height * scale)), max(1, round(width * scale))
    # Rounding up must not pass the limit of a picture of one row.
    return patch * min(rows, most_patches), patch * min(columns, most_patches // min(rows, most_patches))
