"""`avlmaps teach-sound`: enrol a sound of your own."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tyro.conf import Positional

from avlmaps.cli.output import UsageError, emit
from avlmaps.cli.verb import Verb

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, kw_only=True)
class TeachSound(Verb):
    """Teach a new kind of sound from a few clips of it; it is kept in your own profile folder.

    Example: avlmaps teach-sound "our doorbell" bell1.wav bell2.wav bell3.wav
    """

    name: Positional[str]
    """What you will call it in a query."""
    clips: Positional[tuple[Path, ...]] = ()
    """Sound files, three or more for preference."""
    forget: bool = False
    """Forget the sound of this name."""

    def run(self) -> None:
        """Teach or forget."""
        if bool(self.clips) == self.forget:
            raise UsageError("teach-sound takes clips to learn from, or --forget, and not both.")
        answer = teach(self.name, self.clips)
        emit(answer, [f"{key}: {value}" for key, value in answer.items()], self.json)


def teach(name: str, clips: tuple[Path, ...]) -> dict[str, Any]:
    """Teach a kind of sound from clips, or forget it where there are none."""
    from avlmaps.perception.enrolment import forget_sound, taught_sounds, teach_sound

    if clips:
        teach_sound(name, list(clips))
    else:
        forget_sound(name)
    return {"name": name, "clips": len(clips), "taught": [sound.name for sound in taught_sounds()]}
