"""What one must know to judge a table: scenes, seed, profile, weights, rules; as JSON and in words."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from avlmaps.bench.harness.settings import Recorded, SceneSettings

_SHOWN = 12  # of a checksum


def provenance(
    settings: SceneSettings, recorded: Recorded, scenes: Sequence[str], weights: Mapping[str, str]
) -> dict[str, Any]:
    """Return what a suite on scenes writes beside its tables."""
    return {
        "scenes": list(scenes),
        "profile": settings.profile,
        "models": list(settings.models),
        "rules": settings.rules,
        "seed": recorded.seed,
        "recorded": msgspec.to_builtins(recorded),
        "weights": dict(weights),
    }


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
