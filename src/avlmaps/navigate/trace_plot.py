"""The path that a robot drove, over the top-down map: obstacles faint, start, goals, stops, contacts."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps.core.printable import plot_text
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.skills import LoggedMove
from avlmaps.query.plots import INK, TopDown, aside, draw_ground, finish, mark, panels, save
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    pass

_WAY = "#d6336c"
_GOAL = "#1f7a4d"
_CONTACT = "#c92a2a"
_OBSTACLE_RGBA = (0.15, 0.16, 0.18, 0.30)
_LONGEST_NAME = 60


def plot_path(
    path: Path,
    space: Space,
    start: GroundPose,
    moves: Sequence[LoggedMove],
    obstacles: Obstacles,
    contacts: Float[np.ndarray, "m 2"] | None = None,
    title: str = "",
) -> Path:
    """Write a picture of a robot's path, in which the movements to a place are numbered.

    ``contacts`` are places where it touched something that the map did not know, level x and y. It raises
    ``QueryError`` where the picture cannot be written.
    """
    view = TopDown.of(space)
    figure, (ax,) = panels(view, 1)
    draw_ground(ax, view, space, with_walk=False)
    layer = np.zeros((*obstacles.states.T.shape, 4))
    layer[obstacles.states.T == CellState.OCCUPIED] = _OBSTACLE_RGBA
    low = obstacles.origin_m
    high = low + np.array(obstacles.states.shape) * obstacles.cell_size_m
    ax.imshow(layer, origin="lower", extent=(low[0], high[0], low[1], high[1]), interpolation="nearest", zorder=2)
    for move in moves:
        ax.plot(*move.path.T, color="white", linewidth=3.2, alpha=0.9, zorder=4)
        ax.plot(*move.path.T, color=_WAY, linewidth=1.8, zorder=5)
    turn_deg = float(np.rad2deg(start.heading_rad)) - 90.0
    ax.plot(
        start.x_m, start.y_m, linestyle="none", marker=(3, 0, turn_deg), markersize=11, color=_WAY,
        markeredgecolor="white", zorder=8, label="start",
    )  # fmt: skip
    if contacts is not None and len(contacts):
        ax.plot(*contacts.T, linestyle="none", marker="x", markersize=5, color=_CONTACT, zorder=6, label="contacts")
    for number, move in enumerate((one for one in moves if one.goal is not None), 1):
        goal, stop = space.level(np.array(move.goal)), space.level(np.array(move.stop))
        ax.plot(*np.stack([goal, stop])[:, :2].T, color=_GOAL, linewidth=1.2, linestyle=":", zorder=6)
        ax.plot(*goal[:2], linestyle="none", marker="o", markersize=11, markerfacecolor="none", markeredgecolor=_GOAL,
                markeredgewidth=2.0, zorder=7)  # fmt: skip
        mark(ax, stop, str(number), _GOAL if move.reached else _CONTACT, aside(stop, [stop, goal]))
        name = plot_text(move.name or move.skill.replace("_", " "), _LONGEST_NAME)
        reached = f"{move.distance_m:.2f} m from it" if move.reached else "not reached"
        ax.plot([], [], " ", label=f"{number}: {name}, {reached}")
    ax.set_title(plot_text(title), fontsize=10, color=INK, loc="left", fontweight="bold", wrap=True)
    finish(figure, [ax], with_heat=False)
    return save(figure, path)
