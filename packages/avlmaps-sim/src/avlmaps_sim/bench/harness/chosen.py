"""The choices of ours that were made on the very scenes that a table is measured on."""

from collections.abc import Sequence

# Each choice, and the scenes that decided it.
_CHOICES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("the weight by distance in fusion", ("house:1000000:held-out",)),
    (
        "how far a view's vote spreads (RoomSettings.views_m), the limits of unsure instances (ObjectSettings."
        "least_in_company, score_in_company) and the settings of photos by colour (PhotometricSettings)",
        tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_005)),
    ),
    (
        "which of three sets of pixel weights ships",
        tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_010)),
    ),
)


def chosen_on(scenes: Sequence[str]) -> str:
    """Return one sentence on the choices that scenes of a table decided; ``""`` where they decided none."""
    parts = [
        f"{choice} (on {sum(scene in deciding for scene in scenes)} of the {len(scenes)} scenes)"
        for choice, deciding in _CHOICES
        if any(scene in deciding for scene in scenes)
    ]
    return "; ".join(parts) + "." if parts else ""
