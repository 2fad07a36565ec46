"""What people say around an order: greetings, reported speech, where somebody is, questions that only name a thing.

Each entry is a pattern, matched without regard to case, and what stands instead of it. `BEFORE` apply before those of
`spoken`, `AFTER` after them. "⟦said⟧" begins a clause that only names a thing, "⟦both⟧" stands for the last two things
that were named, "⟦inside⟧" for the area that was gone to last.
"""

from avlmaps.language.rules import words
from avlmaps.language.rules.sounds import PAST_TENSES, SOUND_NOUNS, SOUND_VERBS

_DETERMINER = words.DETERMINER
_BEGINS = r"(?:^|(?<=[.;!?,:]))\s*(?:(?:and|but|so|well|look|hey|now|listen),? )?"
_ENDS = r"(?=\s*(?:[.;!?,:)]|$))"
_NEXT = r"(?=\s*(?:[.;!?,:)]|$)|\s+(?:and|then|please|now|quickly)\b)"
_SOUNDING = rf"(?:(?:{'|'.join(SOUND_VERBS)})[a-z]?ing|going off)"
_SOUNDED = rf"(?:(?:{'|'.join(SOUND_VERBS)})[a-z]?ed|{'|'.join(PAST_TENSES)})"
_SILENT = "|".join(sorted(noun for noun in SOUND_NOUNS if noun not in ("bang", "bark", "scream", "noise", "meow")))
_SHOT = r"(?:photo(?:graph)?|picture|pic|image|snap(?:shot)?|shot|screenshot|frame|selfie|jpe?g|png|recording|clip|sound)"
_SPOT = r"(?:place|spot|location|position|area|room|site|point|scene)"
_GO = rf"(?:{words.MOVE}|{words.RETURN}|{words.TURN}|{words.FACE})"
_NO_SUBJECT = (
    r"(?!(?:i|you|we|it|they|he|she|who|which|that|this|what|where|there|then|and|or|please|robot|just|now|first|if|"
    rf"when|unless|until|after|before|once|not|don't|never|{_GO})\b)"
)
_ONE_ORDER_LATER = rf"(?=[^⟦]*\b(?:{_GO}|check|investigate|look|stop)\b)"

_PERSON = (
    r"(?:(?:my|our|the|your|his|her|their|a|some|little|old|poor) )*(?:wife|husband|son|daughter|mom|mum|mommy|mummy|"
    r"dad|daddy|mother|father|brother|sister|grandma|grandpa|granny|grandmother|grandfather|kids?|child|children|"
    r"guests?|visitors?|friends?|boss|colleagues?|neighbou?rs?|boys?|girls?|man|woman|lady|people|somebody|someone|"
    r"everyone|everybody|he|she|they|nurse|doctor|patient|customer|student|teacher|uncle|aunt|cousin|roommate|"
    r"flatmate|partner|girlfriend|boyfriend|delivery|postman|mailman|team)"
)
_PLACED = r"(?:in|inside|at|by|near|next to|on|beside|close to)"

_GREETINGS = (
    r"(?:oh,? (?:my|dear|no|boy|god|gosh|man|wow|yes|well)(?: (?:god|goodness|gosh))?|wow|ouch|gosh|phew|ugh|yikes|hooray|"
    r"hurray|ahoy|great(?: news| job)?|nice(?: job| one)?|well done|good (?:morning|evening|afternoon|day|night|job|"
    r"work|robot|boy|girl)|morning|evening|greetings|howdy|yo|sup|attention|alert|urgent|emergency|help(?: me)?|guess "
    r"what|excuse me|pardon(?: me)?|sorry(?: to bother you)?|bonjour|hola|hallo|ciao|bitte|por favor|s'il vous "
    r"plait|welcome(?: back)?|hi|hello|hey|ok(?:ay)?|alright|all right|thanks|thank you|come on|let's go|here we go|"
    r"off we go|let's (?:get going|move|roll|do (?:this|it)|get moving|get started|start|see)|very well|perfect|"
    r"awesome|cool|sure|fine|yes|yeah|yep|aye|tell you what|you know what|by the way|btw|fyi|honestly|seriously|"
    r"quick(?:ly)?|listen(?: up)?|look here|are you (?:there|ready|free|busy|listening|awake)|how are you(?: today| "
    r"doing)?|wake up|ready|i have a (?:job|task|question|request) for you|can you (?:help|do me a favou?r)(?: me)?"
    r"(?: out)?|i need (?:your |some )?help|time's up|action)"
)
_WHO = r"(?:everyone|everybody|robot|there|buddy|all|team|guys|folks|my friend|pal|mate|little (?:one|guy|robot)|sir|ma'am)"
_HESITATION = r"(?:u+m+|u+h+|e+r+m?|hm+|like|so(?! (?:that|the|it|you|your)\b)|well|ok(?:ay)?|yeah|hey|hi|oh(?! (?:my|dear|no|boy|god|gosh|man)\b)|ah+|alright|anyway|dude)"

_OPENINGS = [
    (rf"^\s*(?:{_HESITATION}(?:\.\.\.|[,. ])+)+(?=\w)(?!there\b)(?!that\b)(?!robot\b)(?!robbie\b)(?!rover\b)(?!buddy\b)", ""),
    (rf"(?:^|(?<=[.!?]))\s*(?:(?:and|so|but|oh(?! (?:my|dear|no|boy|god|gosh|man)\b)|well),? )?{_GREETINGS}(?: (?:to )?{_WHO})?\s*(?:[,.!?:;-]+\s+)(?=\w)", " "),
    (r",?\s+(?:u+m+|u+h+|e+rm+|you know|i mean|kinda|sort of|kind of|literally),?\s+(?=(?!the\b.*[?!.,]$)\w)", " "),
    (
        r"\bi(?:'m| am| was|'ve been| have been)? (?:just |also |kind of )?(?:thinking|wondering|hoping|thought|hope|"
        r"figured?|suggest|propose|recommend|insist|suppose|trust|pray)(?: about it)?(?: that| if| whether|,)?"
        r"(?: maybe| perhaps)?,? (?=(?:you|we|u|maybe|could|can|would)\b)",
        "",
    ),
    (r"\b(?:what if|suppose|maybe|perhaps|how about if) (?:you|we) (?:could |can |would |just )?(?=\w)(?!are\b|were\b)", ""),
    (r"\bi(?:'d| would) (?:say|suggest|recommend|propose)(?: that)? (?:you |we )?(?:should )?(?=\w)", ""),
    (
        r"\b(?:is it|would it be|is that) (?:ok|okay|alright|fine|possible)(?: (?:if|for|that) you| with you if you)?"
        r"(?: could| can| to)? (?=\w)",
        "",
    ),
    (r"\b(?:be|you(?:'re| are)) (?:a|an|so|such an?|my) [\w ]{2,24}? (?:and|as to) (?=\w)", ""),
    (
        r"\b(?:i|we) (?:was|were|have been|'ve been|am|'m) (?:told|informed|asked)(?: that)?,? (?=\w)(?!to\b)|"
        r"\b(?:apparently|it (?:seems|appears|looks)(?: to me)?(?: like| that| as if)?|(?:rumou?r|legend) has it(?: that)?|word is(?: that)?|"
        r"according to [\w' ]+?),? (?=(?:the|an?|my|our|some\w*|there|your)\b)",
        "",
    ),
]  # fmt: skip

_REPORTED = [
    (
        rf"{_BEGINS}{_NO_SUBJECT}(?:{_DETERMINER} )?[a-z][\w'-]*(?: [a-z][\w-]+)? (?:just |also |has |already |only )*(?:says?|said|tells? (?:me|us)|"
        r"told (?:me|us|you)|thinks?|thought|claims?|claimed|reports?|reported|mentions?|mentioned|swears?|believes?|insists?|"
        r"complains?|complained|is saying|was saying|thinking)(?: to me)?(?: that|,)? (?!to\b)(?!so\b)(?!you\b)(?=\w)",
        " ",
    ),
    (
        rf"{_BEGINS}(?:{_PERSON}) (?:just |also |has |already |only |can |could )*(?:heard?|hears|noticed) (?=(?:an?|the|some|my|our)\b)",
        " i heard ",
    ),
    (rf"{_BEGINS}(?:{_PERSON}) (?:just |also |has |already |only |can |could )*(?:saw|sees?|spotted|left|forgot|lost|put) (?=(?:an?|the|some|my|our|his|her|their)\b)", " i saw "),
    # Where somebody is, is where "there" is.
    (
        rf"{_BEGINS}(?:{_PERSON}|i)(?:'s|'m|'re| is| am| are| was| were)(?: just| still| now| already| also| always)*(?: (?!{_SOUNDING}\b)[a-z]+ing)?"
        rf"(?: for you| for me)? {_PLACED} ((?:{_DETERMINER}) [^.;!?,]+?|my [\w ]+?)(?=\s*[.;!?,]| and (?:needs?|wants?)\b)"
        rf"(?: and (?:needs?|wants?)[^.;!?,]*)?(?=[^⟦]*\b(?:there|him|her|them|me|us|here|it)\b)",
        r" ; ⟦said⟧ \1",
    ),
    (
        r"(⟦said⟧ [^.;!?,]+[.;!?,].*?)\b(?:come|go|drive|get|roll|move|head)(?: over| up)?(?: to (?:me|us|him|her|them|where "
        rf"(?:i|we|he|she|they) (?:am|are|is))| here|,? (?:and )?(?:join|find|meet|help|see|visit) (?:me|us|him|her|them)){_NEXT}",
        r"\1go there",
    ),
]  # fmt: skip

_ASKING = [
    (
        rf"{_BEGINS}(?:(?:do|can|could|would) you (?:know|tell me|remember|recall|see) |any idea |tell me |i wonder )?(?:which "
        rf"(?:way|direction)|in (?:which|what) direction|what direction|whereabouts)(?: is| are|'s| to| lies)* "
        rf"({_DETERMINER} [^.;!?,]+?)(?: (?:is|are|lies))?(?: (?:in|at|from here|located|again))?\s*[?.;,!]",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{_BEGINS}(?:do you know|can you tell me|can you remember|do you remember|remember|any idea|tell me|you know|i know|i forgot|i wonder) "
        rf"where ({_DETERMINER} [^.;!?,]+?) (?:is|are|was|were|could be|might be|stands?|went)(?: (?:at|again|now))?\s*[?.;,!]{_ONE_ORDER_LATER}",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{_BEGINS}(?:have you seen|can you see|do you see|could you see|did you see|do we have|have we got|see|is there|are there|do you know|you know|know)"
        rf" ((?:{_DETERMINER}|any) [^.;!?,⟦]+?)(?: (?:anywhere|somewhere|around(?: here)?|nearby))?\s*\?{_ONE_ORDER_LATER}",
        r" ; ⟦said⟧ \1 ;",
    ),
    (
        rf"{_BEGINS}where(?: might| could| would)? ((?:{_DETERMINER}) [^.;!?,]+?) (?:be|at)\s*\?",
        r" ; ⟦said⟧ \1 ;",
    ),
    (rf"{_BEGINS}where(?:'s| is| are) ((?:{_DETERMINER}) [^.;!?,]+?) (?:at|now|again)\s*\?", r" ; ⟦said⟧ \1 ;"),
    (
        rf"{_BEGINS}(?:what(?:'s| is| was| were)|who(?:'s| is| was)|who made) (?:that|this|the|all that|making that) ?(?:sounds?|noises?|racket|din|bang(?:ing)?)?\s*\?"
        rf"(?=\s*(?:it|that|i|sounds?)\b)",
        " ",
    ),
    (
        rf"{_BEGINS}(?:i think |it was |that was )?(?:it |that |this )?(?:sounds?|sounded)(?: a (?:lot|bit)| just| kind of| very much)? like (?:{_DETERMINER} )?(?=\w)",
        " ; ⟦said⟧ the sound of ",
    ),
]  # fmt: skip

_WHEN = (
    r"(?:,? (?:this morning|yesterday|today|earlier(?: today)?|last (?:night|week|month)|just now|(?:a|an|some|two|three) \w+ ago|here|"
    r"with my (?:phone|camera)|for you|somewhere|there|before|once|recently|in here))*"
)
_PICTURED = [
    (
        rf"{_BEGINS}(?:i|we|you|he|she|they|someone|somebody|{_PERSON})(?: have| has|'ve| had)?(?: just| also)? (?:took|taken|take|shot|made|snapped|captured|recorded|saved|"
        rf"uploaded|sent(?: you)?|got|have|attached|taped|stored|found|filmed|drew) (?:you )?(?:(?:{_DETERMINER}|this|some) )?(?:\w+ )?(?:{_SHOT},? )?(?:(?:called|named|as|file|of it|it),? ?)*[:,]? ?(⟦[ic]\d+⟧){_WHEN}"
        rf"\s*(?=[.;!?,:]|and\b)",
        r" ; ⟦said⟧ \1 ",
    ),
    (rf"{_BEGINS}(?:(?:{_DETERMINER} )?(?:\w+ )?{_SHOT} )?(⟦[ic]\d+⟧) (?:was|were|is|has been) (?:taken|shot|made|recorded|heard|captured|snapped){_WHEN}(?=\s*[.;!?,])(?<!⟧)", r" ; ⟦said⟧ \1 "),
    (
        rf"\b(?:use|take|treat|set|make|consider|choose) (?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} )?(?:file )?(⟦[ic]\d+⟧) (?:as|for|to be|is) (?:your |the |a |my )?(?:\w+ )?(?:goal|target|"
        r"destination|reference|query|cue|waypoint|guide|hint)(?: (?:image|picture|location|place))?",
        r"go to \1",
    ),
    (
        rf"{_BEGINS}(?:please )?(?:locali[sz]e|match|recogni[sz]e|identify|load|open|process|analy[sz]e|use|view|read|import|compare|query|study|inspect|check|remember|hear|listen to|play|"
        rf"see|look at|watch|here|get)[:,]? (?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} )?(?:file )?(⟦[ic]\d+⟧),?(?=\s*(?:[.;!?,]|and\b|then\b)[^⟦]*\b(?:it|there|that|taken|shot|heard|goal|shows|go)\b)",
        r" ; ⟦said⟧ \1 ",
    ),
    (
        rf"\b(?:(?:{_DETERMINER}|some|any) )?(?:{_SPOT}|somewhere|someplace|what|where it|whatever|something)? ?(?:that |which )?(?:looks?(?: just| exactly| most| a lot)* like|"
        rf"resembl(?:es|ing)|match(?:es|ing)|(?:most )?similar to|correspond(?:s|ing) to|identical to) (?=(?:(?:{_DETERMINER}) )?(?:\w+ )?(?:{_SHOT} )?(?:file )?⟦i)",
        "",
    ),
    (rf"\b(?:the (?:\w+ )?{_SPOT} )?where (?:you|i|we|it|they)(?: can| could| last)? (?:hear|heard|recorded|saw|see|played) (?:it|that|this)(?: sound| noise)?{_NEXT}", "it"),
    (
        rf"\b(?:the (?:\w+ )?{_SPOT} (?:that |which )?(?:it|that|the (?:{_SHOT})) (?:shows|depicts|shows us|displays|was (?:taken|shot|made|recorded)(?: at| from| in)?|came from|comes from|is (?:of|from))|"
        rf"the {_SPOT} (?:shown|seen|depicted|pictured)(?: (?:in it|there|in that|on it|in the (?:{_SHOT})))?|what it shows|"
        rf"(?:its|the) (?:{_SPOT}) (?:in it|of it|on it)){_NEXT}",
        "it",
    ),
    (rf"\b(?:go|drive|head|move|navigate|come|get|take me|walk|proceed|travel|please)(?: over| back)?(?: to)? (?:to )?(?:that|this|its|the same|the) (?:exact |very |same )?{_SPOT}{_NEXT}", "go there"),
    (r"\bhere's? (?=⟦)", " ; ⟦said⟧ "),
]  # fmt: skip

_SOUNDS = [
    # "glass broke, go", "phone ringing - go to it", "footsteps! go there".
    (
        rf"(?:^|(?<=[.;!]))\s*{_NO_SUBJECT}(?!{_DETERMINER}\b)((?:(?!(?:{_GO})\b)[\w-]+ ){{0,2}}(?:{_SILENT}|(?!ring|sing|king)[\w-]*{_SOUNDING}))\s*[,.;!:]+ "
        rf"(?=(?:please |robot,? |quick(?:ly)?,? |now,? )*(?:go|drive|head|move|run|check|come|investigate|find|face|turn)\b[^.;]*(?:\b(?:there|it|that|check|source|out)\b|$))(?!\w+ to (?:the|my)\b)",
        r" ; ⟦said⟧ the sound of \1 ; ",
    ),
    (
        rf"(?:^|(?<=[.;!]))\s*{_NO_SUBJECT}(?!{_DETERMINER}\b)((?:(?!(?:{_GO})\b)[\w-]+ ){{0,2}}{_NO_SUBJECT}[\w-]+) (?:just )?({_SOUNDED})\s*[,.;!:]+ "
        rf"(?=(?:please |robot,? |quick(?:ly)?,? |now,? )*(?:go|drive|head|move|run|check|come|investigate|find|face|turn)\b)",
        r" ; ⟦said⟧ where \1 \2 ; ",
    ),
    (rf"\b(?:to|at|towards?|near|by) the direction (?=(?:that |which |where |from which |from where )?{_DETERMINER})", "the direction "),
    (
        rf"\b(?:in |into |to |towards? )?the direction (?:that |which |where |from which |from where )?((?:{_DETERMINER} )?(?!of\b)[\w -]+? (?:is |was |are |were |has been )?(?:coming|came|comes|come|heard|originated))(?: from)?\b",
        r"where \1 from",
    ),
    (rf"\bthe (?:\w+ )?(?:{_SPOT}|direction|source) (?:that|it|this|which)(?: sound| noise)? (?:came|comes|is coming|was coming|originated|originates)(?: from)?{_NEXT}", "it"),
    (r"\b(?:by|near|nearby|next to|beside|close to|from|at|in|around|behind|under) (?:which|whom) (?=\w)", "where "),
    (rf"\bfind out (?:who|what)(?:'s| is| was) (?={_SOUNDING}\b)", "find the sound of "),
    (rf"\b(?:see|check|find out|look|discover) (?:who|what)(?:'s| is| was) (?:making |causing )?(?={_DETERMINER}? ?(?:{_SOUNDING}|sound|noise)\b)", "find the sound of "),
]  # fmt: skip

_TWO = [
    (
        rf"{_BEGINS}where ([^,.;!?]+?),? there(?:'s| is| are|'re| was) ((?:{_DETERMINER}|some) [^,.;!?]+)",
        r" ; there is \2 where \1 ",
    ),
    (
        rf"{_BEGINS}((?:in|inside|near|next to|by|beside|on|at|under|behind|close to) (?:{_DETERMINER}) [^,.;!?]+?) (?:is|are|stands?|sits?|hangs?|lies|you(?:'ll| will| can)? (?:find|see|have)|we have)"
        rf"(?: located| also| standing)? ((?:an?|the|my|our|some) [^,.;!?]+?)(?=\s*[,.;!?])",
        r" ; there is \2 \1 ",
    ),
    (rf"{_BEGINS}there,? (?:you(?:'ll| will| can|'re going to| should)? (?:find|see|notice)|is|stands) (?=(?:an?|the|some|my)\b)", " there is "),
    (rf"\band (?=(?:there(?:'s| is| are)|i see|you see|i have|we have) (?:{_DETERMINER}|some)\b)", "; "),
    (r"\b(between|of|amid|in[- ]between) (?:the (?:two(?: of them)?|both|pair)|them(?: both)?|both(?: of them)?|these(?: two)?|those(?: two)?|both)\s*[:,] ?(?=(?:the|my|an?)\b)", r"\1 "),
    (rf"\b(between|of|amid|in[- ]between) (?:the two(?: of them| things| objects)?|them(?: both| two)?|both(?: of them)?|these(?: two)?|those(?: two)?|(?:these|those|the) two [\w-]+)(?=\s*(?:[.;!?,:)]|$)|\s+(?:then|please|now|and (?:{_GO}))\b)", r"\1 ⟦both⟧"),
    (
        r"\b(?:of all|among(?:st)?|out of|from)(?: all)? (?:the|those|our) ([\w -]+?)(?:(?<=[xs])es|(?<=[cs]h)es|s),? (.*?)\b(?:the|that) one (?=(?:that |which )?(?:is |that's )?(?:near|next|by|beside|in|on|at|close|under|where|behind|between|closest)\b)",
        r" \2the \1 ",
    ),
    (
        r"(?:^|(?<=[.;]))\s*(?:there are|i see|we have|you(?:'ll| will| can)? (?:see|find|have)|i have|i know)(?: got)? (?:two|three|four|several|some|many|a few|a couple of|lots of|multiple|different|\d+) "
        r"([\w -]+?)(?:(?<=[xs])es|(?<=[cs]h)es|s)(?: (?:in here|here|around|in this \w+))?[,.;:!] (.*?)\b(?:the|that) one (?=(?:that |which )?(?:is |that's )?(?:near|next|by|beside|in|on|at|close|under|where|behind|between|closest)\b)",
        r" \2the \1 ",
    ),
    (
        rf"((?:{_DETERMINER}) (?!(?:place|spot|one)\b)[\w-]+(?: (?!(?:in|over|up|down|back|out|to|go|at|on|come|drive)\b)[\w-]+)?) (?:that(?:'s| is| you(?:'ll)? find| you see) |which is )?(?:in there|inside(?: there| it)?|there)"
        rf"(?<!over there)(?<!up there)(?<!back there)(?<!down there)(?<!out there)(?<!over inside){_NEXT}",
        r"\1 ⟦inside⟧",
    ),
]  # fmt: skip

BEFORE = (*_OPENINGS, *_REPORTED, *_ASKING, *_PICTURED, *_SOUNDS, *_TWO)

_PRONOUNS = [
    # What sounded is a sound, whoever it was.
    (rf"\b(to|at|near|find|face|approach|visit|towards?|by|beside|behind|next to|join|meet|of|see|reach) (?:him|her|he|she|his place)\b{_NEXT}", r"\1 it"),
    (
        rf"((?:⟦said⟧|heard)[^;]*?[.;!?,].*?)\b(?:that|this|the(?: same)?|those) (?:sounds?|noises?|racket|din|ruckus){_NEXT}",
        r"\1it",
    ),
    # "the water was running and nobody turned it off".
    (
        rf"(⟦said⟧ [^.;!?,]+?),? (?:and|but) (?:nobody|no one|no-one|it|he|she|they|i|we|everyone|everybody|someone|somebody) [^.;!?,]+(?=[.;!?,])",
        r"\1",
    ),
    (rf"([,.;!:]|(?<=⟧))\s*(?:(?:now|please|and|so|just) )*(?:go(?: go)*|drive|head out|run)(?: now| please| robot| quick(?:ly)?)*\s*[.!]*$", r"\1 stop there"),
    (rf"\b(?:now |please |just |quick(?:ly)?,? )*go(?: and)? check{_ENDS}", "go to it"),
]  # fmt: skip

AFTER = tuple(_PRONOUNS)
