"""Write the attributions of the clips that taught the weights: ``python -m training.sounds.notice SOUNDS > part``."""

import sys
from collections import Counter
from pathlib import Path

from training.sounds.clips import read_index


def attributions(sounds_folder: Path) -> list[str]:
    """Return one line for each recording: kind, author, licence, source, and how many clips were cut from it."""
    counts: Counter[tuple[str, str, str, str]] = Counter()
    for clip in read_index(sounds_folder):
        if clip.fold and clip.may_ship:
            licence, author, source = (part.strip() for part in clip.licence.split("|"))
            counts[clip.category, author, licence, source] += 1
    return [
        f"- {kind}: {author}, {licence}, {source}" + (f" ({count} clips)" if count > 1 else "")
        for (kind, author, licence, source), count in sorted(counts.items())
    ]


if __name__ == "__main__":
    sys.stdout.write("\n".join(attributions(Path(sys.argv[1]))) + "\n")
