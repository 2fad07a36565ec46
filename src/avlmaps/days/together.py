"""Several recordings of one place become one map: each is built by itself, then found in the first and merged."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.progress import say
from avlmaps.days.merge import merge_maps, merged_key
from avlmaps.maps.build import build_map
from avlmaps.maps.cluster import ClusterWorkers, Pool, Reopen
from avlmaps.maps.plan import require_place
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.maps.store.folder import MANIFEST
from avlmaps.perception.cache import DEFAULT_CACHE, CacheSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.query.avlmap import AVLMap, with_findings


def build_together(
    recordings: Sequence[Reopen],
    out: Path | str,
    encoders: Encoders,
    pool: Pool,
    settings: BuildSettings = DEFAULTS,
    *,
    cache: CacheSettings = DEFAULT_CACHE,
    allow: Sequence[str] = (),
    overwrite: bool = False,
) -> AVLMap:
    """Build the map of several recordings of one place with the workers of a pool, or finish one that was begun.

    The maps of the single recordings lie beside it, in ``NAME-recordings``: a recording more costs its own work alone.
    Their parts are the jobs. Errors are those of ``build_map`` and ``merge_maps``; a recording of another place is
    refused with the numbers.
    """
    out = user_path(out)
    folder = out.with_name(f"{out.name.removesuffix('.avlmap')}-recordings")
    paths = [folder / f"{number:04d}.avlmap" for number in range(1, len(recordings) + 1)]
    for reopen, path in zip(recordings, paths, strict=True):
        build_map(reopen(), path, encoders, settings, cache=cache, workers=ClusterWorkers(pool, reopen, cache),
                  allow=allow, overwrite=overwrite, finds=with_findings)  # fmt: skip
    return merge_in_turn([AVLMap.open(path) for path in paths], folder, out, overwrite=overwrite)


def merge_in_turn(days: Sequence[AVLMap], scratch: Path, out: Path, *, overwrite: bool = False) -> AVLMap:
    """Merge maps in their order, each found in the ones before; what a stopped run had merged is used again.

    Errors as of ``merge_maps``; what was merged before stays in ``scratch``.
    """
    keys = [days[0].data.info.build_key]
    for day in days[1:]:
        keys.append(merged_key(keys[-1], day.data.info.build_key))
    paths = [days[0].path, *(scratch / f"first-{number:04d}.avlmap" for number in range(2, len(days))), out]
    at, merged = next(
        (number, found)
        for number in range(len(days) - 1, -1, -1)
        if (found := _finished(paths[number], keys[number])) is not None
    )
    if at == len(days) - 1:
        say(f"{out} is finished already, of the same recordings with the same settings; nothing to do.")
    elif (out / MANIFEST).is_file():
        require_place(out, overwrite)
    for number in range(at + 1, len(days)):
        made = merge_maps(merged, days[number], paths[number], overwrite=overwrite or number < len(days) - 1)
        if number > 1:
            shutil.rmtree(merged.path, ignore_errors=True)
        merged = made
    return merged


def _finished(path: Path, key: str) -> AVLMap | None:
    if not (path / MANIFEST).is_file():
        return None
    try:
        found = AVLMap.open(path)
    except MapError:
        return None
    return found if found.data.info.build_key == key else None
