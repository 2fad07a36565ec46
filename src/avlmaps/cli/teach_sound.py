"""`avlmaps teach-sound`: enrol a sound of your own."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit
from avlmaps.cli.verb import Verb


@dataclass(frozen=True, kw_only=True)
class TeachSound(Verb):
    """Teach a new kind of sound from a few clips; your own profile folder stores it.

    Example: avlmaps teach-sound "our doorbell" bell1.wav bell2.wav bell3.wav
    """

    name: Annotated[Positional[str], arg(metavar="NAME")]
    """Name of the sound in queries."""
    clips: Annotated[Positional[tuple[Path, ...]], arg(metavar="CLIP ...")] = ()
    """Sound files, preferably three or more."""
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
    from avlmaps.perception.enrolment import enrolled_sounds, forget_sound, teach_sound

    if clips:
        teach_sound(name, list(clips))
    else:
        forget_sound(name)
    return {"name": name, "clips": len(clips), "taught": [sound.name for sound in enrolled_sounds()]}
