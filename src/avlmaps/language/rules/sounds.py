"""The words that tell a sound from a thing."""

# A sound is told from a thing by its last word: stems, which -ing and -ed follow.
SOUND_VERBS = [
    "play", "rain", "drum", "strum", "toot", "mow", "vacuum", "brew", "blar", "blast", "sizzl", "bubbl", "flow",
    "gush", "chatter", "bang", "thump", "tap", "scratch", "jingl", "groan", "moan", "sigh", "bleat", "bark", "cry",
    "weep", "ring", "tick", "break", "shatter", "sneez", "snor", "crow", "drip", "buzz", "beep", "knock", "slam",
    "hum", "roar", "crackl", "splash", "laugh", "cough", "meow", "chirp", "sing", "run", "clap", "typ", "chim",
    "clank", "clatter", "creak", "crash", "growl", "hiss", "honk", "howl", "mew", "moo", "oink", "pop", "purr",
    "quack", "rattl", "rustl", "scream", "shout", "squeak", "talk", "speak", "thud", "tweet", "whin", "whistl",
    "yell", "fall", "burst", "flush", "pour", "hammer", "drill", "saw", "click", "boil", "whisper", "rumbl", "giggl",
    "sob", "mumbl", "gurgl", "squeal", "clink", "crunch", "hoot", "croak", "wail", "trickl", "murmur", "cheer",
    "grind", "whir", "smash", "fizz", "sputter", "sniff", "chant", "argu", "squawk", "neigh", "gobbl", "cluck",
    "grunt", "hiccup", "burp", "yawn", "breath", "applaud", "explod", "vibrat", "blow", "patter",
]  # fmt: skip
SOUND_NOUNS = frozenset({
    "applause", "bang", "bark", "barking", "beeping", "buzzing", "chatter", "chirping", "clapping", "conversation",
    "coughing", "crying", "explosion", "footsteps", "knocking", "laughing", "laughter", "meow", "meowing", "music",
    "noise", "ringing", "scream", "screaming", "shouting", "singing", "siren", "sneezing", "snoring", "sobbing",
    "thud", "thunder", "thunderstorm", "typing", "whistling",
})  # fmt: skip
# What "of" makes a sound: "the bark of a dog".
NOISES = frozenset({
    "babble", "bang", "bark", "barks", "beep", "beeps", "buzz", "chatter", "chime", "chimes", "chirp", "clatter",
    "crackle", "crash", "creak", "cries", "cry", "footsteps", "growl", "hiss", "howl", "hum", "jingle", "knock",
    "laughter", "meow", "moan", "murmur", "purr", "rattle", "ring", "roar", "rumble", "rustle", "scream", "screams",
    "shout", "shouts", "snore", "snores", "sobs", "song", "splash", "squeak", "thud", "tweet", "voice", "voices",
    "whine", "whistle",
})  # fmt: skip
# What makes a thing a sound by standing before it: "the crying baby", but not "the running shoes".
SOUNDING_THINGS = frozenset({
    "barking", "beeping", "buzzing", "chirping", "coughing", "crying", "dripping", "growling", "howling", "laughing",
    "meowing", "purring", "ringing", "screaming", "shouting", "sneezing", "snoring", "sobbing", "squealing",
    "yelling",
})  # fmt: skip
PAST_TENSES = {
    "broke": "breaking", "broken": "breaking", "breaks": "breaking", "rang": "ringing", "rings": "ringing",
    "sang": "singing", "sings": "singing", "fell": "falling", "falls": "falling", "ran": "running", "runs": "running",
    "burst": "bursting", "spoke": "speaking", "crew": "crowing", "wept": "weeping", "shattered": "shattering",
    "slammed": "slamming", "dripped": "dripping", "hummed": "humming", "clapped": "clapping", "popped": "popping",
    "cried": "crying", "cries": "crying", "smashed": "smashing", "rung": "ringing", "blew": "blowing",
    "drips": "dripping", "hums": "humming", "slams": "slamming", "claps": "clapping",
    "sung": "singing", "went off": "going off",
}  # fmt: skip
