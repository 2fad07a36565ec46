"""The origin of a table: scenes, seed, profile, weights, rules; as JSON and in words."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import msgspec

from avlmaps_sim.bench.harness.settings import Recorded, SceneSettings

_SHOWN = 12  # of a checksum


def provenance(
    settings: SceneSettings, recorded: Recorded, scenes: Sequence[str], weights: Mapping[str, str]
) -> dict[str, Any]:
    """Return the provenance that a suite on scenes writes beside its tables."""
    return {
        "scenes": [shown_scene(scene) for scene in scenes],
        "profile": settings.profile,
        "models": list(settings.models),
        "rules": settings.rules,
        "seed": recorded.seed,
        "recorded": msgspec.to_builtins(recorded),
        "weights": dict(weights),
    }


def shown_scene(spec: str) -> str:
    """Return a scene's name for tables: of a file or folder its own name, never the place on this machine."""
    return PurePath(spec).name if "/" in spec or "\\" in spec else spec


def clip_table(clips: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return the table of the clips that were heard: sound, number of times, names of the files."""
    named: dict[str, list[str]] = {}
    for sound, clip in clips:
        named.setdefault(sound, []).append(PurePath(clip).name)
    rows = [[sound, len(own), ", ".join(sorted(set(own)))] for sound, own in sorted(named.items())]
    return {"columns": ["sound", "times", "clips"], "rows": rows}


def in_words(answer: Mapping[str, Any]) -> str:
    """Return the provenance of an answer as one paragraph."""
    models = f" with {', '.join(answer['models'])}" if answer.get("models") else ""
    recorded = answer.get("recorded")
    parts = [f"Profile {answer['profile']}{models}", f"rules {answer.get('rules', 'ours')}", f"seed {answer['seed']}"]
    if answer.get("scenes"):
        count = len(answer["scenes"])
        parts.append(f"{count} scene{'s' if count > 1 else ''} ({', '.join(answer['scenes'])})")
    if recorded:
        parts += [
            f"at most {recorded['frames']} frames each",
            f"sensor {recorded['sensor']}",
            f"hearing {recorded['hearing']}",
            _sounds(recorded),
        ]
    parts.append(f"weights {weights_in_words(answer.get('weights', {}))}")
    return "; ".join(parts) + "."


def _sounds(recorded: Mapping[str, Any]) -> str:
    if not recorded["sounds"]:
        return "sounds made by the rules that also made training sounds of the embedded encoder"
    if recorded.get("clips") == "unheard":
        return f"recorded clips of {recorded['sounds']} that the embedded sound encoder was not trained on"
    return f"recorded clips of {recorded['sounds']}"


def weights_in_words(weights: Mapping[str, str]) -> str:
    """Return modules and the first digits of their models' checksums."""
    return ", ".join(f"{module} {checksum[:_SHOWN]}" for module, checksum in sorted(weights.items())) or "not recorded"


def outdated(weights: Mapping[str, str], shipped: Mapping[str, str]) -> list[str]:
    """Return the modules whose weights a table was measured with are not those that ship."""
    return sorted(module for module, checksum in weights.items() if shipped.get(module) != checksum)
