"""The contents of rendered rooms: the surface of the things of each kind, counted from the scenes themselves."""

import csv
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.scene import Scene

# Every eighth scene is an office, since homes hold no meeting rooms.
_AN_OFFICE = 8
# A thing's surface that can be seen from one side counts up to this, m²: a long run of blinds is no more than that.
_MOST_M2 = 6.0

Contents = list[tuple[str, float]]
Surfaces = Mapping[str, Mapping[str, float]]
"""The mean surface, m², by thing and by kind of room."""


def scenes(first_seed: int, count: int) -> list[str]:
    """Return the names of the scenes of some seeds."""
    seeds = range(first_seed, first_seed + count)
    return [f"{'office' if seed % _AN_OFFICE == _AN_OFFICE - 1 else 'house'}:{seed}:training" for seed in seeds]


def rooms_of(scene: Scene) -> list[tuple[str, Contents]]:
    """Return the kind of each room of a scene, and its things with the surface that one side of each shows, m²."""
    contents: list[Contents] = [[] for _ in scene.areas]
    for thing in scene.objects:
        if 0 <= thing.area < len(contents):
            width, depth, height = (high - low for low, high in zip(thing.low, thing.high, strict=True))
            surface = width * depth + width * height + depth * height
            contents[thing.area].append((thing.category, min(surface, _MOST_M2)))
    return [(area.kind, own) for area, own in zip(scene.areas, contents, strict=True)]


def mean_surfaces(rooms: Iterable[tuple[str, Contents]]) -> Surfaces:
    """Return for each thing and each kind of room the mean surface of such things in such a room, m²."""
    total: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    count: dict[str, int] = defaultdict(int)
    for kind, things in rooms:
        name = kind_of_room(kind)
        if name is None:
            continue
        count[name] += 1
        for category, surface in things:
            if category not in STRUCTURE:
                total[category][name] += surface
    return {
        thing: {kind: surface / count[kind] for kind, surface in by_kind.items()} for thing, by_kind in total.items()
    }


def kind_of_room(kind: str) -> str | None:
    """Return the kind of room that the view encoder distinguishes: a toilet is a bathroom, a corridor a hallway."""
    known = lexicon()
    entry = known.find(kind, EntryKind.ROOM)
    family = () if entry is None else (entry, *known.wider(entry.name, EntryKind.ROOM))
    return next((each.name for each in family if each.split == "training"), None)


def write_table(surfaces: Surfaces, path: Path) -> None:
    """Write the table: a row for each thing, a column for each kind of room, in the order of the lexicon."""
    known = lexicon()
    kinds = [
        entry.name for entry in known.entries(EntryKind.ROOM) if any(entry.name in row for row in surfaces.values())
    ]
    things = [entry.name for entry in known.entries(EntryKind.THING) if entry.name in surfaces]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["thing", *kinds])
        for thing in things:
            table.writerow([thing, *(f"{surfaces[thing].get(kind, 0.0):.3g}" for kind in kinds)])
