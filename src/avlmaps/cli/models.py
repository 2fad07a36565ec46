"""`avlmaps profiles` and `teach-sound`: which models there are, whether they work, and sounds of your own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Any, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.output import AnsweredError, UsageError, emit, table_lines
from avlmaps.cli.verb import ModelVerb, Verb
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.extras import how_to_get

FETCHERS_GROUP = "avlmaps.fetchers"


@dataclass(frozen=True, kw_only=True)
class Profiles(ModelVerb):
    """List the profiles and their backends: which are installed, and which command installs the others.

    Without --fetch nothing is downloaded, and no large model is opened: only its files are searched in --models and in
    the hub's cache.

    Example: avlmaps profiles --models models

    Example: avlmaps profiles --check place:thumbnail
    """

    check: Annotated[tuple[str, ...] | None, arg(metavar="[BACKEND ...]")] = None
    """Load these backends (all that are here, without a name) and hold each to its protocol; name what one lacks."""
    fetch: Literal["light"] | None = None
    """Bring the files of this profile into the folder of models, checked by their SHA-256."""
    source: Annotated[str | None, arg(name="from", metavar="URL|DIR")] = None
    """Where --fetch finds them: a page or a folder. Default: AVLMAPS_LIGHT_FROM."""

    def run(self) -> None:
        if self.fetch is not None:
            self._bring(self.fetch)
            return
        if self.source is not None:
            raise UsageError("--from says where --fetch finds the files; add --fetch light.")
        if self.check is not None:
            self._check(self.check)
            return
        answer, lines = list_profiles(), list[str]()
        for entry in answer["profiles"]:
            lines += [*_wrapped(f"{entry['name']}: {entry['about']}", ""), *_backend_lines(entry["backends"])]
        if answer["other_backends"]:
            lines += ["in no profile:", *_backend_lines(answer["other_backends"])]
        emit(answer, [*lines, "models, sizes and limits: avlmaps profiles --json"], self.json)

    def _check(self, names: tuple[str, ...]) -> None:
        checks = check_backends(names)
        lines = [f"{one['module']} {one['name']}: {one['fault'] or 'keeps its protocol'}" for one in checks]
        emit({"checks": checks}, lines, self.json)
        if broken := [one for one in checks if one["fault"]]:
            said = "; ".join(f"{one['module']} {one['name']}: {one['fault']}" for one in broken)
            raise AnsweredError(f"{len(broken)} of {len(checks)} backends break their protocol: {said}")

    def _bring(self, profile: str) -> None:
        from avlmaps.core.registry import brought, entry_points

        fetchers = entry_points(FETCHERS_GROUP).select(name=profile)
        if not fetchers:
            get = how_to_get("profiles", profile)
            raise BackendError(f"The profile {profile!r} is not installed; get it with: {get}")
        found = brought(next(iter(fetchers)), "the fetcher")(self.source or "")
        whole = sum(note.bytes for note in found.manifest.files.values())
        folder, received = str(found.folder), found.received_bytes
        answer = {"fetched": found.manifest.id, "folder": folder, "bytes": whole, "received_bytes": received}
        came = f"{received / 1e6:.0f} MB came now" if received else "all was here already"
        lines = [
            f"{found.manifest.id}: {len(found.manifest.files)} files, {whole / 1e6:.0f} MB, in {folder} ({came})",
            "build with them: avlmaps build REC --out MAP --profile light",
        ]
        emit(answer, lines, self.json)


def list_profiles() -> dict[str, Any]:
    """Return every profile's backends, and every other backend that is known."""
    from avlmaps.core.registry import Kind, backends
    from avlmaps.perception.encoders import profiles
    from avlmaps.perception.models import availability

    known = {(backend.kind, backend.name): backend for backend in backends()}

    def state_of(kind: Kind, choice: str) -> dict[str, Any]:
        name, _, model = choice.partition("@")
        entry = {"module": str(kind), "name": name or "-", "state": "none", "model": "", "licence": "", "note": ""}
        backend = known.get((kind, name))
        if backend is None:
            return entry if not name else {**entry, "state": "broken", "note": f"no {kind} backend is called {name}"}
        found = availability(backend, model)
        entry |= {"state": found.state, "model": found.model, "licence": found.licence, "note": found.note}
        return {**entry, "dim": found.dim} if found.dim else entry

    listed = [
        {
            "name": profile.name,
            "about": profile.about,
            "backends": [state_of(kind, profile.name_of(kind)) for kind in Kind if kind is not Kind.WORDS],
        }
        for profile in profiles()
    ]
    in_profiles = {(b["module"], b["name"]) for entry in listed for b in entry["backends"]}
    others = [state_of(b.kind, b.name) for b in known.values() if (str(b.kind), b.name) not in in_profiles]
    return {"profiles": listed, "other_backends": others}


def check_backends(names: Sequence[str]) -> list[dict[str, str]]:
    """Load backends and hold each to its protocol; ``fault`` says what it lacks or breaks.

    A name is ``name`` or ``module:name``; without any, every backend is loaded whose packages and files are here.
    """
    from avlmaps.core.errors import NonConformanceError
    from avlmaps.core.registry import backends, load
    from avlmaps.perception.conformance import check
    from avlmaps.perception.models import availability

    known = backends()
    chosen = [one for one in known if {one.name, f"{one.kind}:{one.name}"} & set(names)]
    for name in names:
        if not any(name in (one.name, f"{one.kind}:{one.name}") for one in chosen):
            raise BackendError(f"There is no backend called {name!r}; avlmaps profiles lists them.")
    checks: list[dict[str, str]] = []
    for one in chosen if names else [one for one in known if availability(one).state == "ready"]:
        fault = ""
        try:
            check(one.kind, load(one.kind, one.name))
        except (AvlmapsError, NonConformanceError) as error:
            fault = str(error)
        except Exception as error:  # noqa: BLE001 - another's code
            fault = f"it raised {type(error).__name__}: {error}"
        checks.append({"module": str(one.kind), "name": one.name, "fault": fault})
    return checks


_WIDTH = 80


def _wrapped(text: str, margin: str) -> list[str]:
    return wrap(text, _WIDTH, initial_indent=margin, subsequent_indent=f"{margin}  ", break_on_hyphens=False)


def _backend_lines(backends: list[dict[str, Any]]) -> list[str]:
    columns = ("module", "backend", "state", "licence")
    cells = [(b["module"], b["name"], b["state"], b["licence"]) for b in backends]
    missing: dict[str, list[str]] = {}
    for one in backends:
        if one["state"] not in ("ready", "none"):
            missing.setdefault(one["note"], []).append(f"{one['module']} {one['name']}")
    gets = [line for note, of in missing.items() for line in _wrapped(f"{', '.join(of)}: {note}", "  ")]
    return [*("  " + line for line in table_lines(columns, cells)), *gets]


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
