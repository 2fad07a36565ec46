"""The demonstration's report: one HTML file beside its pictures; it opens from disk and needs no network."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from avlmaps.demo.run import DemoReport, Step
    from avlmaps.sim.record import Heard

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --right: #2a7f3f; --wrong: #b3261e; }
body { font: 16px/1.55 system-ui, sans-serif; max-width: 62rem; margin: 2.5rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.9rem; margin-bottom: .2rem; } h2 { margin-top: 2.6rem; font-size: 1.25rem; }
img { max-width: 100%; border-radius: 6px; border: 1px solid var(--line); background: #fff; }
code { background: #8882; padding: .12rem .35rem; border-radius: 4px; font-size: .92em; }
table { border-collapse: collapse; }
td, th { text-align: left; padding: .25rem 1rem .25rem 0; border-bottom: 1px solid var(--line); }
.facts { display: flex; flex-wrap: wrap; gap: .6rem 2rem; margin: 1.2rem 0; padding: 0; list-style: none; }
.facts b { display: block; font-size: 1.4rem; }
.right { color: var(--right); font-weight: 600; } .wrong { color: var(--wrong); font-weight: 600; }
"""


def write_report(report: "DemoReport", heard: "Sequence[Heard]") -> Path:
    """Write report.html into the demonstration's folder."""
    built = report.built
    facts = (
        ("frames", f"{built['frames']}"),
        ("voxels", f"{built['voxels']:,}"),
        ("keyframes", f"{built['keyframes']}"),
        ("sounds heard", f"{len(built['sounds'])}"),
        ("seconds to build", f"{report.seconds.get('build', 0):.0f}"),
        ("photo located within", "-" if report.located is None else f"{report.located[0]:.1f} cm"),
    )
    body = [
        "<h1>A room that can be asked</h1>",
        "<p>A robot walked through a room with an RGB-D camera and a microphone. What it saw and heard was fused "
        "into one map; then the map was asked, in words, by a photo and by a sound. Nothing below knew where things "
        "are: the truth was looked up afterwards, to say how far each answer is off.</p>",
        '<ul class="facts">'
        + "".join(f"<li><b>{escape(value)}</b>{escape(name)}</li>" for name, value in facts)
        + "</ul>",
        "<h2>What was put into the track</h2>",
        _table(heard),
        *[_section(number, step) for number, step in enumerate(report.steps, start=1)],
        "<h2>Go on from here</h2>",
        "<p>The map is <code>room.avlmap</code> beside this page; ask it yourself: "
        '<code>avlmaps query room.avlmap "the green plant near the doorbell sound" --plot heat.png</code></p>',
    ]
    path = report.out / "report.html"
    head = (
        f'<!doctype html><meta charset="utf-8"><title>avlmaps: a room that can be asked</title><style>{_STYLE}</style>'
    )
    path.write_text(head + "\n".join(body) + "\n", encoding="utf-8")
    return path


def _table(heard: "Sequence[Heard]") -> str:
    rows = "".join(
        f"<tr><td>{escape(h.category)}</td><td>{h.onset_s:.1f} to {h.offset_s:.1f} s</td>"
        f"<td>robot at ({h.robot[0]:.1f}, {h.robot[1]:.1f}) m</td></tr>"
        for h in heard
    )
    return f"<table><tr><th>sound</th><th>when</th><th>where it was heard</th></tr>{rows}</table>"


def _section(number: int, step: "Step") -> str:
    if step.answer["found"]:
        position = ", ".join(f"{value:.2f}" for value in step.answer["goals"][0]["position"])
        said = f"At ({position}) m"
        said += "" if step.off_m is None else f", {step.off_m:.2f} m from the true place"
    else:
        said = "It says that there is none here"
    verdict = f'<span class="{"right" if step.right else "wrong"}">{"right" if step.right else "wrong"}</span>'
    return (
        f"<h2>{number}. {escape(step.title)}</h2><p><code>{escape(step.command)}</code></p>"
        f"<p>{said}: {verdict} ({step.answer['elapsed_ms']:.0f} ms).</p>"
        f'<img src="{escape(step.picture)}" alt="heat of: {escape(step.title)}">'
    )
