"""Whether words mean the place where a sound came from, and not where somebody heard it.

One reading for questions and commands: a question is read as a whole, a command round each sound that it names, so that
each of its parts has its own place; so have several sounds of a question that say where a thing is.
"""

import re
from collections.abc import Collection, Sequence
from functools import partial
from itertools import pairwise

from avlmaps.language.lexer import Token
from avlmaps.language.names import past_forms, sounding_thing, sounding_words, sounds_like, third_forms
from avlmaps.language.word_classes import listed, pattern, word_list

_TABLE = "source_words"
_pattern = partial(pattern, _TABLE)
_listed = partial(word_list, _TABLE)


def asks_for_source(text: str, sound: Collection[str] = ()) -> bool:
    """Return whether words mean the place where a sound came from.

    "Where does the barking come from?", "what is making the noise" and "the thing that rings" do; "where you heard the
    barking", "the sound of barking" and "where you came from" do not.

    Args:
        text: the words.
        sound: those among them that name the sound, where they are known.
    """
    text = text.lower()
    if _pattern("origin").search(text):
        return True
    if _pattern("heard").search(text):
        return False
    return _pattern("maker").search(text) is not None or (
        _pattern("sound_of").search(text) is None and _sounds_itself(text, sound)
    )


def _sounds_itself(text: str, sound: Collection[str]) -> bool:
    """Return whether a thing is named by the sound that it makes: "the phone that is ringing", "the beeping device"."""
    if any(sounding_thing(*pair) for pair in pairwise(re.findall(r"[\w-]+", text))):
        return True
    for found in _pattern("itself").finditer(text):
        verb = found[2]
        if verb not in sound if sound else verb in listed("silent"):
            continue
        if found[1] and (sounds_like(verb) or verb in sounding_words()):
            return True
        # "That bark" and "that barking" point at a sound; "that barks" and "that barked" say what a thing does.
        if not found[1] and verb in past_forms() | third_forms():
            return True
    return False


def seeks_source(tokens: Sequence[Token], own: Sequence[int], others: Collection[int] = ()) -> bool:
    """Return whether a command means where the sound came from that it names by some of its words.

    Only the words round the sound count, up to the next step or the next thing that is named, and what refers to it
    behind: "the dog barks, go to where it comes from".

    Args:
        tokens: the command.
        own: the words of the sound.
        others: the words of everything else that the command names.
    """
    if not own or tokens[own[0]].start == tokens[own[0]].end:  # a file that came along stands behind the sentence
        own = [number for number, token in enumerate(tokens) if token.text in _listed("recordings")][:1]
    if not own:
        return False
    breaks = {at for at, token in enumerate(tokens) if token.kind == "punct" or token.text in _listed("breaks")}
    cuts = sorted({-1, len(tokens), *breaks, *others})
    end = min(cut for cut in cuts if cut > max(own))
    clauses = [tokens[max(cut for cut in cuts if cut < min(own)) + 1 : end]]
    until = min((other for other in others if other >= end), default=len(tokens))
    behind = (tokens[first + 1 : last] for first, last in pairwise(cut for cut in cuts if end <= cut <= until))
    clauses += [clause for clause in behind if not _listed("refers").isdisjoint(token.text for token in clause)]
    sound = {tokens[number].text for number in own}
    return any(asks_for_source(" ".join(token.text for token in clause), sound) for clause in clauses)
