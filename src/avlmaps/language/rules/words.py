"""The words that the rules know: verbs and connectives with their synonyms, and numbers with their units.

Everything else is a name. Each pattern is the text of a regular expression, matched without regard to case.
"""

import re
from collections.abc import Sequence

# Verbs that lead to a place. "find the chair" and "show me the chair" go there, too.
# Verbs that take what they lead to without "to": "find the chair" and "show me the chair" go there, too.
VISIT = (
    r"be (?:taken|brought|led|guided|driven) to|(?:find|make|work|pick) (?:your|its) way to|make straight for|"
    r"show (?:me|us)(?: the way to)?|(?:find|locate|get) (?:me|us)|(?:go |come )?(?:look|search|hunt)(?:ing)? for|"
    r"check (?:out|on)|checking (?:out|on)|checked out|"
    r"(?:your|the)(?: (?:next|first|final|last))? (?:goal|destination|target|stop) (?:is|should be|will be|would be)|"
    r"(?:visit|approach|reach|find|locate|seek|follow|enter|join|pass|tour|access|revisit|spot|track down|seek out|"
    r"pay)(?:e?s|e?d)?|"
    r"found|(?:visit|approach|reach|find|locat|seek|follow|enter|join|pass|revisit)ing|get (?:me|us) to|(?:leave|"
    r"depart|leaving) for|lead the way to|"
    r"(?:take|bring|lead|guide|escort|drive|walk|accompany|steer|direct) (?:me|us) to|make a beeline for|make for|"
    r"making for|"
    r"pay a visit to|(?:swing|drop|stop|pop) by|pass by|passing by|move in on|close in on|home in on|converge on"
)
# Verbs that lead to a place with "to", "next to", "left of" and their like: "move the chair" is refused.
GO = (
    r"make a (?:quick |short |brief )?stop|(?:trot|tiptoe|whizz|zip|meander|mosey|drift|motor|scurry|pootle|waltz)|"
    r"(?:make|find|work|pick|wend) (?:your|its) way|(?:position|place|put|station|bring|take|get|plant|park|move|"
    r"transport|situate|set|"
    r"locate|stand|drive|steer|navigate|stop) (?:yourself|itself|the robot)|pop (?:over|round)|set (?:off|out)|"
    r"setting (?:off|out)|"
    r"(?:take|bring|lead|guide|escort|drive|walk|accompany|steer) (?:me|us)|(?:wait for|meet) (?:me|us)|"
    r"(?:i|we)(?:'d| would)?(?: really)? (?:want|need|expect|like|prefer)(?: to (?:see|have|find))? (?:you|the "
    r"robot)(?: to be| standing| parked| waiting| positioned)?|"
    r"head out|end up|come to (?:a|rest|a (?:complete )?(?:stop|halt|rest|standstill))|keep (?:going|moving|"
    r"driving|walking|on)|off you go|"
    r"keep on (?:going|moving|driving|walking)|carry on|take (?:a|up) (?:position|station|stand|your (?:place|"
    r"position))|be positioned|be located|"
    r"(?:go|move|drive|navigate|walk|travel|head|proceed|roll|run|ride|wander|stroll|come|get|step|continue|stop|"
    r"halt|pause|stand|"
    r"start|begin|park|wait|stay|rest|settle|hurry|finish|relocate|scoot|glide|cruise|amble|saunter|trundle|dash|"
    r"zoom|race|steer|advance|"
    r"return|arrive|journey|march|venture|migrate|creep|crawl|linger|hover|remain|transfer|backtrack|shift|hop|be|"
    r"rush|slide|end|"
    r"roam|inch|nudge|edge|shuffle|budge|skip|sprint|jog|hike|trek|hold)(?:e?s)?|"
    r"(?:going|moving|driving|navigating|walking|travell?ing|heading|proceeding|rolling|running|riding|wandering|"
    r"strolling|coming|"
    r"getting|stepping|continuing|stopping|halting|pausing|standing|parking|waiting|staying|finishing|advancing|"
    r"returning|"
    r"arriving|went|gone|been|got|gotten|came|moved|driven|driven|walked|arrived|stopped|returned|relocating|"
    r"starting|beginning|traveled|travelled)"
)
# Either of them.
MOVE = rf"(?:{VISIT}|{GO})"
DETERMINER = r"(?:the|an?|this|that|these|those|my|your|our|his|her|their)"
RETURN = (
    r"(?:return|head|go|come|get|move|drive|walk|navigate|travel|roll|make your way|find your way|run|bring yourself|"
    r"take (?:me|yourself)|trundle|wander)(?:ing|s)? back|return(?:ing|s)?|double back|doubling back|turn back(?= "
    r"to)|go home|backtrack|retrace your steps"
)
TURN = (
    r"(?:turn|rotate|spin|swivel|pivot|swing|veer|revolve|twirl|twist|reorient|bear)(?: (?:yourself|itself|on the "
    r"spot|in place))?|"
    r"(?:turning|rotating|spinning|swivell?ing|pivoting|turned|rotated)(?: (?:on the spot|in place))?"
)
FACE = (
    r"(?:turn|direct|shift|focus|point)(?:ing)? (?:your|its) (?:attention|head|gaze|camera|eyes?|face|front|nose|"
    r"body|view|sensors?) "
    r"(?:to|towards?|at|on|onto)|"
    r"(?:turn|rotate|spin|swivel|pivot|swing)(?:ing)?(?: yourself)?(?: a?round)?(?: and| so as)? (?:to )?(?:face|"
    r"facing|look at|"
    r"look (?:to|towards?)|be facing)|(?:orient|point|aim|direct|align)(?:ing)?(?: (?:yourself|itself|your "
    r"(?:camera|head|front|"
    r"face|nose|eyes|gaze|view)|the (?:camera|robot)))? (?:at|to|towards?|with)|(?:have|take) a look (?:at|to|"
    r"towards?)|"
    r"(?:look|gaze|stare|glance|peer|watch)(?:ing)?(?: over)?(?: (?:at|to|towards?|in the direction of|into))?|"
    r"(?:face|facing|faced|watch)(?: (?:to|towards?|in the direction of))?"
)
BACK_UP = r"(?:back (?:up|off|away)|backing up|reverse|reversing|retreat|retreating|fall back)"
MANIPULATE = (
    r"pick|grab|grasp|take|fetch|get me|bring|carry|lift|open|close|put|place|push|pull|press|drop|hold|clean|wash|"
    r"cook|"
    r"switch|pour|throw|give|hand|deliver|touch|kick|eat|sit|jump|dance|sing|say|tell|speak|play|count"
)
NEGATIONS = (
    r"don't|do not|dont|doesn't|never|not|avoid|avoiding|without|except|unless|if|instead|rather than|or|either|"
    r"neither|"
    r"cannot|can't|whichever|unlike|provided|providing|assuming|supposing|suppose it|in case|in the event|as long as|"
    r"so long as|depending on|on condition"
)

# What may stand after a direction; before anything else it begins a name, as in "the left lamp".
STOPS = (
    r"(?=\s*$|\s*[,\d]|\s+(?:by|for|at|in|near|next|inside|beside|through|to|towards?|about|turn|rotation|spin|"
    r"twice|once|thrice|"
    r"slightly|around|round|just|until|from|away)\b|\s+<SPELLED>\b)"
)

# Said for politeness or by habit; nothing changes when they are left out.
FILLERS = (
    r"\b(?:let|allow|permit) the robot(?: to)?\b",
    r"\b(?:i|we)(?:'d| would)? (?:want|need|like|wish) to (?=(?:go|get|visit|see(?! (?:you|the robot))|be|find|"
    r"reach|move|drive)\b)",
    r"\bfrom (?:where you (?:are|stand)|here|your (?:current )?(?:position|place|location|spot))(?: now| on)?,?",
    r"\b(?:in turn|one after (?:the other|another)|in (?:that|this|the given) order|respectively|in sequence|one "
    r"by one)\b",
    r"\bfirst things first\b:?,?",
    r"\b(?:i|we)(?:'d| would| will|'ll)? (?:really )?(?:be (?:very |so |really )?(?:glad|happy|grateful|pleased|"
    r"delighted|obliged) if|"
    r"appreciate it if|like it if|love it if|prefer it if|be grateful if) you(?: could| would| can)?\b",
    r"\b(?:i (?:was|am|'m) wondering (?:if|whether)|i wonder if|(?:do|would) you think) (?:you|the robot)(?: could|"
    r" would| can| might)?\b",
    r"\b(?:it would|it'd|that would|it will) be (?:really |very |so )?(?:great|nice|good|lovely|wonderful|kind|"
    r"helpful|ideal|perfect)(?: of you)?"
    r"(?: if (?:you|the robot)(?: (?:could|would|can))?| (?:to|for you to))?\b",
    r"\bwhat (?:i|we) (?:want|need|would like|'d like)(?: you to do)? (?:is|would be)(?: for you)?(?: to)?\b",
    r"(?:^|(?<=[;,] )|(?<=please ))(?:mind|care to|fancy|do you mind)(?= \w+)(?! the\b)",
    r"\b(?:when(?:ever)?|as soon as|if|once) you (?:(?:have|get|find) (?:a|some|the) (?:moment|minute|second|"
    r"chance|time)|can|are (?:ready|able)|"
    r"'re (?:ready|able)|feel like it|have time)\b",
    r"\b(?:(?:i|we)(?:'m| am|'d| would| have| need|'ve)* )?(?:asking|request(?:ing)?|instruct(?:ing)?|"
    r"command(?:ing)?|order(?:ing)?|telling|ask) (?:you|the robot) to\b",
    r"(?:hey|hi|hello|ok|okay|dear|yo|alright|all right|so|well|right|now)(?: there)?,? (?:mr\.? |little "
    r")?(?:robot|robbie|rover|"
    r"buddy|friend|assistant)\b",
    r"^(?:(?:hey|hi|hello|yo)(?: there)?|ok|okay|alright|all right|so|well|now|right|good|great|robot|cool)\b(?=\s*,)",
    r"^(?:hey|hi|hello|ok|okay|alright|robot|so|well)(?: there)?\b",
    r", ?(?:robot|buddy|my friend|mate)\b(?=\s*[,.;!?]|\s*$)",
    r"\b(?:if (?:you|it)(?: (?:do not|don't|would not|wouldn't|would|wouldn't|please|could|can|are able to|'re "
    r"able to|have time))*(?: (?:mind|like|possible|please|okay|ok|manage|do that|do so))?)(?=\s*[,.;!?]|\s*$)",
    r"\bif it(?: is|'s) (?:possible|okay|ok|alright|all right|fine|no trouble|not too much trouble)(?: (?:with|for|by) "
    r"you)?(?=\s*[,.;!?]|\s*$)",
    r"\b(?:if (?:you (?:do not|don't|wouldn't|would not) mind|possible|you (?:can|could|please|like|would)|you "
    r"would be so kind))\b",
    r"\b(?:thank you|thanks|thx|cheers)(?: (?:very much|so much|a lot|in advance|a million))?\b",
    r"\b(?:can|could|would|will|won't|may|might) (?:you|i|we) (?:please )?(?:kindly )?(?:be so kind as to|be able "
    r"to|ask you to|"
    r"have you|mind|try to|possibly|perhaps|go ahead and|get you to|trouble you to)\b",
    r"\b(?:can|could|would|will|won't|can't) (?:you|the robot)\b",
    r"\b(?:i|we)(?:'d| would|'ll| will)? (?:really )?(?:want|need|like|love|ask|wish|prefer|request)(?: for)? "
    r"(?:you|the robot) to "
    r"(?!be\b)",
    r"\b(?:i|we)(?:'d| would) (?:be (?:glad|happy|grateful) if|appreciate it if) you(?: could| would)?\b",
    r"\b(?:it would|it'd|that would) be (?:great|nice|good|lovely|wonderful|kind|helpful)(?: of you)?(?: if you "
    r"(?:could|would)|"
    r" to)?\b",
    r"(?<!where )\b(?:you|the robot|it|we)(?: (?:should|must|shall|need to|have to|are to|is to|ought to|will(?: "
    r"want to| need to)?|can|may|"
    r"might want to|is going to|are going to|could)|'ll|'d better|'re going to)(?: then| first| now| also)?\b(?! "
    r"be (?:able|found))",
    r"\b(?:let's|let us|try to|try and|make sure (?:to|that you|you)|be sure to|remember to|have the robot|get the "
    r"robot to|"
    r"make the robot|tell the robot to|go ahead and|feel free to|proceed to(?= (?:go|move|turn|face|drive|walk|"
    r"look|find|stop))|"
    r"your (?:task|job|mission) is to|the (?:task|job|mission|idea|plan) is to|i was wondering if|do me a favou?r and|"
    r"start (?:off )?(?:by|with)|begin (?:by|with)|finish (?:off )?by|end by|conclude by|continue by|follow this by)\b",
    r"\b(?:please|pls|plz|kindly|just|simply|quickly|slowly|carefully|gently|quietly|safely|immediately|at once|"
    r"right away|"
    r"right now|straight away|as fast as you can|as soon as you can|asap|for me|for us|actually|basically|maybe|"
    r"perhaps|whenever you(?:'re| are) ready|when you(?:'re| are) ready|when you have a (?:moment|minute)|"
    r"on your own|by yourself|also|again please|at your leisure|would you|will you|okay\?|exactly|precisely|roughly|"
    r"approximately|about(?= (?:\d|one|two|three|half|a |four|five|ten))|"
    r"directly(?= (?:to|in|on|at|by|north|south|left|right|behind|between))|straight(?= (?:to|over|into)\b)|"
    r"right(?= (?:next to|"
    r"beside|by (?:the|a|my)|in front|behind|up to|between|in between|over to|near))|all the way(?= (?:to|over|up|"
    r"back))|"
    r"somewhere(?= (?:between|in|near|by|close))|anywhere(?= (?:between|near))|there(?= (?:between|next to|near)))\b",
    r"\b(?:now|ok|okay|alright|will you|would you|could you|yeah|yes|got it|understood|alright|good|"
    r"great)\b(?=\s*[,.;!?]|\s*$)",
    r"^(?:now|also|yes|sure)\b",
    r"(?<=; )(?:now|also|and)\b",
)

# Ends a clause that says where a thing is to be as the robot sees it.
YOURS = (
    r"(?:(?:is|are|being|stays?|remains?|be|comes?|ends? up|lies|appears|staying)\s+)?(?:(?:directly|straight|"
    r"immediately|just|exactly)\s+)?"
    r"(?:(?:on|to|at)\s+)(?:the |your |its |robot's |your own )?(?:left|right)(?:[- "
    r"]?hand)?(?:\s+side)?(?:\s+of\s+you)?\s*$|"
    r"(?:(?:is|are|be|being|stays?|remains?|comes?)\s+)?"
    r"(?:(?:directly|straight|right)\s+)?(?:behind\s+(?:you|yourself|your back|it)|"
    r"(?:in\s+front|ahead)\s+of\s+"
    r"(?:you|yourself|it)|straight\s+ahead|directly\s+ahead|right\s+ahead|dead\s+ahead|ahead|at\s+(?:your|"
    r"the)\s+(?:back|rear)|to\s+your\s+(?:rear|back))\s*$"
)

COMPASS = (
    r"(?:north|south)[- ]?(?:east|west)(?:ern|ward|wards)?|(?:north|south|east|west)(?:ern|ward|wards|erly|bound)?"
)
LEFT_RIGHT = r"left|right"
DEGREES_OF = {
    "north": 0, "northeast": 45, "east": 90, "southeast": 135, "south": 180, "southwest": 225, "west": 270,
    "northwest": 315,
}  # fmt: skip

_UNITS_M = {
    r"m(?:et(?:re|er)s?)?": 1.0, r"cm|centimet(?:re|er)s?": 0.01, r"dm|decimet(?:re|er)s?": 0.1,
    r"mm|millimet(?:re|er)s?": 0.001, r"ft|feet|foot": 0.3048, r"yd|yards?": 0.9144, r"in(?:ch|ches)": 0.0254,
    r"(?:big |small |little )?steps?|paces?": 0.5,
}  # fmt: skip
_ONES = [
    "zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
    "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen",
]  # fmt: skip
_TENS = {"twenty": 20, "thirty": 30, "forty": 40, "fourty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80,
         "ninety": 90}  # fmt: skip
_SOME = {"a couple of": 2, "a couple": 2, "couple of": 2, "a pair of": 2, "a few": 3, "several": 3, "half a": 0.5, "h"
    "alf an": 0.5,
         "half": 0.5, "a quarter of a": 0.25, "a quarter": 0.25, "an": 1, "a": 1, "another": 1,
         "three quarters of a": 0.75}  # fmt: skip
_LITTLE = (
    r"a (?:little |tiny |wee )?bit|a little(?: way| bit| more)?|slightly|a touch|a smidge|a short (?:way|"
    r"distance)|a tad|slight"
)

_ONE = "|".join(_ONES[::-1])
_TEN = "|".join(_TENS)
WHOLE = (
    rf"(?:(?:an?|one|two|three) hundred(?: and)?(?: (?:{_TEN})(?:[ -](?:{_ONE}))?| (?:{_ONE}))?|"
    rf"(?:{_TEN})(?:[ -](?:{_ONE}))?|{_ONE})"
)
_POINT = rf"(?: point (?:{_ONE}))?"
_FIGURES = r"\d+(?:[.,]\d+)?"
_AND_PART = r"(?: and (?:a half|half|a quarter|three quarters))?"
SPELLED = rf"(?:{WHOLE}{_POINT}{_AND_PART}|{'|'.join(sorted(_SOME, key=len, reverse=True))})"
# "2m" needs no space, "two metres" does: "am" is no metre.
_MEASURED = rf"(?:({_FIGURES})[ -]?|({SPELLED})[ -])"
UNIT = "|".join(_UNITS_M)
_BEFORE = r"(?:(?:for|by|at|some|around|about|within|a (?:distance|further)(?: of)?|another|the next) )*"
DISTANCE = (
    rf"{_BEFORE}(?:{_MEASURED}(?:more |further |long )?(?:{UNIT})\b{_AND_PART}|{_LITTLE})(?: further| "
    r"farther| away(?! from)| off(?! of| the))?"
)
# A word for a little may stand before a side; a number of degrees says the angle itself.
ANGLE = (
    rf"(?:by |for |through |at |an angle of |another |about |around |some )*(?:{_MEASURED}(?:degrees?|deg\b|°|"
    r"radians?|rad\b)|(?:a )?(?:quarter|half|full)(?: an?)?[ -](?:turn|circle|rotation|revolution|spin)|"
    rf"{_LITTLE}|(?:a )?half[ -]?way)"
)
COUNT = (
    rf"(?:once|twice|thrice|(?:for )?(?:(?:{_FIGURES}|{WHOLE}|a couple of|a few|several) (?:more )?(?:times?|"
    r"rounds?|laps?|loops?|trips?|round trips?|"
    r"rotations?|repetitions|cycles)))(?: in a row| in total| over| more)?"
)


def number_of(text: str) -> float:
    """Return the number that figures or words say: "2,5", "twenty-five", "one and a half", "a few"."""
    words = text.lower().strip()
    if re.fullmatch(_FIGURES, words):
        return float(words.replace(",", "."))
    if words in _SOME:
        return float(_SOME[words])
    part = re.search(r" and (a half|half|a quarter|three quarters)$", words)
    if part:
        return number_of(words[: part.start()]) + _SOME.get(
            part[1], {"a half": 0.5, "three quarters": 0.75}.get(part[1], 0)
        )
    if " point " in words:
        whole, digit = words.split(" point ")
        return number_of(whole) + _ONES.index(digit) / 10
    return _sum_of_words(words.replace("-", " ").split())


def _sum_of_words(words: Sequence[str]) -> float:
    total = 0.0
    for word in words:
        if word == "hundred":
            total = max(total, 1.0) * 100
        elif word in _TENS:
            total += _TENS[word]
        elif word in _ONES:
            total += _ONES.index(word)
        elif word in ("a", "an"):
            total += 1
    return total


def metres_of(text: str) -> float | None:
    """Return how many metres a distance says, or None for "a bit", which says only which way."""
    found = re.search(rf"{_MEASURED}(?:more |further |long )?(?:({UNIT})\b)({_AND_PART})", text.lower())
    if found is None:
        return None
    unit = next(size for name, size in _UNITS_M.items() if re.fullmatch(name, found[3]))
    extra = number_of("zero" + found[4]) if found[4] else 0.0
    return round((number_of(found[1] or found[2]) + extra) * unit, 4)


def angle_of(text: str) -> float:
    """Return the degrees that an angle says; a little is 30."""
    from math import degrees

    words = text.lower()
    for name, angle in (("quarter", 90.0), ("half", 180.0), ("full", 360.0)):
        if re.search(rf"{name}(?: an?)?[ -](?:turn|circle|rotation|revolution|spin)|{name}[ -]?way", words):
            return angle
    found = re.search(rf"{_MEASURED}(degrees?|deg\b|°|radians?|rad\b)", words)
    if found is None:
        return 30.0
    amount = number_of(found[1] or found[2])
    return round(degrees(amount) if found[3].startswith("rad") else amount, 3)


def count_of(text: str) -> int:
    """Return how often: "twice", "three times"."""
    words = text.lower().strip()
    for name, count in (("once", 1), ("twice", 2), ("thrice", 3)):
        if words.startswith(name):
            return count
    found = re.search(rf"({_FIGURES}|{WHOLE}|a couple of|a few|several) ", words)
    return int(number_of(found[1])) if found else 1


def compass_of(text: str) -> int | None:
    """Return the heading on the compass that a text names, degrees clockwise from north, or None."""
    found = re.search(r"(north|south)?[- ]?(east|west)|north|south", text.lower())
    return DEGREES_OF[re.sub(r"[- ]", "", found[0])] if found else None


def side_of(text: str) -> str | None:
    """Return `left` or `right` where a text names one of them."""
    found = re.search(r"\b(left|right)", text.lower())
    return found[1] if found else None
