"""`avlmaps profiles`: which models there are, which of them are here, and how to get the others."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tyro.conf import arg

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.distributions import how_to_get
from avlmaps.core.errors import BackendError

FETCHERS_GROUP = "avlmaps.fetchers"


@dataclass(frozen=True, kw_only=True)
class Profiles(ModelVerb):
    """List the profiles and their backends: which are installed, and which command installs the others.

    Without --fetch nothing is downloaded, and no large model is opened: only its files are searched in --models and in
    the hub's cache.

    Example: avlmaps profiles --models models
    """

    fetch: Literal["light"] | None = None
    """Bring the files of this profile into the folder of models, checked by their SHA-256."""
    source: Annotated[str | None, arg(name="from", metavar="URL|DIR")] = None
    """Where --fetch finds them: a page or a folder. Default: AVLMAPS_LIGHT_FROM."""

    def run(self) -> None:
        """List them, or fetch the files of one."""
        if self.fetch is not None:
            self._bring()
            return
        if self.source is not None:
            raise BackendError("--from says where --fetch finds the files; add --fetch light.")
        answer = list_profiles()
        lines: list[str] = []
        for entry in answer["profiles"]:
            lines += [f"{entry['name']}: {entry['about']}", *_backend_lines(entry["backends"])]
        if answer["other_backends"]:
            lines += ["in no profile:", *_backend_lines(answer["other_backends"])]
        emit(answer, lines, self.json)

    def _bring(self) -> None:
        from avlmaps.core.registry import brought, entry_points

        fetchers = entry_points(FETCHERS_GROUP).select(name=self.fetch)
        if not fetchers:
            get = how_to_get("profiles", self.fetch or "")
            raise BackendError(f"The profile {self.fetch!r} is not installed; get it with: {get}")
        found = brought(next(iter(fetchers)), "the fetcher")(self.source or "")
        whole = sum(note.bytes for note in found.manifest.files.values())
        answer = {
            "fetched": found.manifest.id,
            "folder": str(found.folder),
            "bytes": whole,
            "received_bytes": found.received_bytes,
        }
        came = f"{found.received_bytes / 1e6:.0f} MB came now" if found.received_bytes else "all was here already"
        lines = [
            f"{found.manifest.id}: {len(found.manifest.files)} files, {whole / 1e6:.0f} MB, in {found.folder} ({came})",
            "build with them: avlmaps build REC --out MAP --profile light",
        ]
        emit(answer, lines, self.json)


def list_profiles() -> dict[str, Any]:
    """Return every profile's backends, and every other backend that is known."""
    from avlmaps.core.registry import Kind, backends
    from avlmaps.perception.models.availability import availability
    from avlmaps.perception.profiles import profiles

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
            "backends": [state_of(kind, profile.backend_name(kind)) for kind in Kind if kind is not Kind.WORDS],
        }
        for profile in profiles()
    ]
    in_profiles = {(b["module"], b["name"]) for entry in listed for b in entry["backends"]}
    others = [state_of(b.kind, b.name) for b in known.values() if (str(b.kind), b.name) not in in_profiles]
    return {"profiles": listed, "other_backends": others}


def _backend_lines(backends: list[dict[str, Any]]) -> list[str]:
    columns = ("module", "backend", "state", "model", "licence", "note")
    cells = [(b["module"], b["name"], b["state"], b["model"], b["licence"], b["note"]) for b in backends]
    return ["  " + line for line in table_lines(columns, cells)]
