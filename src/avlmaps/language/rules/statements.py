"""What a statement names for an order after it: the thing of "it", the place of "there", the sound that was heard.

A statement has one thing that a later "it" can mean. It is found by its form, not by its verb: a file if there is one;
what was heard; where people are; the first thing with an article, with the places that follow it.
"""

import re
from dataclasses import dataclass

from avlmaps.language.rules import patterns, words
from avlmaps.language.rules.remarks import PERSON, SOUNDED, SOUNDING
from avlmaps.language.rules.sounds import PAST_TENSES, SOUND_VERBS

_DETERMINER = rf"(?:{words.DETERMINER}|some|any)"
_PREPOSITION = (
    r"(?:near|next to|beside|by|close to|in front of|in|inside|on top of|on|at|under|underneath|behind|against|"
    r"above|over|"
    r"below|from|out in|out on|up in|down in|into|onto|where)"
)
_WORD = (
    rf"(?!(?:{_PREPOSITION}|is|are|was|were|be|has|have|had|that|which|who|and|or|so|to|for|with|of|it|them|him|her|"
    r"needs?|wants?|i|you|we|they|he|she|again|somewhere|there|here|today|yesterday|lately|now|please|very|too|well|"
    r"but|"
    r"because|when|while|must|might|should|could|would|will|can|may)\b)[\w'-]+"
)
_NAME = rf"{_WORD}(?: of (?:{_DETERMINER} )?{_WORD}| {_WORD}){{0,4}}"
_THING = rf"{_DETERMINER} {_NAME}"
_ADVERB = (
    r"(?:(?:still|now|just|also|all|already|right|over|up|down|out|back|somewhere|located|standing|sitting|lying|"
    r"hanging|"
    r"waiting|placed|probably|there|here|again|together|that is|that's|which is|that are|who is|who are|i think|"
    r"outside) )*"
)
_PLACES = rf"(?: {_ADVERB}{_PREPOSITION} (?:{_THING}|⟦[ic]\d+⟧|{_WORD}(?: {_WORD})?))+"
_PEOPLE = (
    rf"(?:(?:{PERSON}|i|we|you|everybody|everyone|people)(?: (?:all|both))?|(?:{words.DETERMINER}) "
    rf"(?:[\w-]+ )?(?:parents|"
    r"family|party|meeting|concert|show|game|match|dinner|lunch|fun|action|music lesson|baby|twins|crew|class|others|"
    r"ladies|gentlemen|movers|plumber|electrician|postman|technician|president|king|queen|nephew|niece|"
    r"grandson|granddaughter|grandparents|grandkids|grandchildren)|party|dinner|lunch)"
)
_BEING = (
    r"(?:'s|'re|'m| is| are| am| was| were| will be|'ll be| must be| might be| should be| may be| could be| stands?|"
    r" sits?|"
    r" lies| hangs?| lives?| waits?| waited| stood| sat| needs? (?:help|you|me|us)| is needed| takes place| happens)"
)
_GOING_ON = r"(?: (?:all|both|just|still|now|already|currently))*(?: [a-z]+ing(?: [a-z]+)?| here| needed| busy| stuck)?"
_BACK = re.compile(
    r"\b(?:it|its|it's|them|there|him|her|me|us|one|they|he|she)\b|\b(?:that|this|those|these|the same|the matching) ?"
    r"(?:\w+)?|\bwhere(?:ver)?\b|\b(?:the|its) (?:\w+ )?(?:place|spot|location|position|source|origin|sound|noise|room|"
    r"viewpoint|scene)\b|\b(?:join|meet) |^(?:please )?(?:go|come|drive|run|hurry|come over|come here|go now)$",
    re.IGNORECASE,
)
# Words that only point back at a sound or a picture: "the place where that was taken", "where you heard it".
_POINTING = (
    r"(?:the|that|this|those|these|its|it|exact|very|same|matching|corresponding|right|place|spot|location|position|"
    r"room|"
    r"scene|viewpoint|area|point|source|origin|direction|where|wherever|which|at|in|from|on|of|to|was|is|were|are|"
    r"had|has|"
    r"have|been|being|taken|shot|made|recorded|heard|hear|hearing|i|you|he|she|they|we|me|someone|somebody|who|"
    r"photographer|camera|stood|standing|stand|when|took|take|saw|see|seen|sees|shows|shown|shows|depicted|depicts|"
    r"pictured|photographed|captured|picture|photo|photograph|image|snapshot|shot|file|sound|noise|recording|clip|"
    r"audio|"
    r"came|coming|comes|come|happened|happens|happening|occurred|can|could|last|just|that's|it's|something|like|"
    r"went|off|loudest|originated|racket|commotion|displayed|matches|looks|look|exactly|there|again)"
)
_AROUND_FILES = re.compile(
    rf"(?P<to>\b(?:back |over |right )*(?:to|into) )?\b(?:the|that|where|wherever|what|whatever|this|my|an?)(?: "
    rf"(?:{_POINTING}|what|whatever|"
    rf"file|called|named|stored|saved|a|an|my)\b)* (?P<file>⟦[ic]\d+⟧)(?: {_POINTING}\b)*(?=\s*(?:$|[.,;!?]| and| "
    rf"then| please))",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Mentioned:
    """What a statement names: as the grammar reads it after `⟦said⟧`, and whether it is a file or a sound."""

    text: str
    kind: str


_HAPPENED = re.compile(rf"(?:someone|somebody|something)(?: \w+)? (?:{SOUNDED}|{SOUNDING}|dropped)\b", re.IGNORECASE)


def refers_back(order: str) -> bool:
    """Return whether an order means what was said before."""
    return _BACK.search(order) is not None


def mentioned(statement: str, order: str) -> Mentioned | None:
    """Return what a statement names for the order after it, or None."""
    said = patterns.sub(
        r"^(?:(?:and|but|so|well|oh|okay|ok|hey|look|listen|hi|hello|now|then|you know|i think|i believe|i guess|i "
        r"know|"
        r"apparently|it seems|i see|because|since|as|robot)(?: that)?\b,? )+(?=\w)",
        "",
        statement.strip(" ,"),
    )
    found = _file(said) or _sound(said, order) or _people(said)
    if found is not None or _HAPPENED.match(said):
        return found
    return _thing(said, order)


def with_reference(order: str, meant: Mentioned | None) -> str:
    """Return an order whose words for what was mentioned are "it"."""
    if meant is None:
        return order
    verb = r"(?:go|come|drive|run|head|move|hurry|please)"
    order = patterns.sub(
        rf"\b({verb})(?: over| up| down| here| right)*,? (?:and |to )?(?:join|see|meet|help|visit|keep|find|get|"
        rf"fetch|greet) "
        r"(?:me|us|him|her|them)(?: there| here| company)?(?=\s*(?:$|[,;]| and| then))",
        "go to it",
        order,
    )
    order = patterns.sub(
        r"\b(?:join|meet) (?:me|us|him|her|them)(?: there| here)?(?=\s*(?:$|[,;]| and| then))", "go to it", order
    )
    order = patterns.sub(r"\b(?:to|at|by|near|next to) (?:me|us|him|her|them|that one|this one)\b", "to it", order)
    order = patterns.sub(rf"^(?:please )?({verb})(?: over| here| on over| now| quick(?:ly)?)*$", "go to it", order)
    if meant.kind == "thing":
        order = patterns.sub(
            r"\b(?:to )?(?:where (?:it|that|this|they) (?:is|was|are|were)|that (?:place|spot|location|thing)|its "
            r"(?:place|location|spot))(?=\s*(?:$|[,;]| and| then))",
            "to it",
            order,
        )
        return order
    order = patterns.sub(
        rf"\b(?:(?:go|drive|come|run|head)(?: over| there| back)*(?:,? and| to)? )?(?:see|look|check|find out|find|"
        rf"show me|"
        rf"discover|locate)(?: out| for)? (?:where|what|who|wherever)(?: {_POINTING}\b)*(?=\s*(?:$|[,;]| and| then))",
        "go to it",
        order,
    )
    own = "|".join(re.escape(word) for word in re.findall(r"[\w'-]{3,}", meant.text) if word not in ("and", "near"))
    pointing = rf"(?:{_POINTING}|{own}|{SOUNDED}|{SOUNDING}|{'|'.join(SOUND_VERBS)})" if own else _POINTING
    reference = re.compile(
        rf"\b(?:(?:back |over |right )*(?:to|at|towards?|into|near) )?(?:(?:the|that|this|its|wherever|where)\b)"
        rf"(?: {pointing}\b)*(?=\s*(?:$|[,;]| and| then| please))",
        re.IGNORECASE,
    )
    return reference.sub(lambda found: "to it" if not _faces(order[: found.start()]) else "it", order)


def with_files_alone(text: str) -> str:
    """Return a text where "the place where you see what is in x.png" is x.png."""
    return _AROUND_FILES.sub(lambda found: ("to " if found["to"] else "") + found["file"], text)


def _faces(before: str) -> bool:
    return patterns.search(rf"\b(?:{words.VISIT}|{words.FACE}|find|face|approach)\s*$", before) is not None


def _file(said: str) -> Mentioned | None:
    files = re.findall(r"⟦[ic]\d+⟧", said)
    if len(files) != 1 or patterns.search(r"\b(?:near|next to|beside|by|close to) [^⟦]*⟦", said):
        return None
    return Mentioned(files[0], "file")


def _sound(said: str, order: str) -> Mentioned | None:
    heard = patterns.search(r"\b(?:hear|heard|sound|noise|came from|coming from|come from)\b", order)
    who = rf"(?:{PERSON}|i|you|we)"
    adverb = r"(?: (?:just|also|once|still|again|really|clearly|suddenly|only))*"
    found = patterns.match(
        rf"(?:(?:in|at|near) [^,]*, )?(?:if |when |once |did |do |can |have )?(?:{who}(?:'ve| have| had| can| "
        rf"could)?{adverb} )?"
        r"(?:hear|heard|hearing|recorded|noticed|listened to|detected|catch|caught) (?:(?:the )?(?:sounds?|noises?) "
        r"of )?"
        r"((?!that$|it$|me$)[\w⟦].*)$",
        said,
    )
    if found and "⟦" not in found[1]:
        return Mentioned(f"where you heard {_trimmed(found[1])}", "sound")
    found = patterns.match(
        rf"(?:there (?:was|is|were|has been)|it (?:was|sounded like)|something like) ({_DETERMINER} )?([\w' -]+)$", said
    )
    if found and heard:
        return Mentioned(f"where you heard {_trimmed(found[2])}", "sound")
    found = patterns.match(
        rf"(?:{_THING}|\w+) (?:was|is|has been|were|are|keeps|kept|started|made|makes)(?: making)? (?:a|an|the|some) "
        rf"(?:(?:strange|weird|loud|funny|odd|awful|terrible|horrible|soft|quiet) )*([\w -]+?) (?:noises?|sounds?)$",
        said,
    )
    if found:
        return Mentioned(f"where you heard {found[1]}", "sound")
    found = patterns.search(rf"\b(?:and|,|then) (?:{who}) heard ({_DETERMINER} )?([\w' -]+)$", said)
    if found:
        return Mentioned(f"where you heard {_trimmed(found[2])}", "sound")
    return _event(said, told=heard is not None)


def _event(said: str, *, told: bool) -> Mentioned | None:
    """Return the sound of what happened: "someone flushed the toilet", if the order says that it was heard."""
    subject = rf"(?P<who>{_THING}|{PERSON}|something|somebody|someone|[a-z]+)"
    adverb = r"(?: (?:just|was|were|is|has|have|had|been|keeps?|kept|started|suddenly|again|loudly|then|also))*"
    rest = r"(?P<what>(?: (?!and\b|but\b)[\w'-]+)*?)(?: (?:somewhere|again|loudly|earlier|just now|outside|inside))*"
    found = patterns.match(
        rf"{subject}{adverb} (?P<verb>{SOUNDED}|{SOUNDING}|dropp(?:ed|ing)|went off)\b{rest}"
        r"(?:,? (?:and|but) (?:it|then|i|nobody|no one|you|we|they)\b.*)?$",
        said,
    )
    if found is None or patterns.match(r"(?:there|it|that|this|which|what|where)\b", said):
        return None
    verb, what = found["verb"].lower(), found["what"].strip()
    things = patterns.fullmatch(rf"{_DETERMINER} ([\w' -]+)", what)
    going_on = patterns.fullmatch(SOUNDING, verb) is not None
    if what and not told and not going_on and (things or not patterns.match(rf"{_PREPOSITION}\b", what)):
        return None
    who = patterns.sub(rf"^{_DETERMINER} ", "", found["who"])
    where = patterns.search(rf"(?:^| )(?P<where>{_PREPOSITION} (?:{_DETERMINER}) .*)$", what)
    place = f" {where['where']}" if where else ""
    what = what[: where.start()].strip() if where else what
    things = patterns.fullmatch(rf"{_DETERMINER} ([\w' -]+)", what)
    if things and going_on:
        what = things[1]
    elif things:
        who, what = things[1], ""
    ending = verb if patterns.fullmatch(SOUNDING, verb) else _ing(verb)
    tail = f" {what}" if what else ""
    return Mentioned(f"where you heard {who} {ending}{tail}{place}", "sound")


def _ing(verb: str) -> str:
    """Return the -ing form of a past tense."""
    if verb in PAST_TENSES:
        return PAST_TENSES[verb]
    if verb == "dropped":
        return "dropping"
    return patterns.sub(r"e?d$", "", verb) + "ing"


def _people(said: str) -> Mentioned | None:
    """Return where people are: "we are all in the basement"."""
    found = patterns.match(rf"{_PEOPLE}{_BEING}{_GOING_ON}(?P<where>{_PLACES})$", said)
    if found is None:
        return None
    where = patterns.sub(rf"^ {_ADVERB}{_PREPOSITION} ", "", found["where"])
    return Mentioned(_articled(where), "thing")


def _thing(said: str, order: str) -> Mentioned | None:
    """Return the first thing that a statement names, with the places after it."""
    text = patterns.sub(r",", "", said)
    text = patterns.sub(
        rf"^(?:{_PREPOSITION} (?P<where>[^.]*?)),? (?:there(?:'s| is| are| was)|you(?:'ll| will| can)? (?:find|see)|"
        rf"i (?:see|"
        r"have|left|put)|we have|is|are|stands) (?=\w)",
        "",
        text,
    )
    before = patterns.match(
        rf"(?P<where>{_PREPOSITION} .*?),? (?:there(?:'s| is| are| was)|you(?:'ll| will| can)? (?:find|see)|we have|"
        rf"is|are|"
        r"stands) ",
        patterns.sub(r",", "", said),
    )
    which = patterns.match(rf"(?:which|what) ({_NAME}) (?:is|are|stands|sits)({_PLACES})$", text)
    if which:
        return Mentioned(f"the {which[1]}{_plain_places(which[2])}", "thing")
    put = patterns.match(
        rf"(?:i|we|{PERSON}).*\b(?:put|get|take|store|hang|leave|throw|have|look)\b.*\b(?:something|this|these|"
        rf"things|stuff|"
        rf"clothes|it|them|up|away|[a-z]+)(?P<where> (?:in|into|on|onto|from|out of|at) {_THING})$",
        text,
    )
    if put and patterns.search(r"\bthere\b", order) and not patterns.search(r"\b(?:left|lost|forgot|put) ", text):
        where = patterns.sub(rf"^ (?:{_PREPOSITION}|out of) ", "", put["where"])
        return Mentioned(where, "thing")
    subject = patterns.match(rf"(?:{PERSON}|i|we|you)\b", text)
    begin = subject.end() if subject else 0
    found = re.compile(
        rf"(?P<thing>{_THING})(?: (?:is|are|was|were|that|which|must|should|might|may|could|be|has|have|been|"
        rf"stands?|sits?|"
        rf"lies|hangs?)\b(?!'))*(?P<where>{_PLACES})?",
        re.IGNORECASE,
    ).search(text, begin)
    if found is None or patterns.search(r"\b(?:left|right|between|behind)\b", found[0]):
        return None
    where = _plain_places(found["where"] or "")
    if before:
        where += " " + before["where"]
    return Mentioned(_articled(found["thing"]) + where, "thing")


def _plain_places(where: str) -> str:
    return patterns.sub(rf"(?<= ){_ADVERB}(?={_PREPOSITION} )", "", where)


def _articled(name: str) -> str:
    return name if patterns.match(rf"(?:{_DETERMINER}) |⟦", name) else f"the {name}"


def _trimmed(heard: str) -> str:
    """Return a sound without article and without when and where it was: "a cough earlier" is a cough."""
    text = patterns.sub(rf"^{_DETERMINER} ", "", heard)
    text = patterns.sub(
        r",? (?:somewhere|earlier|just now|again|before|yesterday|last night|this morning|(?:a|one|two|some|\d+) "
        r"(?:moments?|minutes?|while|seconds?|hours?) ago)$",
        "",
        text,
    )
    return text
