"""Many ways to say one motion, each told in one way: to face, to have beside, to circle, a round of stops, once more.

The rules that read a clause know a single wording of each of these, so that they stay few; here all other wordings
become that one. Each entry is a pattern, matched without regard to case, and what stands instead of it. They apply in
their order and before those of `rewriting`, because those cut a text at "and", "so that" and "until", where those
hold one motion together. Amounts with a unit are figures by then (`figures`); a bare count may still be a word.
"""

import re

from avlmaps.language.rules import words

# Where an order begins and where it ends: at a mark, or at the word that leads to the next order.
_BEGINS = r"(?:^|(?<=[.;!?])\s*)"
_BEGINS_OR_COMMA = r"(?:^|(?<=[.;!?,])\s*)"
_MARK = r"(?=\s*(?:[.,;!?]|$))"
_ENDS = r"(?=\s*(?:[.,;!?]|$)|,? (?:and|then|please)\b)"

_TURN = (
    r"(?:turn|rotate|spin|swivel|pivot|move|stand|adjust|position|orient(?:ate)?|align|arrange|place|swing|shift|stop)"
    r"(?: (?:yourself|itself|your (?:body|base)))?(?: (?:left|right|a?round|on the spot|in place|slowly))*"
)
_UNTIL = r"(?:until|till|'til|til|so that|such that|so|in such a way that|in a way that|to where|far enough that)"
_THING = r"((?:the|an?|this|that|my|your|our|his|her|their) [^.,;!?]+?|it)"
_SIDE = (
    r"(?:directly |straight |exactly )?(?:on|to|at|off to) (?:the |your )?(left|right)"
    r"(?:[- ]?hand)?(?: side)?(?: of (?:you|yourself))?"
)
_AHEAD = (
    r"(?:right |directly |straight |just |exactly )?(?:in front|ahead) of (?:you|yourself)|"
    r"(?:straight|right|dead|directly) ahead"
)
_BE = (
    r"(?:(?:is|are|'s|to be|be|being|ends? up|to end up|ending up|comes?|to come|lies?|appears?|stands?|shows up|"
    r"stays?|remains?|located|positioned|will be|should be|has to be|must be) )+"
)
_I_WANT = r"(?:(?:i|we)(?:'d| would)? (?:want|need|like|love|prefer)(?: to have)?)"
_YOU_HAVE = r"(?:(?:you|your camera|it|the robot) (?:have|has|get|got|see|keep|can see) )?"
_HEAD = r"(?:your|the|its) (?:head|camera|body|face|eyes|front|gaze|attention|sensors?|nose|lens)"
_SEE = (
    r"(?:look(?:ing)? (?:straight |directly |right )?(?:at|towards?|to|over at)|fac(?:e|ing)|"
    r"point(?:s|ing)? (?:at|to|towards?)|(?:is |are )?pointed at|see)"
)
# A side to turn to, or the speaker, is no thing that a map holds.
_NO_SIGHT = r"(?!left|right|a?round|back|me\b)"
_FACING = [
    # "turn and look at", "turn your head so that it points at".
    (
        rf"\b(?:turn|rotate|spin|swivel|pivot|swing)(?: (?:yourself|{_HEAD}))?(?: on the spot)?,? "
        r"(?:and|to|until|so that|so|such that|in order to) (?:then )?"
        rf"(?:(?:you|it|that it|the robot|{_HEAD})(?:'re| are| is)? )?{_SEE} {_NO_SIGHT}",
        "face ",
    ),
    (r"\b(?:turn|swing) a?round (?:to|towards) (?=(?:the|an?|my|where)\b)", "face "),
    (rf"\b(?:turn|point|aim|direct|move) {_HEAD} (?:to|towards?|at|on|onto|in the direction of) ", "face "),
    # A direction of the compass is turned to: there is nothing to face.
    (
        rf"\b(?:{_TURN} {_UNTIL}|make (?:it )?(?:so|sure)(?: that)?|make it so(?: that)?) (?:you(?:'re| are)?|it is) "
        r"(?:facing|face|looking|look|pointing|point)(?: to(?:wards)?(?: the)?| due)? "
        rf"(?=(?:{words.COMPASS})\b)",
        "turn ",
    ),
    (rf"\b(?:point|aim|look|turn|orient|face|be) (?:to(?:wards)? )?(?:the )?({words.COMPASS}){_ENDS}", r"turn \1"),
    (rf"\b(?:face|look|turn) (?:in )?(?:to )?the (?:other|opposite) (?:way|direction){_ENDS}", "turn around"),
]
# "turn until", "so that": what follows says where a thing is to be as the robot sees it.
_TURN_SO_THAT = rf"\b(?:(?:{_TURN} |make it so |make sure )(?:{_UNTIL} |that )?|so that |such that )"
_BESIDE = [
    # "turn until the bed is on your left".
    (rf"{_TURN_SO_THAT}{_YOU_HAVE}{_THING} (?:{_BE})?{_SIDE}{_ENDS}", r"; have \1 on your \2"),
    # "turn so that you see the bed straight ahead".
    (rf"{_TURN_SO_THAT}{_YOU_HAVE}{_THING} (?:{_BE})?(?:{_AHEAD}){_ENDS}", r"; face \1"),
    # "I want the bed to be on your left".
    (
        r"(?:^|(?<=[.;!?,])\s*|\b(?:please|and|then) )"
        rf"{_I_WANT} (?!you\b|to\b){_THING} (?:{_BE})?{_SIDE}{_ENDS}",
        r" have \1 on your \2",
    ),
    # "The bed should be on your left".
    (
        rf"{_BEGINS}{_THING} (?:should|must|has to|needs to|ought to|shall) (?:{_BE}){_SIDE}{_ENDS}",
        r" have \1 on your \2",
    ),
    # "keep the bed on the left hand side of you".
    (
        rf"\b(have|keep|with|put|let|leave|hold|get) {_THING} (?:{_BE})?"
        rf"on (?:the|your) (left|right)(?: hand)?(?: side)? of you{_ENDS}",
        r"\1 \2 on your \3",
    ),
]

_WAY = (
    r"(?:(?:once|all the way|right|just|completely|slowly|carefully|exactly|closely|the whole way|along|on|one time)"
    r"\b ?,? ?)*"
)
_GO = (
    r"(?:go|drive|walk|move|travel|run|roll|navigate|head|proceed|make your way|take a (?:walk|stroll|drive|turn|lap))"
)
_EDGE = (
    r"(?:outer |outside |very |entire |whole )*"
    r"(?:edges?|outlines?|contours?|perimeter|borders?|boundar(?:y|ies)|rim|circumference|sides)"
)
_OF = r"((?:the|an?|my|your|our|this|that) [^.,;!?]+?)"
_ONE_ROUND = (
    r"(?:a|one|a single|1) (?:full |complete |whole |big |little )?(?:laps?|rounds?|circles?|loops?|tours?|turn)"
)
# Along its edge is "circle along", once around is "circle"; "once" adds nothing, and could be read as a count or as
# "when".
_ROUND = [
    # "drive along the outer edge of the table", "follow its outline".
    (
        rf"\b(?:{_GO} {_WAY}(?:along|round|around|following|on|by)|follow|trace|skirt|patrol|circle|drive|walk) "
        rf"{_WAY}(?:the|its) {_EDGE} of {_OF}"
        rf"((?: ?,?(?: once| one time| all the way| around| round| completely)*)?){_ENDS}",
        r"circle along \1",
    ),
    (rf"\b{_GO} {_WAY}(?:a?round|along) {_OF} (?:along|following|by) its {_EDGE}{_ENDS}", r"circle along \1"),
    (rf"\b(?:{_GO} {_WAY}(?:along|round|around)|follow|trace) {_OF}'s {_EDGE}{_ENDS}", r"circle along \1"),
    # "go around the table once".
    (
        rf"\b(?:{_GO} {_WAY}|skirt )a?round (?:once )?{_OF}"
        rf"((?: once| one time| one full time| in a (?:full )?circle| completely)*){_ENDS}",
        r"circle \1",
    ),
    # "do one full lap of the table".
    (
        rf"\b(?:do|make|drive|run|walk|complete|take|go) {_ONE_ROUND} (?:a?round|of|about) {_OF}{_ENDS}",
        r"circle \1",
    ),
    # "circle the table once".
    (
        rf"\b(?:circle|orbit|encircle) (?:a?round )?{_OF} (?:once|one time)(?: (?:over|completely))?{_ENDS}",
        r"circle \1",
    ),
]

_N = rf"(?:\d+|{words.WHOLE}|a few|several|a couple of|a couple)"
_TIMES = rf"(?:once|twice|thrice|{_N} times)"
_ALL_IN_ALL = r"(?: (?:in all|in total|altogether|all together|over|overall|in a row|through|please))*"
_SAME = (
    r"(?:that|this|it|so|all (?:of )?(?:that|this|it)|everything|the same(?: thing)?(?: again)?|"
    r"the (?:whole|entire|full|complete) \w+|"
    r"the (?:round|tour|circuit|loop|lap|trip|route|sequence|thing|procedure|walk|run|exercise|whole)|"
    r"these (?:steps|moves|things|\w+ steps)|"
    r"those (?:steps|moves|things)|(?:both|all) (?:steps|moves|things))"
)
_ONCE_MORE = r"(?:again|once more|one more time|a second time|another time)"
_ROUNDS = r"(?:rounds?|laps?|tours?|loops?|circuits?)"
# "do it three times: go ..." says what to repeat after the colon, and is no repeat of what came before.
_NO_LIST_FOLLOWS = r"(?!\s*[:,]\s*(?!then\b|and\b)\w)"
# What is done again stands before "repeat that"; what a count stands before is set off with a colon.
_AGAIN = [
    (rf"[,;] ?(?:and )?({_TIMES}) (?:in all|in total|altogether)(?: please)?(?=\s*[.!]?\s*$)", r"; repeat that \1"),
    (rf"\b({_TIMES}){_ALL_IN_ALL}(?=\s*(?:[.,;!?:]|$))", r"\1"),
    # "keep doing that until you have done it three times".
    (
        rf"\b(?:keep (?:doing|repeating|on doing)|repeat|do|perform|run) {_SAME} (?:over and over )?"
        r"(?:until|till) you(?:'ve| have)? (?:done|did|made|repeated|completed|finished) "
        rf"(?:it|that|this|so) ({_TIMES})",
        r"repeat that \1",
    ),
    (rf"\b(?:until|till) you(?:'ve| have)? (?:done|made|repeated|completed) (?:it|that|this|so) ({_TIMES})", r"\1"),
    (rf"\b(?:for|make it) a total of ({_N}) times", r"\1 times"),
    # "and do the whole thing three times".
    (
        rf"\b(?:and |then )*(?:do|repeat|run|make|go|perform|drive|complete) {_SAME}(?: all)?(?: over)?(?: again)? "
        rf"({_TIMES}){_ALL_IN_ALL}{_NO_LIST_FOLLOWS}",
        r"; repeat that \1",
    ),
    # "then do it all over again": with the first time, that is twice.
    (
        r"[,;.]?\s*\b(?:and |then )*(?:do|repeat|run|make|go through|perform|drive) "
        rf"{_SAME}(?: all)?(?: over)? {_ONCE_MORE}{_ENDS}",
        "; repeat that twice",
    ),
    (rf"\bmake (?:that|it) (twice|(?:\w+|\d+) times){_MARK}", r"; repeat that \1"),
    # "Twice, go to the bed", "Two rounds, please visit ...".
    (
        rf"{_BEGINS}({_TIMES}|(?:\d+|{words.WHOLE}) {_ROUNDS})(?: over)?,? (?:please )?"
        r"(?=(?:go|drive|turn|move|visit|walk|do)\b)",
        r"\1: ",
    ),
]

_COUNTED = rf"(?:{_N}|some|the following|these|your|my|the|our)"
_STOPS = (
    r"(?:(?:stops?|places|things|goals|destinations|targets|tasks|stations|waypoints|points|spots|rooms|locations|"
    r"items|jobs|steps|orders|way points)\b)"
)
_FOR_YOU = (
    r"(?:,? (?:for you|to visit|to make|to do|to go to|to see|today|now|please|in (?:this|that) order|"
    r"i want you to (?:visit|see|go to|do)|"
    r"you (?:should|have to|must|need to) (?:visit|see|go to|do)|"
    r"that you should (?:visit|see)))*"
)
_THERE_ARE = (
    r"(?:(?:i|we) (?:have(?: got)?|want|need|would like|'ve got)|i've got|there(?:'s| are| is)|here are|you have|"
    r"make|do|your route has|visit|take)"
)
_LIST = r"(?P<rest>[^;.!?]*)"
_LISTS = [
    # "I have four stops for you: the treadmill, ..."; the orders stand after the colon.
    (
        rf"{_BEGINS}(?:please )?{_THERE_ARE}? ?{_COUNTED} (?:next |little |short )?{_STOPS}{_FOR_YOU}"
        rf"(?: are(?: these| the following)?| will be)?\s*:\s*{_LIST}",
        lambda found: _listed(found["rest"]),
    ),
    # "Your next stops are the treadmill, ...".
    (
        rf"{_BEGINS}(?:your|the|our|my) (?:next )?(?:stops|goals|destinations|targets|waypoints|stations) "
        rf"(?:are|will be|should be) {_LIST}",
        lambda found: _listed(found["rest"]),
    ),
    # "Do three rounds of the bed, the sink and the door": without a colon, only a list can follow.
    (
        rf"{_BEGINS}(?:please )?(?:(?:do|make|drive|run|take|i want|i need|i'd like) )?({_N}) (?:full )?"
        r"(rounds?|laps?|tours?|loops?|circuits?|trips)(?: (?:of|through|over))?(?: please|, please)?"
        rf"\s*(?:[:,]| (?=(?:the|my) [^.;]*,)| (?=[^.;:]*,[^.;:]* and ))\s*{_LIST}",
        lambda found: f"{_listed(found['rest'])} ; repeat that {found[1]} times",
    ),
]
# "when you are done, ...": what comes after all the rounds is no part of them.
_DONE = re.compile(
    r"(,?\s*(?:and |then )*(?:when|once|after|as soon as) "
    r"(?:you(?:'re| are| have| 've)? (?:finished|done|through)|"
    r"(?:that|this|it|everything|all)(?:'s| is) (?:done|finished|over)|finished|done)"
    r"(?: with (?:it|that|this|all|everything|the rounds?))?(?: (?:it|that|this|all))?,?)",
    re.IGNORECASE,
)
_BEGINS_AN_ORDER = re.compile(
    rf"(?:first(?:ly)?,? |please |to )*(?:{words.GO}|{words.VISIT}|{words.TURN}|{words.FACE})\b",
    re.IGNORECASE,
)


def _listed(rest: str) -> str:
    """Return a list of places or of orders as orders; what ends a round stands after it."""
    if _BEGINS_AN_ORDER.match(rest) or not rest.strip():
        return f" {rest}"
    return f" visit {re.sub(r'^(?:first(?:ly)?|to),? ', '', rest)}"


_SHOT = (
    r"(?:photo(?:graph)?|picture|pic|image|snap(?:shot)?|shot|screenshot|frame|selfie|"
    r"sound|recording|clip|noise|audio|file)"
)
# A word further on that means the file just shown.
_LATER = (
    r"(?=[^.;⟦]*\b(?:it|there|its|that|this|taken|shot|recorded|heard|"
    r"the (?:\w+ )?(?:place|spot|location|viewpoint))\b)"
)
_FILE = r"(⟦[ic]\d+⟧)"
_AT_ONCE = r"(?:(?:now|quick|quickly|fast|directly|immediately|slowly|please|at once|right now|straight away|then) )+"
_HERE = r"(?:here )?(?:to (?:me|us|where you (?:are|stand|were)(?: now)?|where i am|this (?:place|spot)|here)|here)"
_LOOK_AT = r"(?:have a look at|take a look at|look at|see|consider|study|view|open|load|check|listen to|play|hear|take)"
# Small words that come between a verb and its place, and would be read as part of the one or the other.
_SMALL = [
    (r"\b(it|that|there)'s (?=(?:on|to|at|behind|in front) )", r"\1 is "),
    (rf"\b({words.GO}) {_AT_ONCE}(?=(?:to|into|in|near|next|by|between)\b)", r"\1 "),
    (r"\b(?:in|into) (?:the )?(?:general )?direction (?:to|of)\b", "towards"),
    # "Next stop: the bed".
    (
        rf"{_BEGINS_OR_COMMA}(?:(?:your|the|my|our) )?(?:next|first|last|final) (?:stop|goal|destination|target)"
        r"(?: is| will be|:|,)? (?=(?:the|my|a|your|our)\b)",
        " go to ",
    ),
    (r"\b(way) (?:over|on|along|straight|right|up|down|across|back)+ (?=to\b)", r"\1 "),
    (r"\b(off to [^.,;!?]+?),? you go\b", r"\1"),
    # "I'll meet you by the bed": the robot is to go there.
    (
        r"(?:^|(?<=[.!?])\s*)i(?:'ll| will)(?: be)? (?:meet|see|join|wait for|waiting for)(?:ing)? you "
        r"(?=(?:in|at|by|near|on|next|beside)\b)",
        " go ",
    ),
    # "between the bed on one side and the sink on the other", "the middle of the bed and of the sink".
    (r" on (?:one|the one) side (and [^.,;!?]+?) on the other(?: side| one)?\b", r" \1"),
    (r"\b(?:the )?(?:point|place|spot|position)(?: that| which)?(?: is|'s)? (?=equally|equidistant)", ""),
    (r"\b(middle|midpoint|between|centre|center)(,? (?:of )?[^.,;!?]+? and) of (?=\w)", r"\1\2 "),
    (r"\b(in the middle|halfway|midway),? (?=between\b)", r"\1 "),
    (
        rf"\b(?:keep|hold) (?=(?:{words.DISTANCE}) (?:away )?(?:to the |on the )?"
        r"(?:left|right|north|south|east|west)\b)",
        "stand ",
    ),
    (rf"\b(come|go|return|drive|get|head) back {_HERE}\b", r"\1 back"),
    (r"\bfirst thing\b,?(?= \w)", "first"),
    (r"\b(leaning|resting|propped|perched)(?= (?:against|on|in|at|near|by)\b)", "standing"),
    # This "and" joins two places, and begins no new order.
    (
        r"\b(and) (?=(?:the|that) (?:\w+ )?(?:place|spot|location|position) "
        r"(?:where|at which|that you|you|in|shown)\b)",
        "⟦and⟧ ",
    ),
    # "the place of this file in your map": a file is always looked for in the map.
    (
        rf"{_FILE} (?:in|on|within|against|with|to|from) (?:your|the|our) (?:own )?"
        r"(?:map|memory|database|records?|recordings|pictures|images|knowledge)\b",
        r"\1",
    ),
    # A picture that is only shown, and "this picture" that is named last.
    (rf"\bthis (?:\w+ )?{_SHOT}\b([^⟦]*?)\s*[:,]\s*{_FILE}[.!?\s]*$", r"\2\1"),
    (
        rf"{_BEGINS}(?:please )?{_LOOK_AT} (?:(?:{words.DETERMINER}) (?:\w+ )?)?(?:{_SHOT} )?(?:file )?{_FILE}"
        rf"(?:,? (?:and|then)|[,;])+ {_LATER}",
        r" ⟦said⟧ \1 ; ",
    ),
    (rf"\b({_SHOT}) (?:that|which)(?: is|'s| was) (?:\w+ed |kept )?(?:in|at|under|as|on) (?=⟦)", r"\1 "),
    # "Do you know where that is?" asks nothing: the order stands beside it.
    (
        rf"{_BEGINS_OR_COMMA}"
        r"(?:do you (?:know|recogni[sz]e|remember|see)(?: where)? (?:that|it|this)(?: place)?(?: is| was)?|"
        r"(?:where|what) (?:is|was|could|might) (?:it|that|this)(?: be)?|"
        r"i wonder (?:what|where|who) (?:it|that|this) (?:is|was|could be|might be))\s*[?.]",
        " ",
    ),
]

PATTERNS = tuple(
    (re.compile(pattern, re.IGNORECASE), instead)
    for pattern, instead in (*_SMALL, *_FACING, *_BESIDE, *_ROUND, *_AGAIN)
)
_LISTED = tuple((re.compile(pattern, re.IGNORECASE), instead) for pattern, instead in _LISTS)


def plain_motions(text: str) -> str:
    """Return a text with one way to say each motion."""
    # The lists come first: the patterns after them change the counts and colons by which a list is known.
    for pattern, instead in _LISTED:
        found = pattern.search(text)
        if found:
            rest = _DONE.search(text, found.start("rest"))
            end = rest.start() if rest else len(text)
            head, tail = text[:end], text[end:]
            text = pattern.sub(instead, head) + (" ; " + _DONE.sub(" ; ", tail) if rest else "")
    for pattern, instead in PATTERNS:
        text = pattern.sub(instead, text)
    return text
