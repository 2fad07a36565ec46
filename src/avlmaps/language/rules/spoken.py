"""How people speak around a command: asides, preambles, statements that name a thing before the order that means it.

Each entry is a pattern, matched without regard to case, and what stands instead of it; they apply in their order,
before those of `rewriting`. "⟦said⟧" begins a clause that only names a thing: "The phone's ringing, drive to it"
becomes "⟦said⟧ where the phone was ringing, drive to it".
"""

from avlmaps.language.rules import words
from avlmaps.language.rules.remarks import BEGINS, ENDS, SOUNDED, SOUNDING

_DETERMINER = words.DETERMINER
_NO_NAME = r"(?:and|or|it|one|that|which|who|where|is|are|was|were|robot|then|goal|target|destination|task)"
# A thing with its article and up to five words, none of which can be a verb or a connective.
_THING = rf"(?:{_DETERMINER}(?: (?!(?:{_NO_NAME}|{words.GO})\b)[\w-]+){{1,5}}?)"
_AT_A_PLACE = (
    r"(?=(?:near|next to|beside|by|close to|in|inside|within|on|at|under|behind|against|between|opposite|where) [\w⟦])"
)
_WAS = r"(?:'s| is| was| are| were| has been| have been|'s been| keeps?| started| has started)"
_SOMEONE = r"(?:someone|somebody|something)"
_SHOT = r"(?:photo(?:graph)?|picture|pic|image|snap(?:shot)?|shot|screenshot|frame)"
_RECORDING = r"(?:recording|sound|noise|clip|sound clip|audio clip|audio|sample|snippet)"
_MEASURE = rf"(?:\d+(?:[.,]\d+)?|{words.SPELLED})[ -]?(?:{words.UNIT}|degrees?|deg|°)\b"
_ABOUT = r"(?:(?:about|around|roughly|approximately|approx\.?|circa|say|maybe|perhaps|like|by|for|some),? )*"

_HASTE = (
    r"(?:be quick(?: about it)?|hurry(?: up)?|make it (?:quick|snappy|fast)|get a move on|be careful|careful|take your "
    r"time|no (?:rush|hurry)|(?:don't|do not) (?:rush|hurry)|quick(?:ly)?|fast|chop[- ]chop|step on it|on the double|"
    r"pronto|move it)"
)
_ASIDES = [
    (
        r",\s*(?:would you|will you|could you|can you|won't you|would ya|yeah|if you please|please and thank you|"
        r"(?:there's|like|be) a (?:good|dear|love|nice|clever) ?\w*|you know|dear|pal|ok(?:ay)?|got it|right(?=\s*\?))"
        rf"{ENDS}",
        "",
    ),
    (rf"(?:\s*[,;.!]|\s+and)\s*(?:and )?{_HASTE}(?=\s*(?:[.;!?,]|$))", ""),
    (rf"^{_HASTE}(?:\s*[,.;!:]|\s+and\b)\s*", ""),
    (r"\b(?:as (?:fast|quick(?:ly)?|soon|quietly|carefully|directly) as (?:possible|you (?:can|could)))\b", " "),
    (r"\bif you(?:'d| would) be so (?:kind|good)\b", " "),
    (r",? should you (?:choose|wish|decide) to accept(?: it)?,?", " "),
    (
        rf"{BEGINS}(?:i'm|i am|we're|we are|it's|it is|they're) (?:(?:very|so|really|quite|a bit|getting|too) )*"
        rf"(?!(?:{_DETERMINER}|in|at|on|near|by|where|next|{words.COMPASS})\b)[\w-]+(?<!ing)"
        rf"(?: (?:in|at) {_DETERMINER} \w+)?\s*[.,;!] (?=\w)",
        " ",
    ),
    (r"\b(?:it's |it is )?(?:now )?time (?:for you )?to (?=\w)", " "),
    (r"\bas (?:close|near) as (?:possible|you can)(?: get)? to\b", "to"),
    (r"\b(?:let's |let us )?have you (?=(?:at|in|by|near|next|beside|on|between|left|right)\b)", "i want you "),
    (
        rf"\b(you|{words.GO}) over (?=(?:by|at|near|next to|in|on|beside|behind|between) (?:{_DETERMINER}|where)\b)",
        r"\1 ",
    ),
    (r"\bwithout (?:delay|hurry|haste|rush(?:ing)?|hesitation)\b", " "),
    (r"\bbe (?:a|so) (?:dear|love|good|kind|nice|sport|gem|good \w+) (?:and|as to)\b", " "),
    (
        r"\bif (?:it|that)(?:'s| is|'s not| is not| isn't)(?: not)?(?: too much)?(?: of)?(?: an?)? (?:trouble|"
        r"bother|hassle|problem|okay|ok|alright|fine)(?: with you| for you)?\b",
        " ",
    ),
    (r"\bwhy (?:don't|do not|not)(?: you| we)?\b", " "),
    (rf"{BEGINS}(?:how|what) about (?:you )?", " "),
    (r"\b(?:is there )?any chance (?:that )?(?:you|of you|of)(?: could| can| would| might)?\b", " "),
    (r"\b(?:would|is) it (?:be )?possible(?: for you)? to\b", " "),
    (r"\b(?:do|could you do|would you do) (?:me|us) a favou?r(?: and|:|,)?", " "),
    (
        rf"\b(?:could|can|would|will|should|may|let|make) ({_DETERMINER} [^,;.!?]+?) be your (?:\w+ )?(?:stop|goal|"
        r"destination|target)\b",
        r"go to \1",
    ),
]

_MATTER = (
    r"(?:plans?|tasks?|missions?|jobs?|orders?|instructions?|commands?|requests?|assignments?|errands?|routes?|"
    r"objectives?|deal|things?|steps?|tour|itinerary|program(?:me)?)"
)
_WANTED = (
    r"(?:what|all)(?: that)? (?:i|we|you)(?:'d| would)?(?: really)? (?:want|need|like|ask|have|must|should)(?: of|"
    r" from)?"
    r"(?: (?:you|the robot))?(?: (?:to )?do)?(?: (?:now|next|today|first))?"
)
_FOR_YOU = r"(?: (?:for (?:you|now|today|me|us)|to do|now|next|today))*"
_OPENING = r"^(?:(?:ok(?:ay)?|so|now|right|well|alright|all right|hey|hi|hello|robot|and|listen|attention)[,!. ]+)*"
_PREAMBLES = [
    (r"(?:(?<=[.;,!])|^)\s*(?:and )?(?:second|third|fourth|last), (?=\w)", " ; "),
    (
        rf"{_OPENING}(?:(?:(?:new|next|first|final|last|your|the|my|our|another|now) )+)?(?:destination|goal|"
        rf"target|stop|"
        rf"waypoint)(?: (?:for you|now|today))*\s*:\s*",
        "go to ",
    ),
    (
        rf"{_OPENING}(?:(?:here(?:'s| is| are|s)|this is|that is|these are|i(?:'ve| have)(?: got)?) )?"
        rf"(?:(?:an?|the|your|my|our|new|next|first|one|another|last|final|small|little|quick|simple|more|some|"
        rf"following) "
        rf")*(?:{_MATTER}{_FOR_YOU}|change of plans?|{_WANTED})(?: (?:is|are)(?: as follows| this| the following)"
        rf"?)?\s*:\s*",
        "",
    ),
    (
        rf"{_OPENING}(?:(?:your|the|my|our|next|first|new|last|only|current) )+(?:{_MATTER}){_FOR_YOU} (?:is|"
        rf"would be|will "
        r"be)(?: now)?(?: for you)? to\b",
        "",
    ),
    (rf"{_OPENING}{_WANTED} (?:is|would be|'s)(?: for you| that you| you)?(?: to)?\b", ""),
    (r"^(?:listen|attention|look|hey you|excuse me|sorry|hm+|um+|uh+|er+|oh|ah)(?: up| here)?\s*[,!.:]\s*", ""),
    (
        r"(?:(?<=[.;,!])|^)\s*(?:and )?(?:first(?:ly)?|second(?:ly)?|third(?:ly)?|fourth|fifth|last(?:ly)?|next|then|"
        r"finally|after that|step (?:\d+|one|two|three|four|five))\s*:\s*",
        " ; ",
    ),
]

_IT_WAS = (
    r"(?:(?:it|that|this|they|he|she)(?:'s| is| was| are| were| has been)?(?: (?:just|coming|came|comes|come|"
    r"heard|made|"
    r"recorded|played))?(?: from)?|the (?:sound|noise)(?: is| was)?(?: (?:coming|came|comes|come|heard))?(?: from)?)"
)
_IT_CAME = (
    r"(?:it|that|this|they)(?:'s| is| was| are| were)?(?: (?:just|coming|came|comes|come|originated|originates|"
    r"heard|made))* ?"
    r"(?:from)?(?<!where it)(?<!where that)(?=\s*(?:[.;!?,:)]|$)|\s+(?:and|then)\b)"
)
_LOOK_INTO = (
    r"(?:(?:go|come|drive|run|head|move)(?: over)?(?: there)?(?: and| to)? )?(?:see|find out|check|figure out|"
    r"look|discover|investigate|learn)"
)
_STATEMENTS = [
    (r"\bit's\b", "it is"),
    (r"\b(you|we|they|i)'ve\b", r"\1 have"),
    (r"\bi (?:think|believe|guess|suppose|reckon|am sure|'m (?:pretty )?sure)(?: that)?,? (?=\w)", ""),
    (r"\ball (?=(?:that|this|the) )", ""),
    (rf",? \b(?:earlier|just now|a (?:moment|minute|while|second) ago|yesterday|this morning|last night){ENDS}", ""),
    (rf"{BEGINS}(?:do you |did you |can you )?(?:hear|see) (?:that|it)\s*\?", " "),
    (
        rf"{BEGINS}(?:it is|it must be|that must be|sounds like) (?={_DETERMINER} [^.;!?,]+[.;!?,] \w)"
        rf"(?!.*\b(?:i (?:want|need|would)|you (?:should|must|need|are to))\b)",
        " ; ⟦said⟧ ",
    ),
    (r"\b(?:that |which )?(?:you|i|we) (?:can )?see (?=(?:in|on) (?:[\w-]+ ){0,3}⟦)", "shown "),
    (
        r"\bi(?:'d| would) (?:love|like|prefer) to (?:have|see) you (?=at|in|by|near|next|beside|on|between|left|"
        r"right|to the)",
        "i want you ",
    ),
    (
        rf"{BEGINS}where (?:do|did|can|could|have) (?:you|i|we) (?:last |just )?hear(?:d)? ({_DETERMINER}|)"
        rf"([^.;!?,]+?)\s*\?",
        r" ; ⟦said⟧ the sound of \2 ;",
    ),
    (
        rf"{BEGINS}where (?:do|did|can|could|have) (?:you|i|we) (?:last |just )?(?:see|seen|find) ({_DETERMINER} "
        rf"[^.;!?,]+?)\s*\?",
        r" ; ⟦said⟧ \1 ;",
    ),
    (rf"(?<=\w )(?:its|the) (?:source|origin){ENDS}", "it"),
    (rf"\b(?:track|trace|chase|pursue|investigate|check) (?=(?:{_DETERMINER} )?(?:sounds?|noises?)\b)", "find "),
    (
        rf"[,;.]?\s*\b(?:and )?on the way(?: there)?,? (?=(?:{words.MOVE})\b)",
        " ; ⟦after⟧ ",
    ),
    (
        rf"[,;.]\s*(?:and |but )?((?:{words.MOVE})\b[^,;.!?]*?) on the way(?: there)?{ENDS}",
        r" ; ⟦after⟧ \1",
    ),
    (r"\bhaving arrived(?: there)?\b", "then"),
    (r"\bfirst off (?=to\b)", "go "),
    (r"\b(?:look|turn|check) behind (?:you|yourself)\b", "turn around"),
    (rf"\b(?:the )?(?:thing|one|object|device) (?:(?:that|which)(?:'s| is| was) )(?={SOUNDING}\b)", "the sound of "),
    (
        rf"({_THING}) (?:that|which|who)(?:'s| is| was| are| were)(?: just| still| now)? ({SOUNDING})\b(?! (?:in|"
        rf"on|at|to) (?:the|a)\b)",
        r"\1 \2",
    ),
    (r"\b(?:the|an?) (?:area|zone|room|place|spot|location) with (?=(?:the|an?) (?:sounds?|noises?)\b)", ""),
    (rf"({BEGINS})what(?:'s| is| was) (?={_DETERMINER} [\w -]+\?)", r"\1 ; ⟦said⟧ "),
    (rf"\b(?:go|drive|come|run|head|move|walk) (?:over|across){ENDS}", "go there"),
    (r"\b(you|we|they)'re\b", r"\1 are"),
    (rf"({_SHOT}|{_RECORDING}|file)\s*[,:]\s*(?=⟦)", r"\1 "),
    # "where it was taken": of the picture that was named.
    (
        rf"\b({words.GO}) (?:back )?(?:to )?(?:the (?:\w+ )?(?:place|spot|location) )?where (?:it|that|this|"
        rf"(?:the|that|this) "
        rf"(?:{_SHOT}|{_RECORDING})) (?:was|is|has been|got|had been) (?:taken|shot|made|snapped|captured|"
        rf"recorded|heard)\b(?! ?[:,]? ?⟦)",
        r"\1 to it",
    ),
    (
        rf"\b(?:the (?:\w+ )?(?:place|spot|location) )?where (?:it|that|this|(?:the|that|this) (?:{_SHOT}|"
        rf"{_RECORDING})) "
        r"(?:was|is|has been|got|had been) (?:taken|shot|made|snapped|captured|recorded|heard)\b(?! ?[:,]? ?⟦)",
        "it",
    ),
    (
        r"(⟦[ic]\d+⟧\s+(?:was|is|has been) (?:taken|shot|made|heard|recorded)) (?:some(?:where|place)|in here|"
        r"here)\b",
        r"\1",
    ),
    (
        rf"{BEGINS}(?:take a look at|have a look at|look at|see|consider|take|check|listen to|play) "
        rf"(?=(?:{_DETERMINER} (?:\w+ )?)?"
        rf"(?:(?:{_SHOT}|{_RECORDING})\b[^⟦.;]*)?⟦[^.;,!?]*[.;,!?].*\b(?:it|there)\b)",
        " ; ⟦said⟧ ",
    ),
    # "I heard a crash, go and see where that came from".
    (rf"\b{_LOOK_INTO} (?:where|what|who) {_IT_WAS}{ENDS}", "go to it"),
    (
        rf"\b{_LOOK_INTO} (?:what(?:'s| is| was)? (?:happened|happening|going on|wrong|up|the matter)|what made "
        rf"(?:it|that)(?: noise| sound)?)(?: there)?{ENDS}",
        "go to it",
    ),
    (
        rf"\b(?:go(?: and)? )?(?:check (?:it|that|this) out|investigate(?: it| that| this)?|look into (?:it|that)|"
        rf"see to (?:it|that)|check on it|track (?:it|that) down|find (?:its|the) (?:source|origin)(?: of (?:it|"
        rf"that))?|have a look there){ENDS}",
        "go to it",
    ),
    (
        rf"\b(?:go|drive|come|run|head)(?: over)?(?: and|,)? (?:see|look|check|have a look|take a look|find out)"
        rf"{ENDS}",
        "go to it",
    ),
    (rf"(?<!back )\bto where {_IT_CAME}", "to it"),
    (rf"\b({words.GO}) where {_IT_CAME}", r"\1 to it"),
    (rf"(?<!to )\bwhere {_IT_CAME}", "it"),
    (r"\bthere(?:'s|'re)\b", "there is"),
    (
        r"\bthere (?:should|must|ought to|might|may|used to|seems? to|has to|will|could) be\b|\bthere (?:was|were)"
        r"\b(?! heard)",
        "there is",
    ),
    (rf"{BEGINS}(?:is|are|isn't|aren't) there (?=(?:an?|any|some|the|my)\b)", " ; there is "),
    (
        rf"{BEGINS}(?:(?:do|did|can|could) )?(?:you|we|i)(?:'ve| have)?(?: (?:can|could|just|still|now))*(?: be)"
        rf"? (?:hear(?:d|ing)?)(?: (?:an?|the|this|that|my|your|some))?(?: (?:sounds?|noises?) of(?: (?:an?|the|"
        rf"this|that|my|your))?)? (?=[\w⟦])(?!it\b)",
        " ; ⟦said⟧ the sound of ",
    ),
    (
        rf"{BEGINS}(?:(?:do|can|did|could) )?(?:you|i|we)(?:'ve| have)?(?: (?:can|could|may|might|just|still))* "
        rf"(?:see|saw|know|knew|remember|recall|noticed?|seen|spot|spotted|lost|left|misplaced|forgot|have|have "
        rf"got) (?={_DETERMINER}\b|⟦)",
        " ; ⟦said⟧ ",
    ),
    (rf"{BEGINS}(?:remember|recall) (?={_DETERMINER}\b|⟦)", " ; ⟦said⟧ "),
    (rf"{BEGINS}(?:here(?:'s| is| are)|this is|that's|that is|these are) (?={_DETERMINER}\b|⟦)", " ; ⟦said⟧ "),
    (
        rf"{BEGINS}i(?:'m| am| was|'ve been| have been) (?:looking for|searching for|after|hunting for|trying to "
        rf"find|in search of)\b",
        " find ",
    ),
    (
        rf"{BEGINS}where(?:'s| is| are| was| were) ({_DETERMINER}[^.;!?,]+?|music|{_SOMEONE} [^.;!?,]+?) "
        rf"(?:coming|heard)(?: from)?\s*\?",
        r" ; ⟦said⟧ the sound of \1 ;",
    ),
    (
        rf"{BEGINS}where(?: does| did| do) ({_DETERMINER}[^.;!?,]+?) (?:come|originate|sound) from\s*\?",
        r" ; ⟦said⟧ the sound of \1 ;",
    ),
    (rf"{BEGINS}where(?:'s| is| are| was| were) ({_DETERMINER}[^.;!?,]+?)\s*\?", r" ; ⟦said⟧ \1 ;"),
    (
        rf"{BEGINS}({_THING}|{_SOMEONE}){_WAS} (?:\w+ly |just |still |now |again )?({SOUNDING})\b(?: (?:the|an?|"
        rf"his|her|my)\b)?",
        r" ; ⟦said⟧ the sound of \1 \2",
    ),
    (
        rf"{BEGINS}({_THING}|{_SOMEONE})(?: has| have)?(?: just)? ({SOUNDED})\b(?=[^.;!?,]*(?:[.;!?,]|\band\b))",
        r" ; ⟦said⟧ where \1 \2",
    ),
    (
        rf"{BEGINS}({_THING})(?:'s| is| are| stands?| sits?| hangs?| lies| lives?)(?: (?:located|somewhere|right|"
        rf"just|over|standing|sitting|lying|placed|situated|up|out|back|there))* (?!where\b)"
        rf"{_AT_A_PLACE}(?=[^.;!?,]*[.;!?,])",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"{BEGINS}({_THING}) (?:is|are|looks?|seems?|needs?|has|have) (?!(?:near|next|by|in|on|at|under|behind|"
        rf"between) \w)(?:(?!(?:where|what|you|your|that|to|in|near|next|by|on|at|under|behind|between|inside)\b)"
        rf"[\w-]+ ?){{1,4}}[.;!?,] (?=[^.;]*\b(?:it|there|"
        rf"them)\b)",
        r" ; ⟦said⟧ \1 ; ",
    ),
    # "the big lamp: face it": named, not yet gone to.
    (
        rf"{BEGINS}({_DETERMINER} [^,;.:!?]+)[,:.?!] (?=(?:(?:please|now|could you|can you|would you|just) )"
        rf"*(?:{words.FACE}|{words.TURN}|stop|stand|park|wait|go|move|drive|position yourself)\b[^,;.:!?]*\b(?:it|"
        rf"its|it's)\b)",
        r" ; ⟦said⟧ \1 ; ",
    ),
    (
        rf"\b(?:the )?(?:sound of )?(?:whoever|whatever|who|what)(?:'s| is| was)(?: making)? (?={SOUNDING}\b)",
        "the sound of ",
    ),
]

_ADVERB = r"(?:somewhere|someplace|right|just|over|up|down|out|back|directly|close|there|here|off|way|located)"
_PLACES = [
    (
        r"\s*[,;.(]\s*(?:and )?(?:i mean |i meant |namely |that is,? |specifically |meaning )?(?:the|that) one,? "
        r"(?:(?:that "
        rf"is|that's|which is|which's|{_ADVERB}) )*(?=(?:near|next to|beside|by|close to|in|inside|on|at|with|"
        rf"where|under|"
        r"behind|from|against|between|opposite)\b)",
        " ",
    ),
    (
        rf"({_THING}) (?:(?:that|which)(?:'s| is| was) )?(?:(?:somewhere|someplace|anywhere) )?(?:(?:over|back|up|"
        rf"down|out|in|"
        r"right|just|around|round) )*(?:here|there)\b(?!['’])(?! (?:is|are|was|to)\b)",
        r"\1",
    ),
    (rf"({_THING}|there is [\w -]+?) (?:somewhere|someplace|nearby|some place|somewhere or other){ENDS}", r"\1"),
    (rf"({_THING}) (?:just |right )?outside(?: of)? (?={_DETERMINER}\b)", r"\1 near "),
    (rf"({_THING})(?: (?:that|which)(?:'s| is))?(?: {_ADVERB})+ {_AT_A_PLACE}", r"\1 "),
    (
        rf"({_THING})(?<!place)(?<!spot)(?<!location)(?<!room)(?<!area)(?<!position) (?:(?:that|which) is |that's "
        rf"|as )?(?:shown|seen|pictured|depicted|"
        rf"photographed|captured|visible) (?=(?:in|on) (?:{_DETERMINER} )?(?:\w+ )?(?:{_SHOT} )?(?:file )?⟦)",
        r"\1 near ",
    ),
    (rf"\b(near) (?:in|on) (?=(?:{_DETERMINER} )?(?:\w+ )?(?:{_SHOT} )?(?:file )?⟦)", r"\1 "),
    (
        rf"\b(in|into|inside|within|enter|entering) ({_DETERMINER}) toilet(?=\s*(?:[,.;:!?]|$)| (?:and|then|or|"
        rf"where|near|by|"
        r"next|beside|with|please|before|after|twice|now|over)\b)",
        r"\1 \2 toilet-room",
    ),
]

_MOTION = [
    (r"\b(?:hang|take|make|do) an? (left|right)(?! angle)(?: turn)?\b", r"turn \1"),
    (rf"\b(?:move|go|come|step) up (?=(?:a (?:little )?bit|a little)\b|{_ABOUT}{_MEASURE})", "go forward "),
    (rf"\b(?:go|carry|keep|drive|move|continue|keep going) on (?={_ABOUT}{_MEASURE})", "go forward "),
    (r"\bturn half-?\s?way (?:a?round)\b", "turn around"),
    (r"\b(?:by |through |at )?an? right angle\b", "90 degrees"),
    (rf"\b(?:slightly|a bit|a little) (left|right),? {_ABOUT}(?={_MEASURE})", r"\1 "),
    (
        rf",\s*(?:and )?(?=(?:forwards?|backwards?|ahead|back|straight|left|right|north|south|east|west) "
        rf"{_ABOUT}(?:{_MEASURE}|\d))",
        " ; ",
    ),
    (rf"(?:^|(?<=[;,.]))\s*((?:left|right) \d+){ENDS}", r" \1 degrees"),
    (
        rf"\b(?:a (?:little )?bit|a little|slightly|a tad|a short (?:way|distance))(?: more| further)?,? "
        rf"{_ABOUT}(?={_MEASURE})",
        "",
    ),
    (rf"\s*,\s*{_ABOUT}(?={_MEASURE}(?: (?:away|off|apart))?\s*(?:[.;!?]|$|, |\b(?:and|then)\b))", " "),
    (
        rf"\b(?:point|orient|orientate|aim|direct|align|head) (?:yourself|itself) (?=(?:to (?:the|your) )?(?:due )"
        rf"?(?:left|right|"
        rf"{words.COMPASS}|around|round|by)\b)",
        "turn ",
    ),
    (
        r"\b(?:squeeze|wedge|tuck|slot|slip|install|wheel|haul|drag|swing|plonk|plop|nestle|sandwich|lodge|"
        r"manoeuvre|maneuver|"
        r"deposit|fit|base|anchor|seat|sit|hide|insert)(?: (?:yourself|itself))?(?: in| down| up)*(?= (?:in[- ])"
        r"?between\b)",
        "go",
    ),
    (
        r"\b(?:squeeze|wedge|tuck|slot|slip|install|wheel|haul|drag|plonk|plop|nestle|lodge|manoeuvre|maneuver|"
        r"deposit|fit|base|"
        r"anchor|seat|sit|hide|insert) (?:yourself|itself)(?: down| up| over| across)*(?= )",
        "go",
    ),
    (
        rf"\b({words.TURN})((?: to (?:the|your))? (?:left|right))?(?: by)? (?:an?|one) (quarter|half)"
        rf"(?=\s*(?:[,.;!?]|$)| to "
        r"(?:the|your)\b| and\b)",
        r"\1\2 a \3 turn",
    ),
    (r"\b(?:spin|twirl|whirl)(?: yourself)? (?:a?round )(?:once|one time)\b", "turn in a full circle"),
]

PATTERNS = ((r"\s+", " "), *_ASIDES, *_PREAMBLES, *_STATEMENTS, *_PLACES, *_MOTION)
