"""What people say around an order: greetings, wishes, reported speech, where somebody is, who is meant by "her".

Each entry is a pattern, matched without regard to case, and what stands instead of it. `BEFORE` apply before those of
`mentions`, `AFTER` after those of `spoken`. "⟦said⟧" begins a clause that only names a thing.
"""

from avlmaps.language.rules import words
from avlmaps.language.rules.sounds import PAST_TENSES, SOUND_VERBS

_DETERMINER = words.DETERMINER
BEGINS = r"(?:^|(?<=[.;!?,:]))\s*(?:(?:and|but|so|well|look|hey|now|listen),? )?"
ENDS = r"(?=\s*(?:[.;!?,:)]|$))"
NEXT = r"(?=\s*(?:[.;!?,:)]|$)|\s+(?:and|then|please|now|quickly)\b)"
SOUNDING = rf"(?:(?:{'|'.join(SOUND_VERBS)})[a-z]?ing|going off)"
SOUNDED = rf"(?:(?:{'|'.join(SOUND_VERBS)})[a-z]?ed|{'|'.join(PAST_TENSES)})"
GO = rf"(?:{words.MOVE}|{words.RETURN}|{words.TURN}|{words.FACE})"
NO_SUBJECT = (
    r"(?!(?:i|you|we|it|they|he|she|who|which|that|this|what|where|there|then|and|or|please|robot|just|"
    r"now|first|if|"
    rf"when|unless|until|after|before|once|not|don't|never|{GO})\b)"
)

PERSON = (
    r"(?:(?:my|our|the|your|his|her|their|a|some|little|old|poor) )*(?:wife|husband|son|daughter|mom|"
    r"mum|mommy|mummy|"
    r"dad|daddy|mother|father|brother|sister|grandma|grandpa|granny|grandmother|grandfather|kids?|child|"
    r"children|"
    r"guests?|visitors?|friends?|boss|colleagues?|neighbou?rs?|boys?|girls?|man|woman|lady|people|"
    r"somebody|someone|"
    r"everyone|everybody|he|she|they|nurse|doctor|patient|customer|student|teacher|uncle|aunt|cousin|"
    r"roommate|"
    r"flatmate|parents|grandparents|grandson|granddaughter|grandchildren|nephew|niece|family|twins|baby|plumber|"
    r"partner|girlfriend|boyfriend|delivery|postman|mailman|team)"
)
_PLACED = r"(?:in|inside|at|by|near|next to|on|beside|close to)"

_GREETINGS = (
    r"(?:oh,? (?:my|dear|no|boy|god|gosh|man|wow|yes|well)(?: (?:god|goodness|gosh))?|wow|ouch|gosh|"
    r"phew|ugh|yikes|hooray|"
    r"hurray|ahoy|great(?: news| job)?|nice(?: job| one)?|well done|good (?:morning|evening|afternoon|"
    r"day|night|job|"
    r"work|robot|boy|girl)|morning|evening|greetings|howdy|yo|sup|attention|alert|urgent|emergency|"
    r"help(?: me)?|guess "
    r"what|excuse me|pardon(?: me)?|sorry(?: to bother you)?|bonjour|hola|hallo|ciao|bitte|por favor|"
    r"s'il vous "
    r"plait|welcome(?: back)?|hi|hello|hey|ok(?:ay)?|alright|all right|thanks|thank you|come on|"
    r"let's go|here we go|"
    r"off we go|let's (?:get going|move|roll|do (?:this|it)|get moving|get started|start|see)|very well|"
    r"perfect|"
    r"awesome|cool|sure|fine|yes|yeah|yep|aye|tell you what|you know what|by the way|btw|fyi|honestly|"
    r"seriously|"
    r"quick(?:ly)?|listen(?: up)?|look here|are you (?:there|ready|free|busy|listening|awake)|"
    r"how are you(?: today| "
    r"doing)?|wake up|ready|i have a (?:job|task|question|request) for you|can you (?:help|"
    r"do me a favou?r)(?: me)?"
    r"(?: out)?|i need (?:your |some )?help|time's up|action|don't worry|no worries|never mind|"
    r"no problem|no rush)"
)
_WHO = (
    r"(?:everyone|everybody|robot|there|buddy|all|team|guys|folks|my friend|pal|mate|little (?:one|guy|"
    r"robot)|sir|ma'am)"
)
_HESITATION = (
    r"(?:u+m+|u+h+|e+r+m?|hm+|like|so(?! (?:that|the|it|you|your)\b)|well|ok(?:ay)?|yeah|hey|hi|"
    r"oh(?! (?:my|dear|no|boy|god|gosh|man)\b)|ah+|alright|anyway|dude)"
)

_OPENINGS = [
    (
        rf"^\s*(?:{_HESITATION}(?:\.\.\.|[,. ])+)+(?=\w)(?!there\b)(?!that\b)(?!robot\b)(?!robbie\b)(?!rover"
        r"\b)(?!buddy\b)",
        "",
    ),
    (
        r"(?:^|(?<=[.!?]))\s*(?:(?:and|so|but|oh(?! (?:my|dear|no|boy|god|gosh|man)\b)|"
        rf"well),? )?{_GREETINGS}(?: (?:to )?{_WHO})?\s*(?:[,.!?:;-]+\s+)(?=\w)",
        " ",
    ),
    (r",?\s+(?:u+m+|u+h+|e+rm+|you know|i mean|kinda|sort of|kind of|" r"literally),?\s+(?=(?!the\b.*[?!.,]$)\w)", " "),
    (
        r"\bi(?:'m| am| was|'ve been| have been)? (?:just |also |kind of )?(?:thinking|wondering|hoping|"
        r"thought|hope|"
        r"figured?|suggest|propose|recommend|insist|suppose|trust|pray)(?: about it)?(?: that| if| whether|"
        r",)?"
        r"(?: maybe| perhaps)?,? (?=(?:you|we|u|maybe|could|can|would)\b)",
        "",
    ),
    (
        r"\b(?:what if|suppose|maybe|perhaps|how about if) (?:you|we) (?:could |can |would |"
        r"just )?(?=\w)(?!are\b|were\b)",
        "",
    ),
    (r"\bi(?:'d| would) (?:say|suggest|recommend|propose)(?: that)? (?:you |we )?(?:should )?(?=\w)", ""),
    (
        r"\b(?:is it|would it be|is that) (?:ok|okay|alright|fine|possible)(?: (?:if|for|that) you|"
        r" with you if you)?"
        r"(?: could| can| to)? (?=\w)",
        "",
    ),
    (r"\b(?:be|you(?:'re| are)) (?:a|an|so|such an?|my) [\w ]{2,24}? (?:and|as to) (?=\w)", ""),
    (
        r"\b(?:i|we) (?:was|were|have been|'ve been|am|'m) (?:told|informed|"
        r"asked)(?: that)?,? (?=\w)(?!to\b)|"
        r"\b(?:apparently|it (?:seems|appears|looks)(?: to me)?(?: like| that| as if)?|(?:rumou?r|"
        r"legend) has it(?: that)?|word is(?: that)?|"
        r"according to [\w' ]+?),? (?=(?:the|an?|my|our|some\w*|there|your)\b)",
        "",
    ),
]

_REPORTED = [
    (
        rf"{BEGINS}{NO_SUBJECT}(?:{_DETERMINER} )?[a-z][\w'-]*(?: [a-z][\w-]+)? (?:just |also |has |"
        r"already |only )*(?:says?|said|tells? (?:me|us)|"
        r"told (?:me|us|you)|thinks?|thought|claims?|claimed|reports?|reported|mentions?|mentioned|swears?|"
        r"believes?|insists?|"
        r"complains?|complained|is saying|was saying|thinking)(?: to me)?(?: that|"
        r",)? (?!to\b)(?!so\b)(?!you\b)(?=\w)",
        " ",
    ),
    (
        rf"{BEGINS}(?:{PERSON}) (?:just |also |has |already |only |can |could )*(?:heard?|hears|"
        r"noticed) (?=(?:an?|the|some|my|our)\b)",
        " i heard ",
    ),
    (
        rf"{BEGINS}(?:{PERSON}) (?:just |also |has |already |only |can |could )*(?:saw|sees?|spotted|left|"
        r"forgot|lost|put) (?=(?:an?|the|some|my|our|his|her|their)\b)",
        " i saw ",
    ),
    # Where somebody is, is where "there" is.
    (
        rf"{BEGINS}(?:{PERSON}|i)(?:'s|'m|'re|'ll be| will be| is| am| are| was| were)(?: just| still| now|"
        rf" already| also| always| here| home| back| all| both)*(?: (?!{SOUNDING}\b)[a-z]+ing)?"
        rf"(?: for you| for me)? {_PLACED} ((?:{_DETERMINER}) [^.;!?,]+?|my [\w ]+?)(?=\s*[.;!?,]|"
        r" and (?:needs?|wants?)\b)"
        rf"(?: and (?:needs?|wants?)[^.;!?,]*)?(?=[^⟦]*\b(?:there|him|her|them|me|us|here|it)\b)",
        r" ; ⟦said⟧ \1",
    ),
    (
        r"(⟦said⟧ [^.;!?,]+[.;!?,].*?)\b(?:come|go|drive|get|roll|move|head)(?: over| up)?(?: to (?:me|us|"
        r"him|her|them|where "
        r"(?:i|we|he|she|they) (?:am|are|is))| here|,? (?:and )?(?:join|find|meet|help|see|visit) (?:me|us|"
        rf"him|her|them)){NEXT}",
        r"\1go there",
    ),
]

BEFORE = (*_OPENINGS, *_REPORTED)

_PRONOUNS = [
    # What sounded is a sound, whoever it was.
    (
        r"\b(to|at|near|find|face|approach|visit|towards?|by|beside|behind|next to|join|meet|of|see|"
        rf"reach) (?:him|her|he|she|his place)\b{NEXT}",
        r"\1 it",
    ),
    (
        r"((?:⟦said⟧|heard)[^;]*?[.;!?,].*?)\b(?:that|this|the(?: same)?|those) (?:sounds?|noises?|racket|"
        rf"din|ruckus){NEXT}",
        r"\1it",
    ),
    # "the water was running and nobody turned it off".
    (
        r"(⟦said⟧ [^.;!?,]+?),? (?:and|but) (?:nobody|no one|no-one|it|he|she|they|i|we|everyone|everybody|"
        r"someone|somebody) [^.;!?,]+(?=[.;!?,])",
        r"\1",
    ),
    (
        r"([,.;!:]|(?<=⟧))\s*(?:(?:now|please|and|so|just) )*(?:go(?: go)*|drive|head out|run)(?: now|"
        r" please| robot| quick(?:ly)?)*\s*[.!]*$",
        r"\1 stop there",
    ),
    (
        rf"(⟦[ic]\d+⟧[^;.⟦]*?)[,;.:]\s*(?:please )?(?:go|drive|come|move|navigate)(?: to)? here{ENDS}",
        r"\1; stop there",
    ),
    (rf"\b(?:now |please |just |quick(?:ly)?,? )*go(?: and)? check{ENDS}", "go to it"),
]

AFTER = tuple(_PRONOUNS)
