"""Names in a clause: things, sounds, areas and files, out of the tree that the grammar makes of them."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from avlmaps.core.errors import LanguageError
from avlmaps.core.question import Modality
from avlmaps.language.rules.intents import INSIDE, Named, Target
from avlmaps.language.rules.sounds import NOISES, PAST_TENSES, SOUND_NOUNS, SOUND_VERBS, SOUNDING_THINGS
from avlmaps.language.sentence import AREA_WORDS

# Words that no name has: what holds one was not understood, and is refused rather than sought on the map.
_NEVER_NAMED = frozenset({
    "one", "ones", "is", "are", "was", "were", "be", "been", "has", "had", "does", "did", "somewhere", "someplace",
    "anywhere", "everywhere", "here", "quick", "quickly", "please", "over", "across", "along", "about", "with", "again",
    "whoever", "whatever", "came", "comes", "coming", "heard", "said", "someone", "somebody", "something", "anything",
    "everything", "everyone", "just", "okay", "ok", "might", "may", "also", "too", "very", "my", "your", "its", "away",
    "hurt", "hurts", "aches", "arrived", "spilled", "spilt", "escaped", "stinks", "smells", "leaks", "waits", "sleeps",
    "rings", "breaks", "sings", "cries", "drips", "wakes", "arrives", "boils", "begins", "finishes", "opens", "closes",
    "go",
    "toward", "towards", "during", "while", "since", "though", "although", "everybody", "another", "both", "each",
    "either", "lots", "around", "onto", "upon", "maybe", "really", "actually", "first", "lastly", "finally",
})  # fmt: skip
_POINTED_AT = frozenset(
    {"place", "spot", "location", "position", "thing", "point", "direction", "way", "source", "area", "zone"}
)
# Parts of a room have no place of their own in a map; the room has.
_PARTS_OF_AREAS = frozenset(
    {"middle", "centre", "center", "end", "corner", "back", "front", "side", "rest", "inside", "part"}
)
_NOT_TOLD_APART = frozenset(
    {"other", "others", "second", "third", "fourth", "fifth", "furthest", "farthest", "nth", "next"}
)
_MEASURES = frozenset({"degrees", "degree", "metres", "meters", "metre", "cm", "centimetres", "centimeters", "times"})
_NO_THINGS = frozenset(
    {
        "left",
        "right",
        "front",
        "back",
        "side",
        "rear",
        "middle",
        "centre",
        "center",
        "north",
        "south",
        "east",
        "west",
        "up",
        "down",
    }
)
_STANDING = frozenset({"is", "are", "was", "were", "stands", "stand", "sits", "lies", "hangs", "lives"})
_SOUNDING = re.compile(rf"(?:{'|'.join(SOUND_VERBS)})[a-z]?ing")
_PAST = re.compile(rf"({'|'.join(SOUND_VERBS)})([a-z]?)ed")
_PRESENT = re.compile(rf"({'|'.join(SOUND_VERBS)})()(?:e?s)?")


class Names:
    """Reads names, and keeps notes of how one was taken that could be meant in another way."""

    def __init__(self, files: tuple[str, ...]) -> None:
        self.files = files
        self.notes: list[str] = []
        self._last: Named | None = None

    def target(self, node: Any) -> Target:
        """Return the target of a `target`, `near_target` or `item` node, or of a node that holds the parts of one."""
        children = node.children if node.data in ("target", "near_target") else [node]
        named, context = self._item(children[0])
        for place in children[1:]:
            context += self._context(place)
        self._last = named or self._last
        return Target(named, tuple(context))

    def target_of(self, parts: list[Any]) -> Target:
        """Return the target whose thing and places stand side by side in a rule."""
        named, context = self._core(parts[0])
        for place in parts[1:]:
            context += self._context(place)
        return Target(named, tuple(context))

    def _item(self, node: Any) -> tuple[Named | None, list[Named | None]]:
        if is_token(node, "IT"):
            return None, []
        if is_rule(node, "item", "near_item"):
            inner = [child for child in node.children if not is_token(child, "ARTICLE")]
            article = next((str(child) for child in node.children if is_token(child, "ARTICLE")), "")
            named, context = self._item(inner[0])
            if named is not None and re.match(r"any\b|one of", article, re.IGNORECASE):
                named = Named(named.modality, _singular(named.words), named.is_file)
            if named is not None and named == self._last and re.match(r"that\b|those\b", article, re.IGNORECASE):
                return None, context
            return named, context
        return self._core(node)

    def _context(self, place: Any) -> list[Named | None]:
        """Return what a place names; sides of things are no more than near them, which is noted."""
        context: list[Named | None] = []
        for child in place.children:
            if is_rule(child, "heard"):
                named, more = self._core(child)
                context += [named, *more]
            if is_token(child, "INSIDE"):
                context.append(INSIDE)
            if is_token(child, "FRONT_OF", "BEHIND", "SIDE_OF", "AHEAD"):
                self._note_side(child)
            if is_rule(child, "item", "near_item", "near_target"):
                found = self.target(child)
                context += [found.sought, *found.context]
        return context

    def _note_side(self, token: Any) -> None:
        if token.type == "AHEAD":
            self.notes.append("'in front of you' was left out: the best place on the map is taken.")
        else:
            self.notes.append(f"{str(token).strip()!r} after a thing was taken as near.")

    def _core(self, node: Any) -> tuple[Named, list[Named | None]]:
        """Return what a name means: the thing, and the area that its "of" puts it in."""
        kind = node.data
        if kind in ("picture", "clip", "heard_clip"):
            mark = next(token for token in node.children if is_token(token, "IMAGE_FILE", "CLIP_FILE"))
            modality = Modality.IMAGE if mark.type == "IMAGE_FILE" else Modality.SOUND
            return Named(modality, self.files[int(mark[2:-1])], is_file=True), []
        tokens = list(_words(node))
        spoken = [str(word) for word in tokens]
        # A gap of two characters is a comma and a space.
        if any(after.start_pos - word.end_pos == 2 for word, after in pairwise(tokens)):
            raise LanguageError(
                f"'{', '.join(spoken)}' could be one thing or several; put 'the' before each, like: the sofa, the "
                "table and the bed."
            )
        if len(spoken) == 1 and spoken[0].lower() in ("sound", "sounds", "noise", "noises"):
            raise LanguageError("Which sound is not said; say it like: go to the sound of rain.")
        if kind == "sound":
            return Named(Modality.SOUND, " ".join(spoken)), []
        if kind == "sound_verb":
            verb = next(str(token) for token in node.children if is_token(token, "SOUND_VERB"))
            return Named(Modality.SOUND, f"{' '.join(spoken[1:])} {verb.lower()}"), []
        if kind == "heard":
            return self._heard(node, spoken)
        return self._thing(spoken)

    def _heard(self, node: Any, spoken: list[str]) -> tuple[Named, list[Named | None]]:
        """Return what was heard; "where the sofa is" is the sofa, "where the glass broke" is glass breaking."""
        told = any(is_token(token, "HEARD", "WHERE_HEARD", "SOUND_OF") for token in node.children)
        if not told and spoken[-1].lower() in _STANDING and len(spoken) > 1:
            return self._thing(spoken[:-1])
        if told and any(is_token(token, "WHERE_HEARD") for token in node.children):
            return Named(Modality.SOUND, " ".join(spoken)), []
        kept = [word for word in spoken if word.lower() not in ("was", "were", "is", "are", "being", "has", "been")]
        if not told and len(kept) > 2 and f"{kept[-2]} {kept[-1]}".lower() in ("went off", "goes off"):
            kept = [*kept[:-2], "going", "off"]
        on = next((at for at, word in enumerate(kept) if at and word.lower() in ("on", "at", "against")), None)
        if on is not None and not told and kept[on + 1 :] and _sounding(kept[on - 1]) != kept[on - 1]:
            return Named(Modality.SOUND, " ".join([*kept[: on - 1], _sounding(kept[on - 1]), *kept[on:]])), []
        being = len(kept) < len(spoken) and kept[-1:] and kept[-1].lower().endswith("ing")
        sounding = [*kept[:-1], _sounding(kept[-1])] if kept and not told else kept
        if not told and not being and not _is_sound(sounding) and sounding[-2:] != ["going", "off"]:
            raise LanguageError(
                f"'where {' '.join(spoken)}' is not understood; say what was heard there, like: where you heard a dog "
                "barking, or where the thing is, like: next to the sofa."
            )
        return Named(Modality.SOUND, " ".join(sounding)), []

    def _thing(self, spoken: list[str]) -> tuple[Named, list[Named | None]]:
        """Return an object, or a sound or an area if the last word says so."""
        if _MEASURES.intersection(word.lower() for word in spoken):
            raise LanguageError(
                f"{' '.join(spoken)!r} is not understood as the name of a thing; say how far or how much in "
                "figures, like: "
                "go forward 2 metres, or: turn left 30 degrees."
            )
        if len(spoken) == 1 and spoken[0].lower() in _NO_THINGS:
            raise LanguageError(f"{spoken[0]!r} of what is not said; say it like: go to the left of the sofa.")
        if spoken[0].lower() in _NOT_TOLD_APART and len(spoken) > 1:
            raise LanguageError(
                f"{spoken[0]!r} cannot be told from the map in {' '.join(spoken)!r}; say what it is near, like: the "
                f"{' '.join(spoken[1:])} near the window."
            )
        if spoken[0].lower() in ("nearest", "closest") and len(spoken) > 1:
            spoken = spoken[1:]
        if [word.lower() for word in spoken] == ["toilet-room"]:
            return Named(Modality.AREA, spoken[0][: -len("-room")]), []
        if spoken[0].lower() in NOISES and spoken[1:2] == ["of"]:
            noisy = [word for word in spoken[2:] if word.lower() not in ("the", "a", "an", "my", "your", "that")]
            return Named(Modality.SOUND, " ".join([*noisy, spoken[0]])), []
        _refuse_words_of_no_name(spoken)
        if len(spoken) > 1 and spoken[0].lower() in SOUNDING_THINGS:
            self.notes.append(f"{' '.join(spoken)!r} was taken as a sound.")
            return Named(Modality.SOUND, " ".join(spoken)), []
        last = spoken[-1].lower()
        if last in AREA_WORDS and "of" in spoken[1:-1]:
            return self._of_area(spoken)
        if last in AREA_WORDS:
            return Named(Modality.AREA, " ".join(spoken)), []
        return Named(Modality.SOUND if _is_sound(spoken) else Modality.OBJECT, " ".join(spoken)), []

    def _of_area(self, spoken: list[str]) -> tuple[Named, list[Named | None]]:
        at = spoken.index("of")
        thing, area = spoken[:at], [word for word in spoken[at + 1 :] if word.lower() not in ("the", "a", "an", "this")]
        where = Named(Modality.AREA, " ".join(area))
        if thing[-1].lower() in _PARTS_OF_AREAS:
            if thing[-1].lower() not in ("middle", "centre", "center", "inside"):
                self.notes.append(f"'{' '.join(thing)} of' was left out: the {where.words} as a whole is taken.")
            return where, []
        return Named(Modality.OBJECT, " ".join(thing)), [where]


def _refuse_words_of_no_name(spoken: list[str]) -> None:
    """Refuse what is no name, such as "the place" or "chair over": it would be sought on the map as it stands."""
    words = " ".join(spoken).lower().replace("first aid", "aid").split()
    known = ("someone", "somebody", "something") if _is_sound(spoken) else ()
    odd = next(
        (
            word
            for word in words
            if (word in _NEVER_NAMED and word not in known) or re.fullmatch(r"\w+['’](?:re|ve|ll|d|m)", word)
        ),
        None,
    )
    aside = "side of" in " ".join(words) or all(word in _NO_THINGS or word == "and" for word in words)
    if odd is None and not aside and (len(words) > 1 or words[0] not in _POINTED_AT):
        return
    raise LanguageError(
        f"{' '.join(spoken)!r} is not understood as the name of a thing; say it like: the chair near the sound of "
        "glass breaking."
    )


def is_token(node: Any, *types: str) -> bool:
    """Return whether a child of a tree is a token of one of these types."""
    return getattr(node, "type", None) in types


def is_rule(node: Any, *names: str) -> bool:
    """Return whether a child of a tree is a rule of one of these names."""
    return getattr(node, "data", None) in names


def _words(node: Any) -> Iterator[Any]:
    for child in node.children:
        if (
            is_token(child, "WORD", "AND", "AND_JOIN", "OF", "ON")
            or (is_token(child, "ARTICLE") and "phrase" in node.data)
            or (is_token(child, "ARTICLE") and "noise" in node.data)
        ):
            yield child
        elif hasattr(child, "data"):
            yield from _words(child)


def _is_sound(spoken: list[str]) -> bool:
    if not spoken:
        return False
    last = spoken[-1].lower()
    return last in SOUND_NOUNS or bool(_SOUNDING.fullmatch(last))


def _sounding(word: str) -> str:
    """Return the -ing form of a verb that tells of a sound: "barked", "broke"."""
    if word.lower() in PAST_TENSES:
        return PAST_TENSES[word.lower()]
    for form in (_PAST, _PRESENT):
        found = form.fullmatch(word.lower())
        if found:
            return f"{found[1]}{found[2]}ing"
    return word


def _singular(words: str) -> str:
    return words[:-1] if words.endswith("s") and not words.endswith("ss") else words
