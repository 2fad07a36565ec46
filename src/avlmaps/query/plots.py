"""Pictures: the map from above, the heat over it, the path walked, the sounds, the goals numbered."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.core.errors import QueryError
from avlmaps.core.files import user_path
from avlmaps.core.poses import FRAME, FrameName
from avlmaps.core.printable import plot_text
from avlmaps.core.question import Modality
from avlmaps.core.wording import place_text
from avlmaps.query.export import explain_write_errors, palette
from avlmaps.query.factors import Factor, NearAnchors
from avlmaps.query.goals import Goal
from avlmaps.query.settings import FOUND_AT
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Room, Thing

# The view is cut this much over the highest place of the camera, so that a ceiling does not hide the room.
_HEADROOM_M = 0.3
# Colour is the mean of this many voxels from the top of a column.
_SKIN = 3
_MARGIN_CELLS = 6
# Along a side; a map that is wider is drawn in cells of several voxels, so that no map asks for gigabytes.
_MOST_CELLS = 2500


@dataclass(frozen=True, slots=True)
class TopDown:
    """A raster over the level frame; row 0 has the least y."""

    rgb: UInt8[np.ndarray, "h w 3"]  # mean colour of the highest voxels of each column
    seen: Bool[np.ndarray, "h w"]  # which columns have any
    cell: Int[np.ndarray, "n 2"]  # (n, 2) row and column of each voxel of the map
    extent: tuple[float, float, float, float]  # (left, right, bottom, top) in metres

    @classmethod
    def of(cls, space: Space) -> "TopDown":
        """Project a map top-down."""
        voxel_size_m = space.grid.voxel_size_m
        level = space.level(space.centres)
        if not len(space):
            empty = np.zeros((2 * _MARGIN_CELLS, 2 * _MARGIN_CELLS), bool)
            half = _MARGIN_CELLS * voxel_size_m
            extent = (-half, half, -half, half)
            return cls(np.zeros((*empty.shape, 3), np.uint8), empty, np.zeros((0, 2), np.int64), extent)
        places = np.concatenate([level[:, :2], camera_path(space)[:, :2]])
        sides = float(np.ptp(places, axis=0).max()) / voxel_size_m
        cell_m = voxel_size_m * max(1, int(np.ceil(sides / _MOST_CELLS)))
        shown = np.floor(places / cell_m).astype(np.int64)
        ground = shown[: len(level)]
        low, high = shown.min(axis=0) - _MARGIN_CELLS, shown.max(axis=0) + _MARGIN_CELLS + 1
        cell = (ground - low)[:, ::-1]
        shape = int(high[1] - low[1]), int(high[0] - low[0])
        rows = np.flatnonzero(level[:, 2] <= ceiling_m(space, level))
        column = cell[rows, 0] * shape[1] + cell[rows, 1]
        order = np.lexsort((-level[rows, 2], column))
        rows, column = rows[order], column[order]
        first = np.r_[True, column[1:] != column[:-1]] if len(rows) else np.zeros(0, bool)
        place = np.arange(len(rows)) - np.maximum.accumulate(np.where(first, np.arange(len(rows)), 0))
        rows, column = rows[place < _SKIN], column[place < _SKIN]
        grey = np.full((len(space), 3), 150, np.uint8)
        colours = (grey if space.data is None else np.asarray(space.data.voxels.rgb))[rows]
        count = np.bincount(column, minlength=shape[0] * shape[1])
        total = [np.bincount(column, weights=colours[:, k], minlength=len(count)) for k in range(3)]
        mean = np.stack(total, axis=-1) / np.maximum(count, 1)[:, None]
        rgb, seen = mean.astype(np.uint8).reshape(*shape, 3), (count > 0).reshape(shape)
        left, bottom = low * cell_m
        right, top = high * cell_m
        return cls(rgb, seen, cell, (float(left), float(right), float(bottom), float(top)))

    def heat(self, values: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "h w"]:
        """Return the highest heat of each column."""
        raster = np.zeros(self.seen.shape, np.float32)
        np.maximum.at(raster, (self.cell[:, 0], self.cell[:, 1]), values)
        return raster


def camera_path(space: Space) -> Float[np.ndarray, "k 3"]:
    """Return where the keyframes' cameras were, level frame, in the order of time."""
    if space.data is None:
        return np.zeros((0, 3))
    return space.level(np.asarray(space.data.keyframes.world_from_camera)[:, :3, 3])


def ceiling_m(space: Space, level: Float[np.ndarray, "n 3"]) -> float:
    """Return up to which level height a map is shown from above: a little over the highest camera."""
    cameras = camera_path(space)
    return float(cameras[:, 2].max()) + _HEADROOM_M if len(cameras) else float(level[:, 2].max())


# Matplotlib's stubs leave the keywords of every drawing method (**kwargs) without a type.
# pyright: reportUnknownMemberType=false


# Names of more things would cover one another.
MOST_NAMES = 30
_PAPER = "#f6f5f1"
INK = "#26292e"
_PATH = "#2f6fb0"
_SOUND = "#0b7a75"
_COLOURMAP = "inferno"
HEAT_LABEL = "heat × confidence"
_PANEL_M = 4.6
_DPI = 130


def draw_heat(
    factors: Sequence[Factor], shown: Float32[np.ndarray, " n"], found: bool, goals: Sequence[Goal]
) -> "Figure":
    """Draw a heatmap: a panel for each factor, and one for their product; ``shown``: its heat times the confidence."""
    space = factors[0].space
    view = TopDown.of(space)
    count = len(factors) + (len(factors) > 1)
    figure, axes = panels(view, count)
    for factor, ax in zip(factors, axes, strict=False):
        draw_ground(ax, view, space)
        _draw_heat(ax, view, factor.shown)
        _draw_anchors(ax, factor)
        note = "" if factor.found else f" · not found, at most {factor.shown.max(initial=0.0):.2f}"
        title = plot_text(f"{factor.part.modality}: {factor.part.shown}")
        ax.set_title(f"{title} ({factor.part.role}){note}", fontsize=10, color=INK, loc="left")
    if count > 1:
        draw_ground(axes[-1], view, space)
        _draw_heat(axes[-1], view, shown)
        title = f"all together · peak {shown.max(initial=0.0):.2f}" + ("" if found else " · not found")
        axes[-1].set_title(title, fontsize=10, color=INK, loc="left", fontweight="bold")
    _draw_goals(axes[-1], space, goals)
    finish(figure, axes, with_heat=True)
    return figure


def draw_heat_into(ax: "Axes", space: Space, shown: Float32[np.ndarray, " n"], goals: Sequence[Goal] = ()) -> None:
    """Draw heat over the map, and the goals numbered, into axes of the caller's."""
    view = TopDown.of(space)
    draw_ground(ax, view, space)
    _draw_heat(ax, view, shown)
    _draw_goals(ax, space, goals)


def png_of(figure: "Figure") -> bytes:
    """Return a figure as the bytes of a PNG, as notebooks show it."""
    written = BytesIO()
    figure.savefig(written, format="png", bbox_inches="tight")
    return written.getvalue()


def draw_map(
    avlmap: "AVLMap", things: "Sequence[Thing]" = (), rooms: "Sequence[Room]" = (), title: str | None = None,
    ax: "Axes | None" = None,
) -> "Figure":  # fmt: skip
    """Draw a map top-down, with the camera's path, the sounds, and the names of rooms and of ``MOST_NAMES`` things.

    ``ax``: axes of the caller's, which are drawn into.
    """
    space = Space(avlmap.data.grid, avlmap.data.voxels.index, avlmap.data.up_in_world, avlmap.data)
    view = TopDown.of(space)
    figure, axes = panels(view, 1) if ax is None else (ax.get_figure(root=True), [ax])
    assert figure is not None  # axes that are drawn into have one
    draw_ground(axes[0], view, space)
    sounds = avlmap.data.sounds
    for k in range(len(sounds)):
        track = space.level(sounds.track[sounds.track_offsets[k] : sounds.track_offsets[k + 1]])
        axes[0].plot(*track[:, :2].T, color=_SOUND, linewidth=5, alpha=0.45, solid_capstyle="round")
        mark(axes[0], track.mean(axis=0), f"{sounds.onset_s[k]:.0f} s", _SOUND)
    if len(sounds):
        axes[0].plot([], [], color=_SOUND, linewidth=5, alpha=0.45, label="sound position, with the time")
    _draw_names(axes[0], space, things, rooms)
    name = plot_text(Path(avlmap.path).name) if title is None else title
    axes[0].set_title(
        f"{name}: {len(space):,} voxels, {len(sounds)} sounds", fontsize=10, color=INK, loc="left", fontweight="bold"
    )
    if ax is None:
        finish(figure, axes, with_heat=False)
    return figure


def _draw_names(ax: "Axes", space: Space, things: "Sequence[Thing]", rooms: "Sequence[Room]") -> None:
    # Write names where things and rooms are, and draw the outlines of rooms.
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]
    style: dict[str, Any] = {"ha": "center", "va": "center", "path_effects": halo, "clip_on": True}
    for thing in sorted(things, key=lambda one: -one.size[0] * one.size[1])[:MOST_NAMES]:
        x, y, _ = space.level(np.array(thing.position))
        ax.text(x, y, plot_text(thing.name), fontsize=6.5, color=INK, zorder=8, **style)
    for room, colour in zip(rooms, palette(len(rooms)) / 255.0, strict=True):
        corners = space.level(room.outline)[:, :2]
        if len(corners):
            ax.fill(*corners.T, facecolor=(*colour, 0.12), edgecolor=(*colour, 0.9), linewidth=1.6, zorder=6)
        x, y, _ = space.level(np.array(room.position))
        text = f"{plot_text(room.name).upper()}\n{room.area_m2:.1f} m²"
        ax.text(x, y, text, fontsize=9, color=_PATH, fontweight="bold", zorder=9, **style)


def panels(view: TopDown, count: int) -> "tuple[Figure, list[Axes]]":
    """Return a figure with panels side by side, as large as the map's shape asks for."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right, bottom, top = view.extent
    aspect = float(np.clip((right - left) / max(top - bottom, 1e-6), 0.4, 2.5))
    width = _PANEL_M * (1.35 if count == 1 else 1.0) * max(aspect, 0.8) / max(1.0, aspect / 1.6)
    columns = 2 if count == 4 else min(count, 3)
    rows = -(-count // columns)
    figure = Figure(figsize=(width * columns + 0.9, (width / aspect + 1.0) * rows), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    figure.set_facecolor("white")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.set_visible(False)
    return figure, list(axes[:count])


def draw_ground(ax: "Axes", view: TopDown, space: Space, with_walk: bool = True) -> None:
    """Draw the map's colours, a little washed out so that what lies over them stands out, and the path walked."""
    ground = np.where(view.seen[..., None], 0.72 * view.rgb / 255.0 + 0.28, _rgb(_PAPER))
    ax.imshow(ground, origin="lower", extent=view.extent, interpolation="nearest")
    ax.set_aspect("equal")
    ax.set_facecolor(_PAPER)
    ax.autoscale(False)
    at = f"(m), frame: {FRAME}" if space.is_level else "of the level frame (m)"
    ax.set_xlabel(f"x {at}", fontsize=8, color=INK)
    ax.set_ylabel(f"y {at}", fontsize=8, color=INK)
    ax.tick_params(labelsize=7, colors=INK, length=2)
    for spine in ax.spines.values():
        spine.set_color("#c9c7c0")
    walk = camera_path(space)
    if with_walk and len(walk) > 1:
        ax.plot(*walk[:, :2].T, color="white", linewidth=2.6, alpha=0.8)
        ax.plot(*walk[:, :2].T, color=_PATH, linewidth=1.2, label="path of the camera")


def picture_frame(space: Space) -> FrameName:
    """Return the frame of a top-down picture: the recording's where that is level, else the level one."""
    return FrameName.RECORDING if space.is_level else FrameName.LEVEL


def _draw_heat(ax: "Axes", view: TopDown, values: Float32[np.ndarray, " n"]) -> None:
    from matplotlib import colormaps

    heat = view.heat(values)
    opacity = 0.85 * (heat / max(float(heat.max(initial=0.0)), 1e-9)) ** 0.8
    colours = colormaps[_COLOURMAP](0.15 + 0.8 * heat)
    colours[..., 3] = opacity
    ax.imshow(colours, origin="lower", extent=view.extent, interpolation="nearest")


def _draw_anchors(ax: "Axes", factor: Factor) -> None:
    if not isinstance(factor, NearAnchors) or not len(factor.anchors):
        return
    anchors = factor.space.level(factor.anchors)
    likely = np.asarray(factor.scores) >= FOUND_AT
    if factor.part.modality is Modality.IMAGE:
        ax.plot(*anchors[0, :2], marker="^", color=_SOUND, markeredgecolor="white", markersize=11, linestyle="none")
        return
    what = "sound position" if factor.part.modality is Modality.SOUND else "seen from here"
    if likely.any():
        style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4, "markeredgecolor": "white"}
        ax.plot(*anchors[likely, :2].T, color=_SOUND, label=what, **style)


def _draw_goals(ax: "Axes", space: Space, goals: Sequence[Goal]) -> None:
    frame = picture_frame(space)
    named = " (level frame)" if frame is FrameName.LEVEL else ""
    levels = [space.level(np.array(goal.position)) for goal in goals]
    for number in range(len(goals), 0, -1):  # the best last: no other hides its number
        mark(ax, levels[number - 1], str(number), INK, aside(levels[number - 1], levels))
    for number, (goal, level) in enumerate(zip(goals, levels, strict=True), 1):
        position = place_text(level if named else goal.position)
        ax.plot([], [], " ", label=f"{number}: {position}{named}, probability {goal.probability:.2f}")


def aside(place: np.ndarray, places: Sequence[np.ndarray]) -> tuple[float, float]:
    """Return where to write of a place, in points to the right and up of it: away from the others within 1.5 m."""
    crowd = [other[:2] for other in places if np.linalg.norm((other - place)[:2]) < 1.5]
    away = place[:2] - np.mean(crowd, axis=0)
    length = float(np.linalg.norm(away))
    return (9.0, 9.0) if length < 1e-6 else (14.0 * float(away[0]) / length, 14.0 * float(away[1]) / length)


def mark(
    ax: "Axes", point_level: Float[np.ndarray, "3"], text: str, colour: str, beside: tuple[float, float] = (9.0, 9.0)
) -> None:
    """Write a short text in a bubble beside a place, in points (1/72 inch) to the right and up of it."""
    box = {"boxstyle": "circle,pad=0.25" if len(text) < 3 else "round,pad=0.25", "facecolor": colour}
    ax.annotate(
        text, xy=(float(point_level[0]), float(point_level[1])), xytext=beside, textcoords="offset points", fontsize=8,
        color="white", fontweight="bold", ha="center", va="center", zorder=6,
        bbox={**box, "edgecolor": "white", "linewidth": 1.0},
        arrowprops={"arrowstyle": "-", "color": "white", "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    ax.plot(*point_level[:2], marker="o", markersize=5, color=colour, markeredgecolor="white", zorder=7)


def finish(figure: "Figure", axes: "Sequence[Axes]", with_heat: bool) -> None:
    """Add the legends and the scale of heat."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap

    for ax in axes:
        if ax.get_legend_handles_labels()[1]:
            ax.legend(
                fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=2, frameon=False, labelcolor=INK
            )
    if with_heat:
        shown = ListedColormap(colormaps[_COLOURMAP](0.15 + 0.8 * np.linspace(0.0, 1.0, 256)))
        bar = figure.colorbar(ScalarMappable(cmap=shown), ax=list(axes), shrink=0.7, pad=0.015, fraction=0.04)
        bar.set_label(HEAT_LABEL, fontsize=8, color=INK)
        bar.ax.tick_params(labelsize=7, colors=INK)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]


def _rgb(colour: str) -> Float[np.ndarray, "3"]:
    from matplotlib.colors import to_rgb

    return np.array(to_rgb(colour))


def save(figure: "Figure", path: Path | str) -> Path:
    """Write a picture, in the format of its suffix. ``QueryError``: the picture cannot be written there."""
    path = user_path(path)
    if path.suffix.lower().lstrip(".") not in figure.canvas.get_supported_filetypes():
        raise QueryError(f"A picture cannot be written as {path.name!r}; give it the suffix .png, .jpg, .svg or .pdf.")
    with explain_write_errors(path):
        figure.savefig(path, bbox_inches="tight", pad_inches=0.15)
    return path
