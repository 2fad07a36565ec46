"""`avlmaps export`: write a map for other programs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from msgspec import Meta
from tyro.conf import arg

from avlmaps.cli.output import UsageError, size_of
from avlmaps.cli.verb import SHARE, SIZE, MapVerb, shown_in

if TYPE_CHECKING:
    from avlmaps.core.poses import FrameName
    from avlmaps.query.avlmap import AVLMap

_SUFFIXES = (".ply", ".glb", ".pgm", ".csv", ".rrd", ".mcap", ".openlex3d")
# What has layers of its own for heat and things, beside the colours of the voxels.
_LAYERED = (".rrd", ".mcap")
_LEVEL = (".pgm", ".glb", *_LAYERED)


@dataclass(frozen=True, kw_only=True)
class Export(MapVerb):
    """Write a map for other programs: PLY, GLB, an occupancy grid for Nav2 (PGM and YAML), CSV, Rerun, Foxglove (MCAP).

    Example: avlmaps export home.avlmap --out home.glb

    Example: avlmaps export home.avlmap --out sofa.ply --heat "the sofa"

    Example: avlmaps export home.avlmap --out floor.pgm --radius-m 0.3

    Example: avlmaps export home.avlmap --out home.rrd --heat "the sofa"

    A map of several storeys gives an occupancy grid for each: floor-0.pgm is the lowest.
    """

    out: Annotated[Path, arg(metavar="FILE")]
    """File to write; its suffix chooses the format: .ply points, .glb blocks, .pgm occupancy grid, .csv table, .rrd for
    Rerun (extra rerun), .mcap with Foxglove's schemas (extra foxglove), .openlex3d folder for OpenLex3D's evaluator."""
    things: bool = False
    """Colour voxels by the thing that they belong to (.ply, .glb)."""
    heat: Annotated[str | None, arg(metavar="SENTENCE")] = None
    """Colour voxels by the heat of a query (.ply, .glb), or add the heat as a layer (.rrd, .mcap)."""
    least: Annotated[float, SHARE, arg(metavar="CONFIDENCE")] = 0.5
    """Use things with at least this confidence, 0 to 1 (.csv, .rrd, .mcap, --things)."""
    radius_m: Annotated[float, SIZE, arg(metavar="METRES")] = 0.2
    """Radius of the robot (.pgm)."""
    height_m: Annotated[float, SIZE, arg(metavar="METRES")] = 1.5
    """Height of the robot; higher voxels are no obstacles (.pgm)."""
    storey: Annotated[int | None, Meta(ge=0), arg(metavar="N")] = None
    """Storey of the grid, counted from 0, the lowest (.pgm). Default: each in its own file, such as floor-0.pgm."""
    frame: Annotated[Literal["recording", "level"] | None, arg(metavar="recording|level")] = None
    """Frame of the coordinates. Default: recording for .ply, .csv and .openlex3d, level for .glb (y up, as GLB has it),
    .pgm, .rrd and .mcap."""
    overwrite: bool = False
    """Replace a file that exists."""

    def run(self) -> None:
        self.require()
        super().run()

    def require(self) -> None:
        kind = self.out.suffix.lower()
        _require_sense(self, kind)
        if kind != ".pgm":
            _require_new([self.out], self.overwrite)

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        from avlmaps.core.poses import FrameName
        from avlmaps.query.export import write_table

        self.require()
        kind, written = self.out.suffix.lower(), [self.out]
        frame = FrameName(self.frame or ("level" if kind in _LEVEL else "recording"))
        if kind == ".pgm":
            return _write_grids(self, avlmap)
        if kind == ".csv":
            listed = shown_in(avlmap.contents(self.least).to_json(""), frame, avlmap)
            write_table(self.out, listed["things"], listed["sounds"], frame)
        elif kind in _LAYERED:
            from avlmaps.query.export_viewers import layers_of, write_foxglove, write_rerun

            write = write_rerun if kind == ".rrd" else write_foxglove
            write(self.out, layers_of(avlmap, frame, self.heat, self.least))
        elif kind == ".openlex3d":
            from avlmaps.query.export import write_openlex3d

            written = list(write_openlex3d(self.out, avlmap))
        else:
            _write_voxels(self, avlmap, kind, frame)
        return {"map": str(self.map), "files": [str(path) for path in written], "frame": str(frame)}

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        files = ", ".join(f"{name} ({size_of(Path(name).stat().st_size)})" for name in answer["files"])
        storeys = answer.get("storeys", [])
        several = [f"one grid for each storey of the map, lowest first: {', '.join(storeys)}"] * (len(storeys) > 1)
        axes = ", y up" if answer["files"][0].lower().endswith(".glb") and answer["frame"] == "level" else ""
        return [f"wrote {files}, {answer['frame']} frame{axes}", *several]


def _require_sense(verb: Export, kind: str) -> None:
    name = verb.out.name
    if kind not in _SUFFIXES:
        raise UsageError(f"--out takes a file that ends in {', '.join(_SUFFIXES)}; {name!r} does not.")
    if verb.things and kind in _LAYERED:
        raise UsageError(f"{name!r} shows things as boxes in any case; leave --things out.")
    if verb.things and verb.heat is not None:
        raise UsageError("--things and --heat both choose colours; give one of them.")
    if (verb.things or verb.heat is not None) and kind not in (".ply", ".glb", *_LAYERED):
        raise UsageError(f"--things and --heat colour a .ply or a .glb; {name!r} has no colours.")
    if kind == ".pgm" and verb.frame == "recording":
        raise UsageError("An occupancy grid is a floor plan and needs the level frame; leave --frame out.")
    if kind == ".openlex3d" and verb.frame == "level":
        raise UsageError("OpenLex3D compares with positions of its recordings; leave --frame out.")
    if verb.storey is not None and kind != ".pgm":
        raise UsageError(f"--storey chooses the storey of an occupancy grid; {name!r} holds all of them.")


def _require_new(paths: "list[Path]", overwrite: bool) -> None:
    there = [str(path) for path in paths if path.exists()]
    if there and not overwrite:
        raise UsageError(f"{' and '.join(there)} exists; give another --out, or replace it with --overwrite.")


def _write_grids(verb: Export, opened: "AVLMap") -> dict[str, Any]:
    from avlmaps.maps.obstacles import BodyShape
    from avlmaps.navigate.costmap import obstacles_for
    from avlmaps.query.export import write_occupancy

    storeys = opened.storeys
    numbers = [0] if storeys is None else list(range(len(storeys)))
    several = verb.storey is None and len(numbers) > 1
    wanted = numbers if verb.storey is None else [verb.storey]
    named = [verb.out.with_stem(f"{verb.out.stem}-{number}") if several else verb.out for number in wanted]
    written = [path for grid in named for path in (grid, grid.with_suffix(".yaml"))]
    _require_new(written, verb.overwrite)
    shape = BodyShape(radius_m=verb.radius_m, height_m=verb.height_m)
    for number, path in zip(wanted, named, strict=True):
        write_occupancy(path, obstacles_for(opened, shape, number))
    answer = {"map": str(verb.map), "files": [str(path) for path in written], "frame": "level"}
    return answer if storeys is None else answer | {"storeys": [storeys[number].name for number in wanted]}


def _write_voxels(verb: Export, opened: "AVLMap", kind: str, frame: "FrameName") -> None:
    from avlmaps.query.export import heat_colors, thing_colors, write_glb, write_ply

    colors, columns = opened.colors, {}
    if verb.things:
        colors = thing_colors(len(colors), opened.things(least_confidence=verb.least))
    elif verb.heat is not None:
        heat = opened.ask(verb.heat).heat
        if heat is not None:
            colors, columns = heat_colors(heat.shown), {"heat": heat.values}
    if kind == ".ply":
        write_ply(verb.out, opened.space, colors, columns, frame)
    else:
        write_glb(verb.out, opened.space, colors, frame)
