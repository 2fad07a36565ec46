"""Make the tables of the contents of rooms: ``python -m training.rooms``, half an hour on a CPU.

Two tables are written. The first counts the things of rendered homes and offices of the training's families; nothing
is perceived. The second says what the embedded pixel encoder names in such rooms: the first, times the share of each
thing's voxels that the encoder gives each name in maps of some of these homes. All seeds are far from a benchmark's.
"""

import argparse
from pathlib import Path

from training.rooms.furnished import Surfaces, mean_surfaces, rooms_of, scenes, write_table
from training.rooms.named import named_surfaces, naming_counts

from avlmaps.perception.protocols import TABLE
from avlmaps_sim.scenes import open_scene

_PERCEPTION = Path(__file__).parents[2] / "src/avlmaps/perception"
FIRST_SEED, HOMES, MAPPED = 300_000, 160, 12


def furnished(first_seed: int, homes: int) -> Surfaces:
    """Return the mean surfaces of the things of the homes and offices of some seeds."""
    return mean_surfaces(room for name in scenes(first_seed, homes) for room in rooms_of(open_scene(name)))


def main() -> None:
    """Make the homes, count, map some of them, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--homes", type=int, default=HOMES, help="number of homes and offices that are counted")
    parser.add_argument("--mapped", type=int, default=MAPPED, help="number of homes that are mapped")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="seed of the first; the others follow it")
    parser.add_argument("--work", type=Path, default=Path("rooms_work"), help="folder of recordings and maps")
    parser.add_argument("--out", type=Path, default=_PERCEPTION, help="folder of the tables")
    chosen = parser.parse_args()
    surfaces = furnished(chosen.first_seed, chosen.homes)
    write_table(surfaces, chosen.out / TABLE)
    homes = [name for name in scenes(chosen.first_seed, 2 * chosen.mapped) if name.startswith("house")]
    names, counts = naming_counts(homes[: chosen.mapped], chosen.work)
    write_table(named_surfaces(surfaces, names, counts), chosen.out / "embedded" / TABLE)


if __name__ == "__main__":
    main()
