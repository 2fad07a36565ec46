"""Whether what is said is a statement throughout: each part between its commas and its "and" tells, none orders.

"I am tired" may be left out, or say what "it" means; "I am tired, sing a song" may not: who gave that order would see
the robot go on as if it had been done. An imperative is known by what it lacks, a subject before its verb, and not by
a list of verbs, which would never be whole.
"""

from avlmaps.language.rules import words
from avlmaps.language.rules.bare import is_name_alone
from avlmaps.language.rules.patterns import pattern
from avlmaps.language.rules.remarks import PERSON
from avlmaps.language.rules.sounds import PAST_TENSES

_DETERMINER = rf"(?:{words.DETERMINER}|some|any|no|every|each|one|both|all|these|those)"
_LINKS = (
    r"(?:(?:and|but|so|or|because|since|as|while|for|oh|well|now|hey|hi|hello|listen|look|ok|okay|okay|you know|"
    r"that|then|i think|i guess|i believe|i know|apparently|it seems|maybe|perhaps|probably|sorry|sadly|luckily|"
    r"unfortunately|finally|today|tonight|yesterday|earlier|just now|just|also|if|when|once|whenever|yes|no)\b,? ?)*"
)
_BEING = (
    r"(?:is|are|was|were|am|has|have|had|will|would|can|can't|cannot|could|couldn't|may|might|must|should|does|did|do|"
    r"don't|didn't|doesn't|isn't|aren't|wasn't|won't|looks?|seems?|feels?|smells?|tastes?|sounds?|sounded|needs?|"
    r"wants?|"
    r"likes?|loves?|hates?|got|gets?|goes|hurts?|aches?|stinks?|leaks?|waits?|sleeps?|works?|stands?|sits?|lies|hangs?|"
    r"lives?|keeps?|kept|starts?|shows?|says?|said|makes?|made|comes?|took|saw|broke|fell|began|came|left|went|felt|"
    r"sat|"
    r"stood|lost|forgot|put|gave|sent|told|thought|found|brought|bought|let|(?:ex|sh)pired)"
)
# Words that end as a past tense or an -ing form does, but are verbs of an order: "feed him", "sing a song".
_PAST = (
    r"(?!(?:\w*eed|shed|shred|bed|wed|embed|sled|red)\b)(?:\w+ed|"
    + "|".join(PAST_TENSES)
    + r"|went|gone|came|saw|heard|felt|got)"
)
_GERUND = r"(?!(?:br|s|r|sw|fl|st|k|th|w|cl|sl|spr|str|wr)ing\b)\w+ing"
_FINITE = rf"(?:{_BEING}|{_PAST})\b"
_OWN = (
    r"(?:i|we|he|she|they|it|this|that|there|these|those|here|everyone|everybody|somebody|someone|everything|"
    r"something|nobody|nothing|who|which|what)"
)
_NOUNS = rf"(?:(?!(?:{words.DETERMINER})\b)[\w'-]+ )"
_PREPOSITION = (
    r"(?:in|inside|on|at|by|near|next to|beside|under|behind|with|without|from|of|for|to|into|onto|over|above|below|"
    r"against|between|after|before|during|like|about|around)"
)
_FILE = r"(?:⟦[ic]\d+⟧)"
_FILE_WORDS = (
    r"(?:query|image|photo(?:graph)?|picture|snapshot|sound|clip|recording|file|audio|goal|target|scene|place|this|"
    r"that|the|here|is|my|a|an|of|in)"
)
_STATEMENTS = (
    rf"{_OWN}(?:'\w+)?\b(?! (?:to)\b).*",
    rf"(?:{_DETERMINER}|{PERSON}'s?|my|our) .*",
    rf"{PERSON}(?:'\w+)?\b.*",
    # "Dinner is ready", "uncle Bob has come": no more words before the verb, or they could be an order themselves.
    rf"(?!(?:{words.MANIPULATE}|check|see|tell|ask|say|make|ensure|watch|remember|ring|bring|sing|play|open|close)\b)"
    rf"{_NOUNS}{{0,1}}[\w'-]+(?:'s|'re| {_FINITE}).*",
    # Of the robot, only what it has done or will find: all else would be for it to do.
    r"you(?:'ve|'re|'ll)? ?(?:have |had |were |are |was |will |can |could |should |must |might |may |just |already )*"
    r"(?:heard|hear|hearing|recorded|been|find|found|see|saw|seen|know|remember|passed|noticed|visited|took|going)\b.*",
    r"(?:did|do|does|have|has|had|can|could) (?:you|we|i|he|she|they)(?: ever| still| also)? (?:hear|heard|see|seen|"
    r"know|remember|recogni[sz]e|notice|find|recall|smell|feel|been)\b.*",
    r"(?:is|are|was|were|does|did|has|where|how|why|whose|when)\b(?!'s about| about| if).*",
    r"(?:hear|heard|hearing|remember)\b.*",
    # What goes on a statement: another thing, where it is, what it did.
    rf"{_PREPOSITION} .*",
    rf"(?:{_PAST}|{_GERUND}|(?:is|was|are|were|has|had|can't|cannot|could|would|will|needs|wants|likes|looks|seems))"
    rf"\b.*",
    rf"(?:(?:listen|look) (?:to|at) )?(?:{_FILE_WORDS} )*{_FILE}(?: .*)?",
    r"(?:shouldn't|aren't|weren't|isn't|don't|didn't|haven't|hasn't) (?:you|we|i|he|she|they|it|that|the)\b.*",
    r"(?:my |dear |little |old |sweet )*(?:robot|friend|buddy|darling|honey|sweetheart|sir|madam|mate|pal|everyone|"
    r"all)",
    r"(?:sorry|thanks|thank you|please|oh well|well|oh|hello|hi|hey|okay|ok|listen|quick(?:ly)?|great|good \w+|"
    r"unfortunately|too|somewhere|maybe|probably|i think|here|there|outside|upstairs|downstairs|again)",
)
_STATEMENT = "|".join(_STATEMENTS)
# A wish of the speaker's for what the robot should do is an order, whatever its subject.
_WISH = (
    r"\b(?:want|need|like|love|ask|tell|told|order|expect|beg|wish|prefer|have|has|had|require|hope|it is time|time)"
    r"\w* "
    r"(?:for )?(?:you|the robot|yourself) (?:to|would|will|could|can)\b|"
    r"\b(?:you|the robot) (?:must|should|shall|ought|have to|need to|has to|are to|may|might|can|could|will|would|"
    r"'ll)\b"
    r"(?! (?:hear|see|find|know|remember|recogni[sz]e|notice|imagine|be|have)\b)"
)
_CONDITION = (
    r"\b(?:if|unless|whenever|until|in case|in the event)\b(?! (?:you|we|i)(?:'ve| have| had|)(?: just| ever)? hear)|"
    r"^(?:and )?(?:when|once|as soon as) (?!(?:you|we|i)(?:'ve| have| had|)(?: just)? hear)"
)
_PARTS = r"\s*[,.!?;:]+\s*|\s+(?:and then|and|but|then|(?:and )?so(?! that\b)|therefore)(?=\s)\s*"


def all_told(said: str) -> bool:
    """Return whether every part of what is said is a statement, or goes on one."""
    if pattern(_WISH).search(said) or pattern(_CONDITION).search(said):
        return False
    parts = [part for part in pattern(_PARTS).split(said) if pattern(r"\w").search(part)]
    return all(_is_told(part) for part in parts)


def _is_told(part: str) -> bool:
    said = pattern(rf"^{_LINKS}").sub("", part.strip())
    return not said or is_name_alone(said) or pattern(rf"(?:{_STATEMENT})$").match(said) is not None
