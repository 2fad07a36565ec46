"""What a command is rewritten to before it is cut: the same, with fewer ways to say it.

Politeness goes; "the photo x.png was taken" becomes the photo; "and then", "after that", a full stop become one mark.
Each entry is a pattern, matched without regard to case, and what stands instead of it; they apply in their order.
"""

import re
from functools import cache

from avlmaps.language.rules import mentions, remarks, spoken, terse, words

_DETERMINER = words.DETERMINER
_SHOT = (
    r"(?:photo(?:graph)?s?|picture|pic|image|snap(?:shot)?|shot|frame|view|still|selfie|scene|image file|"
    r"screenshot|pictures|images|snapshots)"
)
_TAKEN = (
    r"(?:(?:was|is|has been|were)? ?(?:taken|shot|captured|made|recorded|photographed|snapped|shows?|comes "
    r"from|came from))"
)
_RECORDING = r"(?:sounds?|noises?|recording|audio|clip|snippet|sample|track|file|sound clip|audio clip|audio snippet)"
_HEARD = r"(?:(?:was|were|is|has been|can be|could be) (?:heard|recorded|played)|came from|comes from)"
_SPOT = r"(?:place|spot|location|point|position|area|room|site|viewpoint|pose)"
_I = r"(?:i|you|we|they|it|he|she|someone|the robot)"
_BEGINS_THING = rf"(?:{_DETERMINER}\b|⟦|it\b|them\b)"

_PATH_OF = (
    r"(?:called|named|file|at|in|from|under|stored (?:at|in|under)|taken (?:at|in)|with the (?:file ?)?name|path|"
    r"of|taken|that)"
)
_ABOUT_FILES = [
    (
        rf"(?:(?:{_DETERMINER} )?{_SPOT} )?(?:where )?(?:{_DETERMINER} (?:\w+ )?)?{_SHOT} (?:was|is|were|has been) "
        r"(?:taken|shot|captured|made|snapped)"
        rf"(?: (?:at|from|in|here))?[:,]? ⟦(i\d+)⟧",
        r" ⟦\1⟧",
    ),
    (
        rf"\bwhere {_I} (?:was|were|am|are|stood|is)(?: standing)? when {_I} (?=(?:took|shot|made|snapped|captured))",
        "where i ",
    ),
    (r"\bfind out (?=where|what)", "find "),
    (
        rf"\b(?:{_DETERMINER} )?(?:exact |same |very )?{_SPOT} (?:where|at which|in which|from which|from where)\b|"
        r"\bwherever\b",
        "where",
    ),
    (
        rf"\b(?:{_DETERMINER} )?{_SPOT} (?:that |which )?{_I} (?=(?:took|shot|saw|photographed|captured|heard)\b)",
        "where i ",
    ),
    # "where the photo x.png was taken", "the place in this picture: x.png" are the picture itself.
    (
        rf"(?:(?:(?:{_DETERMINER} )?{_SPOT} )?(?:where (?:{_I} )?(?:have |has |had )?(?:took|take|taken|shot|"
        r"snapped|captured|made|see|saw|"
        r"photographed)?(?: in| on| at)? ?|(?:that (?:is |you see |i see )?)?(?:shown|seen|pictured|depicted|"
        r"photographed|captured|visible) (?:in|on|by|at) )|"
        rf"(?:{_DETERMINER} )?{_SPOT} (?:in|of|on|from) )?(?:{_DETERMINER} (?:\w+ )?)?{_SHOT}(?: {_PATH_OF})*:? "
        rf"⟦(i\d+)⟧(?: {_TAKEN})?"
        r"(?: (?:at|from|in)\b(?= ?[,.;!?]|$))?",
        r" ⟦\1⟧",
    ),
    (
        rf"(?:{_DETERMINER} )?(?:same )?{_SPOT} (?:(?:that is |which is )?(?:shown|seen|pictured|depicted|"
        r"photographed|captured|visible|as) )?"
        rf"(?:in |of |on |by |at |from |as )?⟦(i\d+)⟧",
        r" ⟦\1⟧",
    ),
    (
        rf"(?:(?:{_DETERMINER} )?{_SPOT} )?where (?:(?:{_I} )(?:took|take|shot|snapped|captured|made|photographed|saw|"
        rf"see)(?: in| on)? )?⟦(i\d+)⟧(?: {_TAKEN})?",
        r" "
        r"⟦\1⟧",
    ),
    (
        rf"(?:(?:{_DETERMINER} )?{_SPOT} )?(?:where (?:{_I} )?(?:could |can |have |had )?(?:heard|hear|recorded)? ?)?"
        rf"(?:something (?:like|similar to) |what you hear in )?(?:{_DETERMINER} (?:\w+ )?)?{_RECORDING}(?: "
        r"(?:called|named|file|clip|"
        rf"recording|of|in|like|from|at|as in|under|similar to|on|recorded in|heard in|{_DETERMINER}|"
        rf"{_RECORDING}))*:? ⟦(c\d+)⟧(?: {_HEARD})?",
        r" ⟦\1⟧",
    ),
    (
        rf"(?:(?:{_DETERMINER} )?{_SPOT} )?where (?:{_I} (?:could |can |have )?(?:heard?|recorded) )?(?:something "
        rf"like )?⟦(c\d+)⟧(?: {_HEARD})?",
        r" ⟦\1⟧",
    ),
    (rf"{_DETERMINER} ⟦", "⟦"),
    # "stand where x.png was taken" has lost the word that led there.
    (rf"\b({words.GO})\s+(?=⟦[ic]\d)", r"\1 to "),
]

_ABOUT_PLACES = [
    (r"\btake (?:up )?(?:a|your) (?:position|place|spot|stand)\b", "stand"),
    (r"\b(?:pay|give) ([^,;.]+?) a (?:quick |short )?visit\b", r"visit \1"),
    (
        r"\b(?:do|make|drive|run|walk|complete) (\w+) (?:full )?(?:laps?|rounds?|circles?|loops?|tours?) "
        r"(?:a?round|of) ([^,;.]+)",
        r"circle \2 \1 times",
    ),
    (
        rf"\b((?:{words.TURN})(?: (?:to the )?(?:left|right))?(?: by)? (?:\d+|{words.SPELLED}))(?= (?:to (?:the|"
        r"your) )?(?:left|right)\b|"
        r"\s*[,;.]|\s*$)",
        r"\1 degrees",
    ),
    (r"\bin the (?:general )?direction of\b", "towards"),
    (r"\b(?:is|would be|'s) (?:a|the) (?:\w+ )?(?:place|spot|position) (?:to|for|where)\b[^,.;!?]*", " ; stop there"),
    (r"\bsearch (the [\w ]+?) for ([^,;.]+)", r"find \2 in \1"),
    (r"\breverse (?:your )?direction\b|\bturn tail\b", "turn around"),
    (
        r"\b(?:the )?(?:thing|object|one|device|item) (?:that|which)(?: is| was|'s) (?:making|producing|emitting|"
        r"giving off) (?=the|an?\b)",
        "",
    ),
    (rf"\b(?:{_DETERMINER}|some|any) (?:\w+ )?{_SPOT} (?=to the (?:left|right|north|south|east|west))", ""),
    (
        r"^it(?:'s| is| must be) (.+?),? (?:that |where |which )?(?:i (?:want|need|would like|'d like) you|you "
        r"(?:should|must|need to|have to|are to))\b"
        r"[^,.;!?]*",
        r"go to \1",
    ),
    (
        r"\b(?:each|all|every one|both|every) of (?:the following|these|those)(?: \w+)?:?|\bthe following (?:places|"
        r"things|objects|spots|locations):?",
        " ",
    ),
    (r"\bwhatever (?:made|makes|was making|is making|produced|caused)\b|\bwhat(?:ever)? sounded like\b", " "),
    (
        r"(?:^|(?<=[;.]))\s*((?:in|near|by|next to|beside|on|inside) [^,;.]*?),? (?:there is|there's|you (?:will|"
        r"can) (?:find|see)|you'll (?:find|see)) "
        r"([^,;.]+)",
        r" there is \2 \1",
    ),
    (
        rf"\b(?:{words.MOVE}) (?:to|towards?|closer to) ([^,;.]+?),? (?:until|till) you(?:'re| are) "
        rf"({words.DISTANCE})(?: away)? (?:from|of) it\b",
        r"stop \g<2> from \1",
    ),
    (rf"\band back(?: again)?(?=,? {words.COUNT}\b)", " ⟦shuttle⟧"),
    (r"(?:^|(?<=[;.,])) ?off (?:you go )?(?=to\b|with you to\b)", " go "),
    (r"(?<=\w) with you(?= ?[,.;!?]|$)", ""),
    (
        r",?\s*\b(?:that|this|it|there|which)?(?:'s| is| would be| will be) (?:exactly |precisely |just )?(?:where|"
        r"the (?:place|spot|position|"
        r"location)(?: where| that)?|your (?:next |first |last |final )?(?:goal|destination|target|stop))\b(?: "
        r"(?:i|we|you)\b[^,.;!?]*|"
        r" to \w+[^,.;!?]*)?(?=[,.;!?]|$)",
        " ; stop there",
    ),
    (r"\bas follows\b:?|\bthe following:", " "),
    (
        rf"\b(?:to |at |in |into )?(?:{_DETERMINER}|some|any|somewhere|someplace|a) (?:good |free )?{_SPOT}(?: "
        r"that is| which is| that's|"
        r" located| right)? (?=(?:near|next to|beside|by|close|in|inside|on|between|in between|half-?way|midway|"
        r"left|right|north|south|east|"
        rf"west|behind|opposite|{words.DISTANCE})\b)",
        "to ",
    ),
    (
        r"\b(?:the|an?) (?:place|spot|location|position|origin|source|direction|whereabouts) of (?=the|an?\b|this|"
        r"that|my|your)",
        "",
    ),
    (r"\bthe (?:origin|source) of (?=sound|noise)", "the "),
    (
        r"\b(?:that|which|who)(?:'s| is| are| was| were| stands?| sits?| lies| hangs| lives)(?: (?:located|"
        r"standing|situated|placed|sitting|found|"
        r"right|just))*(?= (?:near|next|beside|by|close|in|inside|on|at|under|behind|in front|opposite|against|to "
        r"the|where)\b)",
        "",
    ),
    (
        r"(?<=\w) (?:located|situated|standing|placed)(?= (?:near|next to|beside|by|close to|in|inside|on|at|under|"
        r"against|behind)\b)",
        "",
    ),
    (r"\b(?:nearest|closest) ([\w-]+(?: [\w-]+)?) to (?=(?:the|my|a)\b)", r"\1 near "),
    (r"\b(?:that|which) (?:has|have|contains?|holds?)\b", "with"),
    (r"\b(with (?:the|an?) [\w ]+?) on (?:it|top of it|top)\b", r"\1"),
    (
        r"\b(?:in|inside|around|of|somewhere in) (?:the|this|our) (?:environment|scene|map|surroundings(?! of)|"
        r"vicinity(?! of)|"
        r"building|apartment|flat|"
        r"world|place)\b|\bin (?:here|there)\b|\baround here\b",
        "",
    ),
]

_SEQUENCE = (
    r"(?:and |but )?(?:then|after (?:that|this|which)|afterwards?|subsequently|thereafter|thereupon|following "
    r"(?:that|this)|"
    r"(?<!the )(?<!very )(?<!your )next(?! to\b| (?:room|door|goal|stop|destination|target|\d|\w+ (?:metres|meters|"
    r"steps)))|finally|lastly|at last|last of all|to finish(?: off)?|"
    r"in the end|at the end(?! of)|secondly|thirdly|fourthly|in the first place|firstly|first of all|first off|to "
    r"(?:begin|start) with|"
    r"followed by|later(?: on)?|from there|at that point|as (?:a|the) (?:first|second|third|next|last|final) step|"
    r"(?:once|when|whenever|as soon as|after) (?:(?:you|it|the robot) (?:(?:are|is|'re|get|arrive|have arrived|"
    r"have|'ve) ?)*(?:there|done|"
    r"finished|arrived|arrive|that|done (?:that|so|this)|completed (?:that|this|it)|here)|there|done|finished|"
    r"that(?: is|'s) (?:done|finished|over)|arriving)"
    r"(?: there| with that)?|(?:up)?on (?:your )?arrival|having done (?:that|so|this)|that done|whereupon|thence|"
    r"and after|and last|"
    r"and lastly|eventually|ultimately|at the very end)"
)
_REACH = (
    r"(?:(?:you|it|the robot)\b ?)?(?:(?:have|has|'ve|are|is|'re|having) ?)?(?:reach(?:ed|ing|es)?|get(?:s|ting)? "
    r"(?:to|near)|got(?:ten)? "
    r"(?:to|near)|arriv(?:e|es|ed|ing) (?:at|in|to|by|near)|come to|been to|visited|visiting|made it to|standing "
    r"(?:at|in|by|near|next to)|"
    r"(?:are|is|'re) (?:at|in|inside|near|next to|beside|by|close to)|at|in front of|inside|in|by|near|next to|"
    r"beside|done with|"
    r"finished with|through with)"
)
_UNTIL = r"(?:until|till|'til|til)"

_ABOUT_ORDER = [
    (
        r",?\s*\bbut first\b,?|[,;.]?\s*\b(?:but )?(?:before (?:that|this|doing (?:so|that))|prior to (?:that|this)|"
        r"beforehand)\b,?",
        " ; ⟦after⟧ ",
    ),
    (r"(?:^|(?<=[;.]))\s*on (?:your|the) way to\b", " ; ⟦before⟧ go to"),
    (r",?\s*\b(?:while |when )?on (?:your|the) way to\b", " ; go to"),
    (
        rf"\b(?:do|repeat|perform|execute)(?: (?:the following|this|these)(?: \w+)?)?,? ({words.COUNT})\s*[:;]",
        r"; ⟦foll"
        r"owing⟧ \1 ;",
    ),
    (rf"\b(?:for )?({words.COUNT})\s*:", r"; ⟦following⟧ \1 ;"),
    (
        r"\bback and forth\b|\bto and fro\b|\bforth and back\b|\bbackwards? and forwards?\b|\bforwards? and "
        r"backwards?\b",
        "⟦shuttle⟧",
    ),
    (r"(?:destination|goal|target):", "go to "),
    (r":", ","),
    (rf"(?<=\w) \d+[.)]\s+(?=(?:{words.MOVE}|{words.TURN}|{words.FACE})\b)", "; "),
    (rf"(^|[,;.])\s*({words.COUNT})\s*,\s*", r"\1 \2 "),
    (r"(?<!\d)[.!?]+(?=\s|$)|[!?]+|(?<=\d)\.(?=\s|$)", ";"),
    (r"(?<!the )(?<!your )(?<!very )(?<!our )\bfirst\b,?(?! (?:goal|stop|destination|target|room|door|floor))", " "),
    (rf"(?:^|[,;]|\band\b|\bor\b)?\s*\b{_SEQUENCE}\b\s*,?", " ; "),
    (
        rf"\b(?:{words.MOVE})(?: (?:straight|forwards?|ahead|on|along))* {_UNTIL} (?:you|it)(?:'re| are| is)(?: "
        r"standing| positioned)? (?=between|in between|"
        rf"halfway|to the (?:left|right)|left|right|behind|north|south|east|west|{words.DISTANCE})",
        "stop ",
    ),
    (rf"\b(?:{words.MOVE})(?: (?:straight|forwards?|ahead|on|along))* {_UNTIL} {_REACH}\b", "go to"),
    (rf"\b(?:stop|halt|stand still|pause)(?: moving| there| only)? (?:when|once|as soon as) {_REACH}\b", "go to"),
    (
        r"(?:(?<=;)|^|,|\band\b)\s*(?:once|when|whenever|as soon as|after|upon|on|having|now that) (?:(?:you|it|"
        r"the robot)(?: are| is|'re) (?=between|in "
        r"between|to the|left|right|behind|half))",
        " ; ⟦arrival⟧ go ",
    ),
    (
        rf"(?:(?<=;)|^|,|\band\b)\s*(?:once|when|whenever|as soon as|upon|having|now that) {_REACH}\b",
        " ; ⟦arrival⟧ go to",
    ),
    (rf"(?:(?<=;)|^)\s*(?:after|on) {_REACH}\b", " ; ⟦arrival⟧ go to"),
    (r"(?:(?<=;)|^)\s*after (?:you(?:'ve| have)? |having )?", " ; "),
    (r"(?:(?<=;)|^)\s*before (?:you |then |finally )?", " ; ⟦before⟧ "),
    (
        r"(?<!metres)(?<!meters)(?<!metre)(?<!meter)(?<!steps)(?<!feet)(?<!\dm)(?<! m)(?<!cm)(?:,\s*| )\bbefore "
        r"(?:you |then |finally )?(?=\w)",
        " ; ",
    ),
    (rf",?\s*\b(?:but )?(?:only )?after (?:{_REACH}\b|you(?:'ve| have)? |having )?", " ; ⟦after⟧ "),
]

_BEGINS_ACTION = (
    rf"(?:{words.RETURN}|{words.FACE}|{words.TURN}|{words.MOVE}|{words.BACK_UP}|(?:make|take|do|perform|hang) "
    r"(?:an?|one|two|three|\d+)\b|"
    r"circle|orbit|patrol|monitor|inspect|observe|examine|repeat|do (?:that|this|it|so)|back(?= (?:to|again)\b|"
    r"\s*(?:[,;]|$))|"
    rf"reverse|to (?={_BEGINS_THING}|where\b|the\b|your start|start)|between|in between|in the middle|half-?way|"
    r"(?:to|on|at) (?:the|its|your) "
    rf"(?:left|right|north|south|east|west)|with (?={_BEGINS_THING})(?=[^;]*\b(?:on|to|at) (?:your|its|the) "
    r"(?:left|right)|[^;]*(?:behind|front of) "
    rf"(?:you|yourself))|(?:so|such) that|let|{words.DISTANCE} (?:forwards?|ahead|back|left|right|to (?:the|your) "
    r"(?:left|right)|north|south|east|west)|"
    rf"keep(?:ing)?|have (?=.* (?:on|to) your)|put(?:ting)? (?=.* (?:on|to) "
    r"your)|so (?:you|the)|"
    rf"(?:making|make) sure|ensuring|(?:{words.MANIPULATE})(?= (?:{_DETERMINER}|up|it|me)\b)|{words.NEGATIONS})"
)

_ABOUT_ACTIONS = [
    (
        r"\b(?:go|come|drive|walk|move|head|run)(?: over)?(?: (?:to|and))? (?=(?:see|look at|look for|visit|check|"
        r"find|inspect|have a look at|take a look "
        r"at|stand|stop|wait|park|position|place|sit|stay|face|get)\b)",
        "",
    ),
    (
        rf"\b(?:{words.TURN}|move|stand|position yourself|orient yourself)(?: (?:left|right|around|round))? "
        rf"(?:{_UNTIL}|so that|such that|so|to have|"
        r"in such a way that) (?:(?:you|it|the robot)\b ?)?(?:(?:are|is|'re|can|end up) )?(?:directly )?(?:face|"
        r"facing|see|looking (?:at|to|towards?)|look at|"
        rf"have (?=[^;]* (?:ahead|in front)))\b",
        "; face",
    ),
    (
        r"\b(?:so that|such that|so|in order to|so as to|in such a way that) (?:(?:you|it|the robot|your \w+)(?: "
        r"are|'re| is)? )?(?:directly )?"
        r"(?:face|faces|facing|see|look(?:ing)? at|looking (?:to|towards?))\b",
        "; face",
    ),
    (
        rf"\b(?:{words.TURN}|move|stand|position yourself|orient yourself|stop|park)(?: (?:left|right|around|"
        rf"round))? (?:{_UNTIL}|so that|such that|so|in such a way that)\b",
        "; so that",
    ),
    (r"\b(?:turn|move|rotate) to have\b", "; have"),
    (
        r"(?<!^)(?<!; )\b(?:so that|such that|in such a way that|so)(?= (?:the|an?|it|you have|my|your|this)\b)",
        "; so that",
    ),
    (
        rf",? (?=with (?={_BEGINS_THING})[^;,]*?\b(?:(?:on|to|at) (?:your|its|the) (?:left|right)|behind (?:you|"
        r"yourself)|in front of (?:you|yourself)))",
        " ; ",
    ),
    (
        rf",? (?=(?:keeping|having|leaving) (?={_BEGINS_THING})[^;,]*?\b(?:(?:on|to|at) (?:your|its|the) (?:left|"
        r"right)|behind (?:you|yourself)))",
        " ; ",
    ),
    (
        r",? (?<!; )(?<!be )(?<!to )(?<!are )(?<!is )(?=(?:facing|looking (?:at|towards?|to|north|south|east|"
        r"west))\b)",
        " ; ",
    ),
    (r",? (?=with your back (?:to|towards|against))", " ; "),
    (rf",?\s*\band (?:now |also |please )?(?={_BEGINS_ACTION}(?:\b|$))", " ; "),
    (rf",\s*(?={_BEGINS_ACTION}(?:\b|$))", " ; "),
    (r"(?:(?<=;)|^)\s*(?:see|look for) ", " find "),
    (r"(?:(?<=;)|^)\s*(?:be|are|is) (?=facing\b|looking\b)", " "),
    (r"(?:(?<=;)|^)\s*back(?: again)?\s*(?=;|$)", " return"),
    (r"(?:(?<=;)|^)\s*back (?=to\b)", " return "),
]

# "and in the kitchen" goes on telling where the thing is.
_ABOUT_ENDS = [
    (r"(\b(?:between|middle of|mid-?point of) [^;]*?)\band (?=where\b)", r"\1⟦and⟧ "),
    (rf"((?:near|next to|by|beside|to) {_DETERMINER} [\w ]+?) there(?=\s*(?:;|$))", r"\1"),
    (r",?\s*\b(?:and|but) (?=(?:near|next to|beside|by|close to|at|around|alongside|in|inside|within|where)\b)", " "),
    (r"(?:(?<=;)|^)\s*(?:and|but|or|so|also|again)\b,?(?! )", " "),
    (r"(?:(?<=;)|^)\s*(?:and|but)\s+", " "),
    (r"\s+(?:and|,)+\s*(?=;|$)", " "),
    (r"\s+(?:then|too|as well|though|instead of that|once more please|again(?= ?[;,]))\s*(?=;|$)", " "),
]


@cache
def _all() -> tuple[tuple[re.Pattern[str], str], ...]:
    fillers = [(filler, " ") for filler in words.FILLERS]
    tidy = [(r"\s+", " "), (r"\s+(?=[,;])", ""), (r"^[\s,]+", ""), (r";[\s,]+", "; ")]
    listed = [(r"\s+", " "), *terse.PATTERNS, *remarks.BEFORE, *mentions.PATTERNS, *spoken.PATTERNS, *remarks.AFTER]
    listed += [*tidy, *_ABOUT_FILES, *_ABOUT_PLACES, *fillers, *tidy]
    listed += [*_ABOUT_ORDER, *fillers, *_ABOUT_ACTIONS, *_ABOUT_ENDS, *tidy]
    return tuple((re.compile(pattern, re.IGNORECASE), instead) for pattern, instead in listed)


def rewritten(text: str) -> str:
    """Return a command in fewer words, `;` between its clauses."""
    text = _without_ahead(text)
    for pattern, instead in _all():
        text = pattern.sub(instead, text)
    return text


def _without_ahead(text: str) -> str:
    """Return a text with a mark for "the table in front of you", which is not "with the table in front of you"."""
    wanted = r"\b(?:with|keep(?:ing)?|have|having|so|such|until|till)\b[^,.;!?]*?"
    ahead = r"(?:(?:that|which) is )?(?:directly |right )?(?:in front|ahead) of (?:you|the robot|yourself)\b"
    return re.sub(rf"({wanted}{ahead})|{ahead}", lambda found: found[1] or "⟦ahead⟧", text, flags=re.IGNORECASE)
