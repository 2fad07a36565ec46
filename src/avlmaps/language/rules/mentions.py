"""How people name a thing before the order that means it: questions, pictures, sounds, two things at once.

Each entry is a pattern, matched without regard to case, and what stands instead of it; they apply in their order,
before those of `spoken`. "⟦said⟧" begins a clause that only names a thing, "⟦both⟧" stands for the last two things that
were named, "⟦inside⟧" for the area that was gone to last.
"""

from avlmaps.language.rules import words
from avlmaps.language.rules.remarks import BEGINS, GO, NEXT, NO_SUBJECT, PERSON, SOUNDED, SOUNDING
from avlmaps.language.rules.sounds import SOUND_NOUNS, SOUND_VERBS

_DETERMINER = words.DETERMINER
_SILENT = "|".join(sorted(noun for noun in SOUND_NOUNS if noun not in ("bang", "bark", "scream", "noise", "meow")))
_SHOT = (
    r"(?:photo(?:graph)?|picture|pic|image|snap(?:shot)?|shot|screenshot|frame|selfie|jpe?g|png|"
    r"recording|clip|sound)"
)
_SPOT = r"(?:place|spot|location|position|area|room|site|point|scene)"
_ONE_ORDER_LATER = rf"(?=[^⟦]*\b(?:{GO}|check|investigate|look|stop)\b)"

_ASKING = [
    (
        rf"{BEGINS}(?:(?:do|can|could|would) you (?:know|tell me|remember|recall|see) |any idea |tell me |"
        r"i wonder )?(?:which "
        r"(?:way|direction)|in (?:which|what) direction|what direction|whereabouts)(?: is| are|'s| to|"
        r" lies)* "
        rf"({_DETERMINER} [^.;!?,]+?)(?: (?:is|are|lies))?(?: (?:in|at|from here|located|again))?\s*[?.;,!]",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{BEGINS}(?:do you know|can you tell me|can you remember|do you remember|remember|any idea|"
        r"tell me|you know|i know|i forgot|i wonder) "
        rf"where ({_DETERMINER} [^.;!?,]+?) (?:is|are|was|were|could be|might be|stands?|went)(?: (?:at|"
        rf"again|now))?\s*[?.;,!]{_ONE_ORDER_LATER}",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{BEGINS}(?:have you seen|can you see|do you see|could you see|did you see|do we have|have we got|"
        r"see|is there|are there|do you know|you know|know)"
        rf" ((?:{_DETERMINER}|any) [^.;!?,⟦]+?)(?: (?:anywhere|somewhere|around(?: here)?|"
        rf"nearby))?\s*\?{_ONE_ORDER_LATER}",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{BEGINS}where(?: might| could| would)? ((?:{_DETERMINER}) [^.;!?,]+?) (?:be|at)\s*\?",
        r" ; ⟦said⟧ \1 ;",
    ),
    (rf"{BEGINS}where(?:'s| is| are) ((?:{_DETERMINER}) [^.;!?,]+?) (?:at|now|again)\s*\?", r" ; ⟦said⟧ \1 ;"),
    (
        rf"{BEGINS}(?:what(?:'s| is| was| were)|who(?:'s| is| was)|who made) (?:that|this|the|all that|"
        r"making that) ?(?:sounds?|noises?|racket|din|bang(?:ing)?)?\s*\?"
        rf"(?=\s*(?:it|that|i|sounds?)\b)",
        " ",
    ),
    (
        rf"{BEGINS}(?:is|was|are|were) (?:that|this|it) (?:the (?:sound|"
        rf"noise) of )?(?:{_DETERMINER} )?([\w' -]+?) ?\?{_ONE_ORDER_LATER}",
        r" ; ⟦said⟧ the sound of \1 ;",
    ),
    (
        rf"{BEGINS}(?:i think |it was |that was )?(?:it |that |this )?(?:sounds?|sounded)(?: a (?:lot|bit)|"
        rf" just| kind of| very much)? like (?:{_DETERMINER} )?(?=\w)",
        " ; ⟦said⟧ the sound of ",
    ),
]

_WHEN = (
    r"(?:,? (?:this morning|yesterday|today|earlier(?: today)?|last (?:night|week|month)|just now|(?:a|"
    r"an|some|two|three) \w+ ago|here|"
    r"with my (?:phone|camera)|for you|somewhere|there|before|once|recently|in here))*"
)
_PICTURED = [
    (
        rf"\bwhere (?:this|that|it|the (?:{_SHOT})) (?:was|is|got) (?:recorded|taken|shot|heard|made|"
        r"captured)[:,]? ?(?=⟦)",
        "to ",
    ),
    (r"\bto to (?=⟦)", "to "),
    (
        rf"{BEGINS}do you (?:recogni[sz]e|know|remember|see|like) (?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} "
        r")?(⟦[ic]\d+⟧)\s*\?",
        r" ; ⟦said⟧ \1 ; ",
    ),
    (
        rf"(?:the {_SPOT} (?:in|of|on|from|shown in|seen in) )?(⟦[ic]\d+⟧) (?:is|will be|should be|"
        r"shows) (?:your|the|our) (?:next |new |final )?(?:stop|goal|target|destination|waypoint)",
        r"go to \1",
    ),
    (
        rf"{BEGINS}(?:(?:yesterday|today|this morning|earlier|last (?:night|week)|just now|once),? )?(?:i|"
        rf"we|you|he|she|they|someone|somebody|{PERSON})(?: have| has|'ve| had)?(?: just| also)? (?:took|"
        r"taken|take|shot|made|snapped|captured|recorded|saved|"
        r"uploaded|sent(?: you)?|got|have|attached|taped|stored|found|filmed|"
        rf"drew) (?:you )?(?:(?:{_DETERMINER}|this|some) )?(?:\w+ )?(?:{_SHOT},? )?(?:(?:called|named|as|"
        rf"file|of it|it),? ?)*[:,]? ?(⟦[ic]\d+⟧){_WHEN}"
        rf"\s*(?=[.;!?,:]|and\b)",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"{BEGINS}(?:{_DETERMINER} )?(?:\w+ )?{_SHOT} ?[(,:]? ?(⟦[ic]\d+⟧) ?\)?,? where (?:was|is|"
        r"were) (?:it|this|that) (?:taken|shot|made|recorded|from|heard)\s*\?",
        r" ; ⟦said⟧ \1 ; ",
    ),
    (
        rf"{BEGINS}(?:(?:{_DETERMINER} )?(?:\w+ )?{_SHOT} )?(⟦[ic]\d+⟧) (?:was|were|is|has been) (?:taken|"
        rf"shot|made|recorded|heard|captured|snapped){_WHEN}(?=\s*[.;!?,])(?<!⟧)",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"\b(?:use|take|treat|set|make|consider|choose) (?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} "
        r")?(?:file )?(⟦[ic]\d+⟧) (?:as|for|to be|is) (?:your |the |a |my )?(?:\w+ )?(?:goal|target|"
        r"destination|reference|query|cue|waypoint|guide|hint)(?: (?:image|picture|location|place))?",
        r"go to \1",
    ),
    (
        rf"{BEGINS}(?:please )?(?:locali[sz]e|match|recogni[sz]e|identify|load|open|process|analy[sz]e|use|"
        r"view|read|import|compare|query|study|inspect|check|remember|hear|listen to|play|"
        rf"see|look at|watch|here|get)[:,]? (?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} )?(?:file "
        r")?(⟦[ic]\d+⟧),?(?=\s*(?:[.;!?,]|and\b|then\b)[^⟦]*\b(?:it|there|that|taken|shot|heard|goal|shows|"
        r"go)\b)",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"\b(?:(?:{_DETERMINER}|some|any) )?(?:{_SPOT}|somewhere|someplace|what|where it|whatever|"
        r"something)? ?(?:that |which )?(?:looks?(?: just| exactly| most| a lot)* like|"
        r"resembl(?:es|ing)|match(?:es|ing)|(?:most )?similar to|correspond(?:s|ing) to|"
        rf"identical to) (?=(?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} )?(?:file )?⟦i)",
        "",
    ),
    (
        rf"\b(?:the (?:\w+ )?{_SPOT} )?where (?:you|i|we|it|they)(?: can| could| last)? (?:hear|heard|"
        rf"recorded|saw|see|played) (?:it|that|this)(?: sound| noise)?{NEXT}",
        "it",
    ),
    (
        rf"\b(?:the (?:\w+ )?{_SPOT} (?:that |which )?(?:it|that|the (?:{_SHOT})) (?:shows|depicts|shows us|"
        r"displays|was (?:taken|shot|made|recorded)(?: at| from| in)?|came from|comes from|is (?:of|from))|"
        rf"the {_SPOT} (?:shown|seen|depicted|pictured)(?: (?:in it|there|in that|on it|"
        rf"in the (?:{_SHOT})))?|what it shows|"
        rf"(?:its|the) (?:{_SPOT}) (?:in it|of it|on it)){NEXT}",
        "it",
    ),
    (
        r"\b(?:go|drive|head|move|navigate|come|get|take me|walk|proceed|travel|please)(?: over|"
        rf" back)?(?: to)? (?:to )?(?:that|this|its|the same|the) (?:exact |very |same )?{_SPOT}{NEXT}",
        "go there",
    ),
    (r"\bhere's? (?=⟦)", " ; ⟦said⟧ "),
]

_SOUNDS = [
    (r"\b(?:sound|noise) source[: ]+(?:of |is )?(?=\w)(?!(?:is|was|and|then)\b)", "the sound of "),
    (
        rf"{BEGINS}((?!(?:the|a|an|my|that|this)\b){NO_SUBJECT}[a-z]+) (?:is|was|are|were|keeps?|"
        rf"kept) ({SOUNDING})\b",
        r" ; ⟦said⟧ the sound of \1 \2",
    ),
    (
        rf"{BEGINS}it(?:'s| is| was) (?:an? |the )?([\w -]+? (?:pounding|{SOUNDING}))(?=\s*[.,;!])",
        r" ; ⟦said⟧ the sound of \1",
    ),
    (
        r"\bwhere(?:ver)? (?:that|the|all that|this) ([\w -]+?)(?: noise| sound)? (is|was) coming from",
        r"where the \1 \2 coming from",
    ),
    (
        rf"{BEGINS}((?:an?|some|another) [\w-]+(?: [\w-]+)?) (?:was|has been|got) (broken|smashed|shattered|"
        r"slammed)(?=\s*[.,;!])",
        r" ; ⟦said⟧ where \1 \2",
    ),
    (rf"\b(?:to )?(?:the \w+ )?where (?:that|this|it) (?:happened|occurred|took place){NEXT}", "to it"),
    (
        rf"{BEGINS}(?:(?:somewhere|someplace),? )?((?:(?:{_DETERMINER}) (?!{_DETERMINER})[\w-]+(?: [\w-]+)?|"
        r"someone|somebody|something)) ((?!(?:tap|saw|drill|drum|fall|pop|click|cheer|blow|run|"
        rf"play)s\b)(?:{'|'.join(SOUND_VERBS)})[a-z]?e?s)\s*[.;!?,]+ "
        r"(?=(?:please |robot,? |quick(?:ly)?,? |now,? )*(?:go|drive|head|move|run|check|come|investigate|"
        r"find|face|turn)\b)",
        r" ; ⟦said⟧ where \1 \2 ; ",
    ),
    (
        rf"{BEGINS}(?:somewhere|someplace|in the distance|outside|inside|over there|upstairs|"
        r"downstairs)(?: in [\w ]+)?,? (?=(?:an?|the|some|my)\b)",
        " ",
    ),
    (
        rf"\b({SOUNDED}|{SOUNDING}|went off)\b,? (?:(?:about |just |some )*(?:\d+|an?|one|two|three|five|"
        r"ten|twenty|few|a few|several) (?:seconds?|minutes?|hours?|moments?|while) ago|earlier|just now|"
        r"again|loudly|somewhere|all (?:day|night|the time))(?=\s*[.;!?,]|\s*$| and\b)",
        r"\1",
    ),
    (
        rf"\bto (?:the \w+ )?where (?:it|that|this) ({SOUNDED}|went off|is {SOUNDING}|" rf"was {SOUNDING}){NEXT}",
        "to it",
    ),
    # "glass broke, go", "phone ringing - go to it", "footsteps! go there".
    (
        rf"(?:^|(?<=[.;!]))\s*{NO_SUBJECT}(?!{_DETERMINER}\b)((?:(?!(?:{GO})\b)[\w-]+ ){{0,2}}(?:{_SILENT}|"
        rf"(?!ring|sing|king)[\w-]*{SOUNDING}))\s*[,.;!:]+ "
        r"(?=(?:please |robot,? |quick(?:ly)?,? |now,? )*(?:go|drive|head|move|run|check|come|investigate|"
        r"find|face|turn)\b[^.;]*(?:\b(?:there|it|that|check|source|out)\b|$))(?!\w+ to (?:the|my)\b)",
        r" ; ⟦said⟧ the sound of \1 ; ",
    ),
    (
        rf"(?:^|(?<=[.;!]))\s*{NO_SUBJECT}(?!{_DETERMINER}\b)((?:(?!(?:{GO})\b)[\w-]+ "
        rf"){{0,2}}{NO_SUBJECT}[\w-]+) (?:just )?({SOUNDED})\s*[,.;!:]+ "
        r"(?=(?:please |robot,? |quick(?:ly)?,? |now,? )*(?:go|drive|head|move|run|check|come|investigate|"
        r"find|face|turn)\b)",
        r" ; ⟦said⟧ where \1 \2 ; ",
    ),
    (
        r"\b(?:to|at|towards?|near|by) the direction (?=(?:that |which |where |from which |"
        rf"from where )?{_DETERMINER})",
        "the direction ",
    ),
    (
        r"\b(?:in |into |to |towards? )?the direction (?:that |which |where |from which |"
        rf"from where )?((?:{_DETERMINER} )?(?!of\b)[\w -]+? (?:is |was |are |were |has been )?(?:coming|"
        r"came|comes|come|heard|originated))(?: from)?\b",
        r"where \1 from",
    ),
    (
        rf"\bthe (?:\w+ )?(?:{_SPOT}|direction|source) (?:that|it|this|which)(?: sound| noise)? (?:came|"
        rf"comes|is coming|was coming|originated|originates)(?: from)?{NEXT}",
        "it",
    ),
    (r"\b(?:by|near|nearby|next to|beside|close to|from|at|in|around|behind|under) (?:which|whom) (?=\w)", "where "),
    (rf"\bfind out (?:who|what)(?:'s| is| was) (?={SOUNDING}\b)", "find the sound of "),
    (
        r"\b(?:see|check|find out|look|discover) (?:who|what)(?:'s| is| was) (?:making |"
        rf"causing )?(?={_DETERMINER}? ?(?:{SOUNDING}|sound|noise)\b)",
        "find the sound of ",
    ),
]

_TWO = [
    (
        r"(?<=\w) (?:that |which )?(?:you|we|i) (?:can|will|could|would|may|should|'ll)? ?(?:find|see|spot|"
        r"have|notice) (?=(?:in|on|at|near|next|by|beside|under|behind|where)\b)(?<!do you see )",
        " ",
    ),
    (
        rf"{BEGINS}({_DETERMINER} [\w-]+(?: [\w-]+)?) (?:is|are) the ones? (?=(?:near|next|by|beside|in|on|"
        r"at|close|under|behind|where)\b)",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"(?:^|(?<=[.;!?]))\s*({_DETERMINER} [\w-]+(?: [\w-]+)?) (?=(?:to|on|at) your (?:left|"
        r"right)(?:[- ]hand)?(?: side)?(?:,? please)?\s*[.!]*$)",
        r" have \1 ",
    ),
    (
        rf"(?:^|(?<=[.;!?]))\s*(?:i (?:need|want) )?({_DETERMINER} [\w-]+(?: [\w-]+)?) (?:(?:must|should|"
        r"has to|needs to|ought to|shall) be )(?=(?:right |directly )?(?:in front of|behind|ahead of) you)",
        r" have \1 ",
    ),
    (
        r"[.;!?,]\s*(?:and )?(?:that|this|it)(?:'s| is| will be) (?:your|the) (?:next |final |new )?(?:goal|"
        r"target|destination|stop)(?=\s*[.!]|\s*$)",
        "; go to it",
    ),
    (
        rf"{BEGINS}where ([^,.;!?]+?),? there(?:'s| is| are|'re| was) ((?:{_DETERMINER}|some) [^,.;!?]+)",
        r" ; there is \2 where \1 ",
    ),
    (
        rf"{BEGINS}((?:in|inside|near|next to|by|beside|on|at|under|behind|"
        rf"close to) (?:{_DETERMINER}) [^,.;!?]+?) (?:is|are|stands?|sits?|hangs?|lies|you(?:'ll| will|"
        r" can)? (?:find|see|have)|we have)"
        rf"(?: located| also| standing)? ((?:an?|the|my|our|some) [^,.;!?]+?)(?=\s*[,.;!?])",
        r" ; there is \2 \1 ",
    ),
    (
        rf"{BEGINS}there,? (?:you(?:'ll| will| can|'re going to| should)? (?:find|see|notice)|is|"
        r"stands) (?=(?:an?|the|some|my)\b)",
        " there is ",
    ),
    (rf"\band (?=(?:there(?:'s| is| are)|i see|you see|i have|we have) (?:{_DETERMINER}|some)\b)", "; "),
    (
        r"\b(between|of|amid|in[- ]between) (?:the (?:two(?: of them)?|both|pair)|them(?: both)?|"
        r"both(?: of them)?|these(?: two)?|those(?: two)?|both)\s*[:,] ?(?=(?:the|my|an?)\b)",
        r"\1 ",
    ),
    (
        r"\b(between|of|amid|in[- ]between) (?:the two(?: of them| things| objects)?|them(?: both| two)?|"
        r"both(?: of them)?|these(?: two)?|those(?: two)?|(?:these|those|the) two [\w-]+)(?=\s*(?:[.;!?,:)]|"
        rf"$)|\s+(?:then|please|now|and (?:{GO}))\b)",
        r"\1 ⟦both⟧",
    ),
    (
        r"\b(?:of all|among(?:st)?|out of|from)(?: all)? (?:the|those|our) ([\w -]+?)(?:(?<=[xs])es|"
        r"(?<=[cs]h)es|s),? (.*?)\b(?:the|that) one (?=(?:that |which )?(?:is |that's )?(?:near|next|by|"
        r"beside|in|on|at|close|under|where|behind|between|closest)\b)",
        r" \2the \1 ",
    ),
    (
        r"(?:^|(?<=[.;]))\s*(?:there are|i see|we have|you(?:'ll| will| can)? (?:see|find|have)|i have|"
        r"i know)(?: got)? (?:two|three|four|several|some|many|a few|a couple of|lots of|multiple|different|"
        r"\d+) "
        r"([\w -]+?)(?:(?<=[xs])es|(?<=[cs]h)es|s)(?: (?:in here|here|around|"
        r"in this \w+))?[,.;:!] (.*?)\b(?:the|that) one (?=(?:that |which )?(?:is |that's )?(?:near|next|by|"
        r"beside|in|on|at|close|under|where|behind|between|closest)\b)",
        r" \2the \1 ",
    ),
    (
        rf"((?:{_DETERMINER}) (?!(?:place|spot|one)\b)[\w-]+(?: (?!(?:in|over|up|down|back|out|to|go|at|on|"
        r"come|drive)\b)[\w-]+)?) (?:that(?:'s| is| you(?:'ll)? find| you see) |which is )?(?:in there|"
        r"inside(?: there| it)?|there)"
        rf"(?<!over there)(?<!up there)(?<!back there)(?<!down there)(?<!out there)(?<!over inside){NEXT}",
        r"\1 ⟦inside⟧",
    ),
]

PATTERNS = (*_ASKING, *_PICTURED, *_SOUNDS, *_TWO)
