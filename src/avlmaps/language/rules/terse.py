"""How commands are written short, dictated, or worded by people of other languages: operators' words, logs, headings.

Each entry is a pattern, matched without regard to case, and what stands instead of it; they apply in their order,
before all others of `rewriting`. "⟦heading⟧" stands before the degrees of the compass.
"""

from avlmaps.language.rules import words

_DETERMINER = words.DETERMINER
_BEGINS = r"(?:^|(?<=[.;!?,:]))\s*"
_ENDS = r"(?=\s*(?:[.;!?,]|$))"
_MEASURE = rf"(?:\d+(?:[.,]\d+)?|{words.SPELLED})[ -]?(?:{words.UNIT})\b"
_DEGREES = rf"(?:(\d+(?:\.\d+)?|{words.SPELLED})(?: ?(?:degrees?|deg\b\.?|°))?)"
_WAY = r"(?:to (?:the |your )?)?(?:left|right)"

_SPELLING = [
    (r"^\W*(?:\d{4}-\d\d-\d\d[ t])?\d\d?:\d\d(?::\d\d(?:\.\d+)?)?\W*", ""),
    (r"(?<=[a-z])_(?=[a-z])", " "),
    (r"\bgoto\b", "go to"),
    (r"\b(?:nav|navg8|navig|navi|mov|mv|procede)(?=\.? )\.?", "go"),
    (r"\b(?:fwd|frwd|forw|fd)\b\.?", "forward"),
    (r"\b(?:bwd|bkwd|bckwd|backwd|bck)\b\.?", "backward"),
    (r"\bccw\b|\bcounter clock ?wise\b|\banti clock ?wise\b", "counterclockwise"),
    (r"\bcw\b|\bclock wise\b", "clockwise"),
    (rf"\b({words.TURN}) l\b", r"\1 left"),
    (rf"\b({words.TURN}) r\b", r"\1 right"),
    (r"\bu\b(?![- ]turn)", "you"),
    (r"\bur\b", "your"),
    (r"\b(?:pls|plz|plse|pleas|pleeease|plss|pleaze)\b", "please"),
    (r"\b(?:go|drive|come|get|move) 2 (?=(?:the|my|a)\b)", "go to "),
    (r"\b(?:wanna)\b", "want to"),
    (r"\b(?:gotta|hafta)\b", "have to"),
    (r"\b(?:gonna)\b", "going to"),
    (r"\blemme\b", "let me"),
    (r"\bgimme\b", "give me"),
    (r"\b(?:thru)\b", "through"),
    (r",? (?:will|would|wontcha|won't) (?:ya|yer|u|you)(?=\s*[.?!]|\s*$)", ""),
    (r"\b(?:ya|ye)\b", "you"),
    (r"\s*<-+\s*", ", "),
    (r"\b(?:btwn|betw)\b\.?", "between"),
    (r"\bnr\b\.?", "near"),
    (r"\b(?:infront)\b", "in front"),
    (r"\b(?:rite)\b", "right"),
    (r" @ ", " at "),
    # Dictated marks.
    (
        rf"\s*\b(?:comma|semicolon|new line|next line)\b(?= (?:then|and|{words.MOVE}|{words.TURN}|"
        rf"{words.FACE}|please)\b)",
        ",",
    ),
    (
        r"(?<!a )(?<!the )(?<!time )\s+(?:period|full stop|question mark|exclamation (?:mark|point)|" r"dot)\b(?=\s*$)",
        ".",
    ),
    (
        rf"(?<! a)(?<! the)\s+(?:period|full stop|question mark|exclamation (?:mark|point))\b"
        rf"(?= (?:then|and|now|{words.MOVE}|{words.TURN}|{words.FACE}|please)\b)",
        ".",
    ),
]

_AWAIT = (
    r"(?:(?:for )?(?:a|one|two|three|ten|five|\d+|a few|some|a couple of) (?:(?:short|"
    r"little) )?(?:seconds?|moments?|minutes?|secs?|mins?|whiles?)|a while|briefly|shortly)"
)
_NAMING = r"(?:called|named|labell?ed|id)"
_LOGS = [
    (
        rf"{_BEGINS}(?:\[?(?:info|cmd|command|action|act|exec(?:ute)?|input|user|operator|op|run|do|request|"
        r"req)\]?\s*[:=>]+|\$|>+|/(?=\w))\s*",
        " ",
    ),
    (rf"{_BEGINS}(?:robot|bot|agent|unit)(?: ?\d+)?\s*[:>]\s*", " "),
    # "goal = sink", "target pose: 1 m north of the bed", "waypoint 2: door".
    (
        rf"{_BEGINS}(?:(?:set|new|next|first|final|last|current|send|my|the|your) )*(?:(?:goal|target|"
        r"desired|final|"
        r"end|next|nav|navigation|image|object|sound) (?:pose|goal|position|location|place|point|object|"
        r"area|room|spot)|dest(?:ination)?|"
        rf"goal|target|waypoint|wp|pose|position|location|going to|go)\s*#?\d*\s*(?:[:=]+>?|->)\s*",
        " ; ⟦goal⟧ ",
    ),
    (
        rf"{_BEGINS}(?:set|new|next)(?: (?:the|your|a|new))* (?:goal|destination|target|dest|waypoint) (?:to|"
        r"is|as)(?: be)? ",
        " ; ⟦goal⟧ ",
    ),
    (rf"{_BEGINS}(?:goal|destination|dest) (?=(?:{_DETERMINER} )?[\w-]+(?: [\w-]+)?$)", " ; ⟦goal⟧ "),
    (
        r"⟦goal⟧ (?:an? )?(?=(?:between|in|at|near|next to|left|right|halfway|midway|behind|beside|to|go|"
        rf"north|south|east|west)\b|{_MEASURE})",
        "go ",
    ),
    (r"⟦goal⟧ ", "go to "),
    (
        rf"{_BEGINS}(?:sound|noise|audio)(?: event)?(?: (?:detected|heard|"
        rf"source))?\s*[:=]+\s*(?:{_DETERMINER} )?(?=\w)",
        " ; the sound of ",
    ),
    (
        rf"{_BEGINS}(?:object|item|landmark|area|room|place|region|image|photo|"
        rf"picture)\s*[:=]+\s*(?:{_DETERMINER} )?(?=\w)",
        " ; the ",
    ),
    (
        r"\b(to|towards|find) (?:the )?(?:image|photo|picture|sound|object|area|clip|audio)[ -](?:goal|"
        r"target|query)s?:? ",
        r"\1 ",
    ),
    (
        r"\b(to|find|face|near|of|at|towards?|between|and) (?:the )?(?:object|item|category|class|"
        rf"landmark)(?: {_NAMING})?:? "
        rf"(?=(?!in\b|on\b|at\b|near|next|that\b|which\b|by\b|where\b|and\b|then\b)\w)",
        r"\1 the ",
    ),
    (
        rf"\b(to|find|face|near|of|at|towards?) (?:the )?(?:area|region)(?: {_NAMING})?:? "
        r"(?=(?!in\b|on\b|at\b|near|next|that\b|which\b|by\b|where\b|and\b|then\b|of\b|to\b|around|between|"
        r"behind|with)\w)",
        r"\1 the ",
    ),
]

_PATIENCE = [
    (r"\b(where|what|who|there|that)s\b", r"\1's"),
    (r"\b(go|drive|come|get|move) 2 (?=where\b)", r"\1 to "),
    (r"(?:,| for (?:me|us)) (?:dear|hon(?:ey)?|sweetie|love|darling|over|copy|mate|pal)(?=\s*[.!?]*$)", ""),
    (r"\breport (?=to (?:the|my)\b)", "go "),
    (r"\bcome (?:right|straight|directly) back\b", "come back"),
    (rf"{_BEGINS}(?:then |and )*back here{_ENDS}", " come back"),
    (
        rf"\b(?:i|we)(?:'d| would)? (?:want|need|like) ((?:{_DETERMINER}) [\w -]+?) to be "
        r"(?=(?:on|to|at) (?:your|the) (?:left|right)\b|behind you|in front of you)",
        r"have \1 ",
    ),
    (
        rf"{_BEGINS}(?:i|we) (?:have|need|want) to find ((?:{_DETERMINER}) [^.;!?,]+?)[,.;!] "
        r"(?=[^.;]*\b(?:it|there|them)\b)",
        r" ⟦said⟧ \1 ; ",
    ),
    (r"\b(?:the (?:source|origin) of )?the (?:sound|noise) (?:in|of|from|on) (?=⟦c)", ""),
    (
        rf"{_BEGINS}((?:{_DETERMINER}) [\w-]+(?: [\w-]+)?) (?:must|should|has to|needs to|ought to|shall) be "
        r"(?=(?:right |directly )?(?:in front of|behind|ahead of) you\b)",
        r" have \1 ",
    ),
    (
        rf"{_BEGINS}(?:i|we)(?:'d| would)? (?:want|need|like|have) to (?:look at|see|inspect|"
        rf"check) ((?:{_DETERMINER}) [^.;!?,]+?)(?: again| up close)?,? (?:so|and so|that's why|"
        r"therefore)(?: please)? (?=[^.;]*\bit\b)",
        r" ⟦said⟧ \1 ; ",
    ),
    (r"\s*>+\s*(?=[a-z])", " ; "),
    (
        rf"{_BEGINS}(find|visit|approach|face|seek|locate|reach|turn|rotate|move|go to|" r"drive to) ?[:=] ?(?=\w)",
        r" \1 ",
    ),
    (
        r"\b(?:move|get|bring|haul|drag|shift|drive|put|park|take|roll) (?:your|that|its) (?:butt|self|"
        r"behind|wheels|metal|"
        r"body|tin|lazy|shiny|little|big| )+(?= (?:over |right |straight )*(?:to|into|in|at|next|near|by|"
        r"beside|between))",
        "go",
    ),
    (r"\b(?:give|do|make) (?:me|us|yourself) (?=an? )", "make "),
    (
        r"\b(?:hang out|hang around|chill|camp|loiter|live|lurk|hide|crouch|squat|land) (?=(?:in|at|near|"
        r"next|by|beside|between|on)\b)",
        "stop ",
    ),
    (r"\bright (?=in (?:the middle|between))", ""),
    (r"\b(?:arrange|align|angle|adjust|set) yourself,? (?=so|such|with)", "turn "),
    (
        r"\b(?:it|that) would (?:really )?(?:help|mean|please|make)[\w' ]*? if you (?:went|drove|could go|"
        r"would go|moved|came|go|got)",
        "go",
    ),
    (
        rf"\b({words.GO}) so (?:that )?you(?:'re| are| end up| stand| stop)? (?=(?:on|to|at) (?:the|your)|"
        r"left|right|between)",
        r"\1 ",
    ),
    (
        rf"\b(wait|stop|stay|pause|rest|stand|halt|remain)((?: there| here)?) {_AWAIT}(?=\s*(?:[.;!?,]|$)|"
        r" (?:and|then)\b)",
        r"\1\2",
    ),
    (rf",? (?:in|within|for) {_AWAIT}(?= ?[.;!?,]| and\b| then\b|\s*$)", ""),
]

_COMPASS_WORD = r"(?:compass )?(?:heading|bearing|course|azimuth|compass|orientation)"
_SETTING = (
    r"(?:(?:set|change|adjust|turn|rotate|go|come|steer|face|take|assume|hold|make|spin|"
    r"orient(?: yourself)?|"
    r"switch|move|adopt)(?: (?:to face|to|onto|on|a|an|the|your|its|absolute))* )"
)
_HEADINGS = [
    (
        rf"{_BEGINS}(?:and |then )*(?:{_SETTING}?{_COMPASS_WORD}|{_SETTING}absolute(?: angle)?)(?: "
        r"(?:direction|angle|of|to|is|at|on))*\s*"
        rf"[:=]?\s*{_DEGREES}(?: on the compass)?(?= ?[.;!?,]| and\b| then\b|\s*$)",
        r" ; ⟦heading⟧ \1 degrees ",
    ),
    (
        rf"\b(?:and |then )+{_SETTING}{_COMPASS_WORD}(?: (?:of|to|at|on))* {_DEGREES}(?= ?[.;!?,]| and\b|"
        r" then\b|\s*$)",
        r" ; ⟦heading⟧ \1 degrees ",
    ),
    (
        rf"\b(?:face|turn|rotate|look)(?: to(?:wards)?)? {_DEGREES} (?:on|of|by) (?:the|your) compass\b",
        r"⟦heading⟧ \1 degrees",
    ),
    (
        rf"\b(?:{_SETTING}{_COMPASS_WORD}|{_COMPASS_WORD})(?: (?:direction|of|to|is|at|"
        rf"due))*\s*[:=]?\s*(?:due )?({words.COMPASS}){_ENDS}",
        r"turn \1",
    ),
]

_QUARTERS = r"(?:an? |one )?(quarter|half)(?: an?| of a)?[ -](?:turn|rotation|circle)"
_TURNS = [
    (
        r"\b(?:turn |go |bear |take an? |make an? )?(?:hard|sharp|immediate|tight|full) (left|" r"right)\b(?: turn\b)?",
        r"turn \1",
    ),
    (
        rf"{_BEGINS}{_QUARTERS},? (?:to (?:the|your) )?(left|right|clockwise|counter-?clockwise)\b",
        r" turn \2 a \1 turn",
    ),
    (rf"\b((?:{words.TURN})(?: yourself)?) of (?={_DEGREES})", r"\1 by "),
    (rf"\b((?:{words.GO})(?: (?:forwards?|backwards?|back|ahead|straight))?) of (?={_MEASURE})", r"\1 "),
    (rf"\b({words.TURN}) (?:to|in) (left|right)\b", r"\1 \2"),
    (rf"{_BEGINS}(left|right) face{_ENDS}", r" turn \1"),
    (rf"{_BEGINS}(?:about face|turn about){_ENDS}", " turn around"),
    (
        rf"\b({words.TURN}) (left|right) (?=(?:\d+|{words.SPELLED})(?: (?:and|then)\b|\s*[,;.]|\s*$))(\d+|"
        rf"{words.SPELLED})",
        r"\1 \2 \3 degrees",
    ),
    # "4x: ...", "forward 1 m x 3".
    (r"\b(\d+) ?x(?= ?[:,]| (?=[a-z]+ \w))", r"\1 times"),
    (r"(?<=\w) ?(?<![0-9]x)\bx ?(\d+)(?=\s*(?:[.;,!]|$))", r" \1 times"),
    (
        r"\b(?:do|make|drive|run|walk|complete|take) (?:a|one|another|a single) (?:full )?(?:laps?|rounds?|"
        r"circles?|loops?|tours?) (?:a?round|of)\b",
        "circle",
    ),
]

# Said without a mark between two orders: "go to sink turn right go forward one meter".
_NO_NEW_ORDER = (
    r"(?<!\bto)(?<!\band)(?<!\bthen)(?<!\byou)(?<!\bplease)(?<!\bjust)(?<!\bnow)(?<!\ba)(?<!\ban)(?<!\bt"
    r"he)(?<!\bnot)"
    r"(?<!\bcan)(?<!\bwill)(?<!\bshould)(?<!\bmust)(?<!\brobot)(?<!\blets)(?<!\blet's)(?<!n't)(?<!\bor)("
    r"?<!\bbut)"
    r"(?<!\bnever)(?<!\bthat)(?<!\bfirst)(?<!\bcould)(?<!\bwould)(?<!\bkindly)(?<!\bme)(?<!\bus)(?<!\bqu"
    r"ickly)"
    r"(?<!\bslowly)(?<!\bhelp)(?<!\bpossibly)(?<!\bmaybe)(?<!\bwe)(?<!\bi)(?<!\bhave)(?<!\bso)(?<!\bbefo"
    r"re)"
    r"(?<!\bafter)(?<!\bquarter)(?<!\bhalf)(?<!\bfull)(?<!\bdegree)(?<!\bsharp)(?<!\bslight)(?<!\bonly)("
    r"?<!\bit)(?<!\bits)(?<!\byour)(?<!\bimmediately)(?<!\bgo)(?<!\bto the)(?<!\bhard)"
)
_RUN_ON = [
    (rf"(?<=\w) second(?:ly)? (?=(?:{words.GO}|{words.TURN}|{words.FACE}) )", " ; "),
    (
        rf"(?<=\w)(?<!the) (?:third|last|next)(?:ly)? (?=(?:{words.GO}|{words.TURN}|{words.FACE}) (?:to|the|"
        r"left|right)\b)",
        " ; ",
    ),
    (
        rf"(?<=[\w'⟧]){_NO_NEW_ORDER} (?=(?:turn|rotate|spin|pivot) (?:{_WAY}|a?round|back|clockwise|"
        r"counterclockwise|"
        rf"{_DEGREES}|slightly|to (?:face|the)\b|{words.COMPASS})|(?:go|move|drive|roll|walk) (?:forwards?|"
        r"backwards?|straight|ahead)\b(?= |$)|"
        r"(?:go|move|drive|walk|head|navigate) to (?:the|my)\b|face (?:the|my)\b|come back to\b|back up\b|"
        r"stop (?:between|at|near|next to)\b)"
        rf"(?<!^)",
        " ; ",
    ),
]

_WANTING = (
    r"(?:i|we|me|us)(?:'d| would|'ll)?(?: (?:really|also|just))? (?:want|need|like|wish|prefer|ask|"
    r"request|demand|"
    r"beg|love|expect)s?"
)
_VERB = rf"(?:{words.MOVE}|{words.TURN}|{words.FACE})"
_WORDING = [
    (rf"\b{_WANTING} (?:that |for )you (?:to |should |would |could |can |will )?(?:please )?(?=\w)", ""),
    (rf"\b(?:me|us) (?:want|need|like) (?:that )?you (?:to )?(?={_VERB}\b)", ""),
    (rf"\b{_WANTING} you (?=(?:go|going|drive|move|turn|come|walk|visit|face|find|stop)\b)", ""),
    (
        rf"{_BEGINS}(?:(?:and|so|then|now|because) )*(?!(?:i|we|you|it|they|who|what|he|she|where|"
        rf"that)\b)(?:{_DETERMINER} )?[a-z][\w-]*(?: [\w-]+)? (?:needs|wants|"
        r"would like|expects|requires|is asking for) you (?:to be )?(?=(?:at|in|by|near|next to|beside|on|"
        r"between|over|to the|left|right|behind)\b)",
        " i want you ",
    ),
    (
        rf"{_BEGINS}(?:(?:and|so|then|now|because) )*(?!(?:i|we|you|it|they|who|what|he|she|where|"
        rf"that)\b)(?:{_DETERMINER} )?[a-z][\w-]*(?: [\w-]+)? (?:needs|wants|"
        r"would like|expects|requires|asks?|asked|told|tells|is asking|says|said(?: for)?) (?:you |"
        r"the robot )?to (?=\w)",
        " ",
    ),
    (r"\b(?:i|we) (?:have|got|must|should|ought)(?: got)?(?: to)? (?=(?:go|get|move|visit|drive) )", ""),
    (rf"\b(?:can|could|may|shall|should|will) (?:we|i)(?: please)?(?: maybe| perhaps)? (?={_VERB}\b)", ""),
    (rf"\b(?:do|would) you (?:want|like|care)(?: to)? (?={_VERB}\b)", ""),
    (
        rf"{_BEGINS}(?:please )?you(?: please| there| now| just)? (?=(?:go|drive|move|turn|come|walk|head|"
        r"face|stop|stand|navigate|proceed|rotate|wait)\b)",
        " ",
    ),
    (
        rf"{_BEGINS}(?:the )?robot (?=(?:goes|moves|drives|turns|goes|travels|stands|stops|waits|faces|"
        r"rotates|approaches|visits)\b)",
        " ",
    ),
    (r"\bplease to (?=\w)", "please "),
    (rf"{_BEGINS}to (?=(?:go|drive|move|walk|come|face|navigate|find)\b)", " "),
    (
        r"\b(go|drive|move|walk|continue|proceed|keep going|head|advance|roll|travel)(?: on| up| straight|"
        r" ahead| forward)* (?:until|till|as far as|right up to)(?! you\b| it\b|"
        rf" the robot\b) (?={_DETERMINER}\b(?![^.;,]*\b(?:is|are|has|comes|[a-z]+ed)\b))",
        r"\1 to ",
    ),
    (r"\b(near|close|next|beside|besides) (?:of|with) (?=(?:the|a|my)\b)", "near "),
    (r"\bin (?:the )?(left|right)(?= (?:side )?of\b)", r"on the \1"),
    (rf"\b({words.GO})(?: (?:on|right|straight|over))? up (?=(?:next to|by|near|beside|close to)\b)", r"\1 "),
    (r"\b(?:kindly|please) (?:do the needful and|do)? ?(?=go\b)", ""),
    (
        r"\b(?<!the )(?<!a )(?<!exact )(?<!your )(?:nip|buzz|bolt|dart|jet|shoot|skedaddle|scuttle|bounce|"
        r"scamper|plod|toddle|tootle|gallop|fly|sail|coast|"
        r"chug|hustle|hasten|speed|scramble|waddle|sneak|sashay|schlep|bop|scoot|pop|make (?:a )?(?:dash|"
        r"run|move)|"
        r"set (?:a |your )?(?:course|sail)|(?:plot|chart|lay in) a course|make tracks|take a (?:walk|trip|"
        r"stroll|drive|ride|spin)|"
        r"cent(?:er|re)|get (?:going|moving|yourself|your (?:wheels|butt|self|behind))|do a run|target|"
        r"beam)(?: yourself)?"
        r"(?: (?:on|over|up|down|right|straight|out|back|across|along|round|around|off))* (?=(?:to|into|"
        r"towards?|for|in|next to|by|near|beside|between|at) (?!\d|half|one|two|ninety))(?:for )?",
        "go ",
    ),
    (r"\bgo (?=(?:the|my|your) (?!(?:other|opposite|whole|same|long|rest|full|entire|right|wrong)\b))", "go to "),
    (r"\b(?:head|proceed|set off|set out|aim) (?:on |over |straight )?for (?=the|a|my)", "go to "),
    (r"\bshow me where (it|that|this) (?:is|was|are)\b", "go to it"),
    (
        r"\b(?:visit|check|go to|see) (?:these|those|the following)(?: (?:places|things|objects|rooms|spots|"
        r"goals))?(?: (?:in (?:this |that )?order|in turn|one by one))?\s*[:,] ?",
        "visit ",
    ),
    (r"\bspin (?:a?round )?(once|twice|thrice|(?:\d+|two|three|four|five) times)\b", r"turn in a full circle \1"),
    (r"\bcheck (?=(?:the|my|our) [\w ]+(?:,|\band the\b|$))", "visit "),
    (rf"\b({words.GO}) so that you(?: are|'re)? (?=between|in|near|next|to the|left|right|by|at|beside)", r"\1 "),
    (
        r"\b(?:i|we) (?:require|request|need|want|demand|would like) your (?:presence|help|assistance|"
        r"services) (?=(?:at|in|by|near|next to|on|beside|between)\b)",
        "go ",
    ),
    (rf"{_BEGINS}we(?:'re| are) (?:going|moving|heading|driving|walking|off|on our way) (?:over )?(?=to\b)", " go "),
    (r"\b(?:put|turn|keep|point|have|press|with|show) your back (?:to|towards?|against|on) ", "turn your back to "),
    (r"\bmake it(?: be)? (?:so(?: that)?|such that|that)\b", "so that"),
    (
        rf"({_BEGINS}|\bso that ){_DETERMINER} ([^,.;!?]+?) (?:should|must|has to|have to|needs to|ought to|"
        r"shall|is to|is supposed to) "
        r"(?:be|end up|stay|remain|appear|come|stand|get) (?=(?:right |directly )?(?:(?:on|to|at) (?:your|"
        r"the) (?:left|right)|behind you|in front of you)\b)",
        r"\1 have the \2 ",
    ),
    (
        r"(\b(?:left|right|north|south|east|west)\b[^.;]*?),? (?:and |about |around |at |"
        rf"at a distance of )*({_MEASURE}) (?:away |apart |off |distant )?(?:from|of) (?:it|there|"
        rf"them){_ENDS}",
        r"\1, \2",
    ),
    (
        r"\b(?:that(?:'s| is| are)|which(?:'s| is| are)) (?:the )?(?:very |most )?(?:closest|nearest|close|"
        r"nearer|closer) (?:to|by) ",
        "near ",
    ),
    (rf"(?<=\w) (?:the )?(?:most )?(?:closest|nearest) (?:to )?(?=(?:{_DETERMINER}) )", " near "),
    (
        r"\b(?:whichever|whatever|any|some) ([\w -]+?) (?:is|are|that is|that's|which is) (?=(?:near|"
        r"next to|by|in|on|close to|beside|at|closest to) )",
        r"the \1 ",
    ),
    (
        r"(?<=[a-z]) (?:hanging|standing|sitting|lying|located|placed|kept|stored|parked|mounted|situated|"
        r"found) (?=(?:in|on|at|by|near|next to|under|beside|against|behind) (?:the|a|my|our)\b)",
        " ",
    ),
]

PATTERNS = (*_SPELLING, *_LOGS, *_PATIENCE, *_HEADINGS, *_TURNS, *_RUN_ON, *_WORDING)
