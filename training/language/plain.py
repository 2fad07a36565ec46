"""Plain commands and questions, made by a program: the words that everybody uses first, in every combination.

Writers seldom write what is plain. A reader that has seen few plain lists of goals, figures and files leaves one out.
"""

import random
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from training.language.augment import Names
from training.language.rows import Example

from avlmaps.core.words import plural_of
from avlmaps.language import intents as act
from avlmaps.language.intents import (
    Ask,
    Beside,
    Between,
    Circle,
    Clarify,
    Face,
    Go,
    If,
    Inquiry,
    Intent,
    Move,
    Pick,
    RefusalReason,
    Refuse,
    Return,
    Side,
    StopAt,
    Target,
    TargetKind,
    Turn,
    VisitEach,
    Wait,
)  # fmt: skip

VOICE = "plain"
_GO = ("go to", "drive to", "move to", "head to", "navigate to", "go over to", "find", "go and find", "proceed to",
       "drive over to", "head for", "approach")  # fmt: skip
_NEAR = ("near", "next to", "by", "beside", "close to")
_SIDES = {Side.LEFT: ("to the left of", "left of", "to the left side of"), Side.RIGHT: ("to the right of", "right of"),
          Side.FRONT: ("in front of",), Side.BEHIND: ("behind",), Side.NORTH: ("to the north of", "north of"),
          Side.SOUTH: ("to the south of", "south of"), Side.EAST: ("to the east of", "east of"),
          Side.WEST: ("to the west of", "west of")}  # fmt: skip
_THEN = (", then ", " then ", " and then ", ". ", ". Then ", "; ", ", and after that ", ", next ", ", and ", " and ",
         ", after that ", ". After that ", ", and finally ", ". Finally, ")  # fmt: skip
_FILES = ("view", "photo", "img_0231", "./a", "shots/hall", "/tmp/p_1", "kitchen2", "DSC0042")
_THESE = ("this", "this", "the attached", "that")
_COLOURS = ("red", "green", "blue", "yellow", "white", "black", "grey", "brown", "orange", "purple", "pink")
_PARTS = ("leg", "door", "handle", "top", "corner", "edge", "drawer", "end", "foot", "back")
_ORDINALS = {2: ("second", "2nd"), 3: ("third", "3rd"), 4: ("fourth", "4th"), 5: ("fifth", "5th"), 6: ("sixth",)}
_CLOSEST = {Pick.NEAREST: ("nearest", "closest"), Pick.FARTHEST: ("farthest", "furthest")}
_ENDS = (Pick.LEFT, Pick.RIGHT, Pick.NORTH, Pick.SOUTH, Pick.EAST, Pick.WEST)
_SPELLED = {2: "two", 3: "three", 4: "four", 5: "five", 10: "ten", 15: "fifteen", 20: "twenty", 30: "thirty"}
_SALAD = 0.05
_SAID = tomllib.loads(Path(__file__).with_name("plain.toml").read_text(encoding="utf-8"))
_FILLED = {
    "what": ("what is", "what's", "which is", "whats"), "whats": ("what is", "what's", "whats", "what things are"),
    "next": ("next to", "beside", "near", "close to", "by", "around", "on", "nearby"),
    "large": ("biggest", "largest"), "early": ("first", "earliest"),
}  # fmt: skip
_OPPOSITE = {
    Ask.SMALLEST_ROOM: (Ask.LARGEST_ROOM, "large", ("smallest", "tiniest")),
    Ask.LAST_SOUND: (Ask.FIRST_SOUND, "early", ("last", "latest", "most recent")),
}
_THING, _PLACE, _SOUND = (TargetKind.OBJECT,), (TargetKind.AREA, TargetKind.OBJECT), (TargetKind.SOUND,)
_RELATED = {
    Ask.WHEN: [("when", Ask.WHEN, _SOUND), ("seen", Ask.WHEN, _THING), ("often", Ask.HOW_MANY, _SOUND)],
    Ask.HEARD: [("heard", Ask.HEARD, _PLACE)], Ask.BEFORE: [("before", Ask.BEFORE, _SOUND)],
    Ask.AFTER: [("before", Ask.AFTER, _SOUND)], Ask.BETWEEN: [("between", Ask.BETWEEN, _THING)],
    Ask.MOST: [("most", Ask.MOST, _THING)],
    **{ask: [(str(ask), ask, _THING)] for ask in (Ask.ROOMS_WITH, Ask.AT_LEAST)},
}  # fmt: skip
_NUMBERS = ("one", "two", "three", "four", "five", "six")
_ALL = {"rooms": ("rooms", "areas"), "sounds": ("sounds", "noises", "sound events"), "things": ("things", "objects")}


def plain(count: int, names: Names, draw: random.Random) -> list[Example]:
    """Return plain sentences with what they mean; two thirds are commands."""
    made = _Maker(names, draw)
    kinds = draw.choices((made.command, made.question, made.with_files), (60, 30, 10), k=count)
    return [make() for make in kinds]


_COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


class _Maker:
    def __init__(self, names: Names, draw: random.Random) -> None:
        self.names, self.draw = names, draw

    def command(self) -> Example:
        if self.draw.random() < _SALAD:
            return self._salad()
        count = self.draw.choices((1, 2, 3, 4, 5, 6), (3, 4, 4, 3, 2, 1))[0]
        if self.draw.random() < 0.3:
            return self._list(max(2, count))
        if self.draw.random() < 0.25:
            return self._condition()
        if self.draw.random() < 0.2:
            return self._told() if self.draw.random() < 0.7 else self._denied()
        said, meant = zip(*(self._order() for _ in range(count)), strict=True)
        joint = self.draw.choice(_THEN) if self.draw.random() < 0.5 else None
        text = said[0]
        for each in said[1:]:
            text += (joint or self.draw.choice(_THEN)) + each
        if self.draw.random() < 0.2 and count > 1:
            text = f"first {text}"
        return self._example(text, tuple(meant))

    def question(self) -> Example:
        if self.draw.random() < 0.35:
            return self._listed()
        said, target = self._place()
        one = said.removeprefix("the ")
        plural = target.kind is TargetKind.OBJECT
        many = one.replace(target.name, plural_of(target.name), 1) if plural else one
        article = "an" if one[:1] in "aeiou" else "a"
        asks: list[tuple[str, Ask]] = [
            (said, Ask.WHERE), (one, Ask.WHERE), (f"where is {said}", Ask.WHERE), (f"find {said}", Ask.WHERE),
            (f"show me {said}", Ask.WHERE), (f"where can I find {said}", Ask.WHERE), (f"which {one}", Ask.WHERE),
        ]  # fmt: skip
        if plural:
            asks += [
                (f"how many {many} are there", Ask.HOW_MANY), (f"how many {many}", Ask.HOW_MANY),
                (f"is there {article} {one}", Ask.EXISTS), (f"are there any {many}", Ask.EXISTS),
                (f"do you see {article} {one}", Ask.EXISTS),
                *([(f"is {said}", Ask.EXISTS), (f"is {said} or not", Ask.EXISTS)] if target.near else []),
            ]  # fmt: skip
        if target.kind is TargetKind.SOUND:
            asks += [(f"where did you hear {said}", Ask.WHERE), (f"did you hear {said}", Ask.EXISTS)]
        text, ask = self.draw.choice([one for one in asks if not one[0].startswith("which") or target.near])
        text += self.draw.choice(("", "", "?", " ?", "."))
        return Example(text[0].upper() + text[1:] if self.draw.random() < 0.4 else text, Inquiry(ask, (target,)), True,
                       VOICE)  # fmt: skip

    def with_files(self) -> Example:
        """Return a sentence that speaks of files that came along, or that did not."""
        image, clip = self.draw.choice((("photo", None), (None, "clip"), ("photo", "clip"), (None, None)))
        image = image and self.draw.choice((image, self.draw.choice(_FILES) + ".png", "view.jpg"))
        clip = clip and self.draw.choice((clip, "bark.wav", self.draw.choice(_FILES) + ".ogg"))
        this_photo = f"{self.draw.choice(_THESE)} {self.draw.choice(('photo', 'picture', 'image'))}"
        this_clip = f"{self.draw.choice(_THESE)} {self.draw.choice(('recording', 'clip', 'sound', 'sound clip'))}"
        said, target = self._of(TargetKind.OBJECT)
        near = self.draw.choice(_NEAR)
        photo, sound = Target(TargetKind.IMAGE, image or ""), Target(TargetKind.CLIP, clip or "")
        if image and clip:
            joint = self.draw.choice((f"and {near}", "and", near))
            first, second, meant = f"{near} {this_photo}", this_clip, target.with_near(photo, sound)
            if self.draw.random() < 0.5:
                first, second = f"{near} {this_clip}", this_photo
            return self._of_files(f"{said} {first} {joint} {second}", meant, image, clip)
        lacks = not image and not clip
        if not lacks and self.draw.random() < 0.4:  # the other place is in words
            words, named = self._of(TargetKind.SOUND if image else TargetKind.OBJECT)
            places = [(this_photo, photo) if image else (this_clip, sound), (words, named)]
            self.draw.shuffle(places)
            (one, first), (other, second) = places
            joint = self.draw.choice((" and ", f" and {near} ", f", {near} ", f" {near} "))
            return self._of_files(f"{said} {near} {one}{joint}{other}", target.with_near(first, second), image, clip)
        if (image or lacks) and not clip and self.draw.random() < 0.25:
            text = self.draw.choice(_SAID["questions"]["photo"]) + self.draw.choice(("", "?"))
            return Example(text, None if lacks else Inquiry(Ask.ROOM_OF, (photo,)), True, VOICE, image, clip)
        place, meant = self.draw.choice((
            (f"where {this_photo} was taken", photo), (f"the place in {this_photo}", photo),
            (f"{said} {near} {this_photo}", target.with_near(photo)),
        ) if image or (lacks and self.draw.random() < 0.5) else (
            (f"{said} {near} {this_clip}", target.with_near(sound)), (f"the sound in {this_clip}", sound),
            (f"where {this_clip} was made", sound), (this_clip, sound),
        ))  # fmt: skip
        return self._of_files(place, None if lacks else meant, image, clip)

    def _of_files(self, place: str, meant: Target | None, image: str | None, clip: str | None) -> Example:
        if self.draw.random() < 0.5:
            text = self.draw.choice(("", "where is ", "find ", "show me ")) if not place.startswith("where") else ""
            asked = None if meant is None else Inquiry(Ask.WHERE, (meant,))
            return Example(text + place + self.draw.choice(("", "?")), asked, True, VOICE, image, clip)
        said, other = self._of(TargetKind.OBJECT)
        between = self.draw.random() < 0.15 and not place.startswith("where")
        text = f"stop between {place} and {said}" if between else f"{self.draw.choice(_GO)} {place}"
        if meant is None:
            return Example(text, (Clarify(),), False, VOICE, image, clip)
        return Example(text, (Between((meant, other)) if between else Go(meant),), False, VOICE, image, clip)

    def _list(self, count: int) -> Example:
        """Return goals of one kind, one behind the other."""
        kind = self.draw.choice(
            (TargetKind.OBJECT, TargetKind.OBJECT, TargetKind.SOUND, TargetKind.AREA, TargetKind.IMAGE)
        )
        parts = [self._of(kind) for _ in range(count)]
        verb, joint = self.draw.choice(_GO), self.draw.choice((*_THEN, ", "))
        repeated = self.draw.random() < 0.5
        text = f"{verb} {parts[0][0]}"
        for at, (said, _) in enumerate(parts[1:]):
            last = at == count - 2 and self.draw.random() < 0.6
            text += self.draw.choice((" and ", ", and then ", ", and finally ", " and then ")) if last else joint
            text += f"{verb} {said}" if repeated else said
        if self.draw.random() < 0.3:
            text = self.draw.choice(("first ", "First ", "please ")) + text
        return self._example(text, tuple(Go(target) for _, target in parts))

    def _listed(self) -> Example:
        """Return a question that the lists of a map answer, or none."""
        ask = self.draw.choice([None, *(ask for ask in Ask if ask.is_listed)])
        name = str(ask).removeprefix("count_")
        written, filled = ask, {key: self.draw.choice(words) for key, words in _FILLED.items()}
        if ask is not None and ask in _OPPOSITE and (ask not in _SAID["questions"] or self.draw.random() < 0.7):
            written, key, words = _OPPOSITE[ask]
            filled[key] = self.draw.choice(words)
        elif name in _ALL:
            written = Ask.ROOMS if ask == name else Ask.COUNT_ROOMS
            filled |= {"all": self.draw.choice(_ALL[name]), "each": name.removesuffix("s")}
        if ask is not None and ask in _RELATED:
            return self._related(_RELATED[ask])
        (room, area), (thing, object_) = self._of(TargetKind.AREA), self._of(TargetKind.OBJECT)
        if ask is Ask.ROOM_OF and self.draw.random() < 0.3:
            thing, object_ = self._of(TargetKind.SOUND)
        of = () if ask is None or ask.of_map else (area if ask is Ask.CONTENTS else object_,)
        text = self.draw.choice(_SAID["questions"][written or "refuse"])
        if "{all}" in text and "hear" in text and name != "sounds":
            return self._listed()
        filled["many"] = plural_of(object_.name)
        return self._asked(text.format(**filled, room=room, thing=thing), None if ask is None else Inquiry(ask, of))

    def _related(self, choices: Sequence[tuple[str, Ask, Sequence[TargetKind]]]) -> Example:
        """Return a question of sounds in time, of two things, or of a number of things."""
        (written, ask, kinds), number = self.draw.choice(choices), self.draw.randint(2, 6)
        (thing, target), (other, second), (room, area) = map(
            self._of, (*(self.draw.choice(kinds) for _ in "12"), TargetKind.AREA)
        )
        text = self.draw.choice(_SAID["questions"][written])
        more, words = _NUMBERS[number - 2 : number]
        least = (f"at least {words}", f"at least {number}", f"{words} or more", f"more than {more}", words)
        said = {key: self.draw.choice(each) for key, each in _FILLED.items()} | {
            "thing": thing, "other": other, "room": room, "early": str(ask), "many": plural_of(target.name),
            "by": "in" if target.kind is TargetKind.AREA else self.draw.choice(("near", "next to", "by", "around")),
            "number": self.draw.choice(least),
        }  # fmt: skip
        of = target.with_near(area) if "{room}" in text else target
        return self._asked(
            text.format(**said), Inquiry(ask, (of, second) if ask.of_two else (of,), number if ask.is_numbered else 1)
        )

    def _asked(self, text: str, meant: Inquiry | None) -> Example:
        text = self.draw.choice(_SAID["questions"]["polite"]) + text + self.draw.choice(("", "", "?", " ?", "."))
        return Example(text, meant, True, VOICE)

    def _condition(self) -> Example:
        """Return a command whose steps depend on whether the map has a thing, or on what no map says."""
        thing, words = self._sought()
        (do, meant), (other, instead), said = self._steps(), self._steps(), _SAID["conditions"]
        if self.draw.random() < 0.15:
            has = self.draw.choice(said["cannot"]).format(b=thing.name, room=self._of(TargetKind.AREA)[0])
            text = self.draw.choice((f"{has}, {do}", f"{has} {do}", f"{do} {has}", f"{has} {do}, otherwise {other}"))
            return self._example(text, (Refuse(RefusalReason.CONDITION),))
        if self.draw.random() < 0.15:
            has = self.draw.choice(said["placed" if words["where"] and self.draw.random() < 0.3 else "has"]).format(
                **words
            )
            never = self.draw.choice(said["forbids"]).format(b=words["b"])
            end = self.draw.choice(("", "", "", f"{self.draw.choice(said['else'])}{other}", f". {do}"))
            return self._example(
                f"{has}{self.draw.choice((', ', ' ', ', then '))}{never}{end}", (Refuse(RefusalReason.NEGATION),)
            )
        own, placed = self.draw.random() < 0.6, words["where"] and self.draw.random() < 0.4
        if own:
            do, one = self._with(thing, self.draw.choice(said["one"]).format(b=thing.name))
            meant = (one,)
        drawn, joint = self.draw.random(), self.draw.choice((", ", ", then ", " ", ", ", " then "))
        if drawn < 0.25:
            has = self.draw.choice(said["misplaced" if placed else "unless"]).format(**words)
            does = If(thing, (), instead)
            text = self.draw.choice((f"{has}{joint}{other}", f"{has}, {other}", f"{other} {has}"))
            if own and self.draw.random() < 0.3:
                joints = [one for one in said["else"] if "else" in one or "otherwise" in one.lower()]
                text, does = f"{has}{joint}{other}{self.draw.choice(joints)}{do}", If(thing, meant, instead)
            return self._behind_another(text, does)
        if drawn < 0.4:
            text = self.draw.choice(said["asks"]).format(do=do, **words)
        elif drawn < 0.55:
            do, one = self._with(thing, f"the {words['b']}")
            text, meant = self.draw.choice(said["behind"]).format(do=do), (one,)
        else:
            has = self.draw.choice(said["placed" if placed else "has"]).format(**words)
            text = f"{has}{joint}{do}" if own or self.draw.random() < 0.6 else f"{do} {has}"
        if self.draw.random() < 0.6:
            return self._behind_another(text + self.draw.choice(said["else"]) + other, If(thing, meant, instead))
        return self._behind_another(text + self.draw.choice(("", "", "", *said["nothing"])), If(thing, meant))

    def _told(self) -> Example:
        """Return an order about a thing whose place another clause tells; sometimes another thing's place is told."""
        said, name, others = _SAID["told"], self._of(TargetKind.OBJECT)[1].name, []
        for _ in range(self.draw.choice((1, 1, 1, 2))):
            kind = self.draw.choice((TargetKind.OBJECT, TargetKind.OBJECT, TargetKind.AREA))
            words, other = self._of(kind)
            others.append((f"{'in' if kind is TargetKind.AREA else self.draw.choice(said['near'])} {words}", other))
        where = self.draw.choice((" ", " and ")).join(words for words, _ in others)
        thing = Target(TargetKind.OBJECT, name).with_near(*(other for _, other in others))
        (do, meant), tells = self._with(thing, self.draw.choice(said["it"]).format(b=name)), "tells"
        drawn, words = self.draw.random(), self.draw.choice(("", "", "", f"{self.draw.choice(_COLOURS)} ")) + name
        if drawn < 0.2:  # of another thing
            words = self._of(TargetKind.OBJECT)[1].name
            do, meant = self._with(Target(TargetKind.OBJECT, name), f"the {name}")
        elif drawn < 0.4:
            do, meant = self._with(thing, f"the {name}")
            tells = "tells_after"
        elif words != name:
            meant = act.on_targets(meant, lambda one: replace(one, name=words) if one.name == name else one)
        article = "an" if words[0] in "aeiou" else "a"
        told = self.draw.choice(said[tells]).format(
            a=f"{article} {words}", b=words, where=where, places=where.split(" ", 1)[1]
        )
        after, does = self._order() if self.draw.random() < 0.3 else ("", None)
        text = f"{do}{told}" if tells == "tells_after" else f"{told}{self.draw.choice(said['then'])}{do}"
        text += f"{self.draw.choice(_THEN)}{after}" if does else ""
        return self._example(text, (meant, does) if does else (meant,))

    def _denied(self) -> Example:
        """Return an order in which one thing is named and another one denied."""
        (said, target), (wrong, other) = self._place(), self._place()
        head = self._of(TargetKind.OBJECT)[1].name
        if self.draw.random() < 0.3:
            first, second = self.draw.sample(_COLOURS, 2)
            pair = [(f"the {first} {head}", f"the {second} one"), (f"the {first} one", f"the {second} {head}")]
            (said, wrong), target = self.draw.choice(pair), Target(TargetKind.OBJECT, f"{first} {head}")
        elif other.kind is not target.kind or set(wrong.split()) & set(said.split()) - {"the", "a", "my"}:
            return self._denied()
        text = self.draw.choice(_SAID["told"]["denies"]).format(go=self.draw.choice(_GO), yes=said, no=wrong)
        return self._example(text, (Go(target),))

    def _sought(self) -> tuple[Target, dict[str, str]]:
        """Return a thing or a room that a map may have, and its words: with an article, without, and several."""
        kind = self.draw.choice((TargetKind.OBJECT, TargetKind.OBJECT, TargetKind.OBJECT, TargetKind.AREA))
        name, place = self._of(kind)[1].name, ""
        thing = Target(kind, name)
        if kind is TargetKind.OBJECT and self.draw.random() < 0.4:
            near, other = self._of(self.draw.choice((TargetKind.OBJECT, TargetKind.AREA, TargetKind.AREA)))
            place = f" {'in' if other.kind is TargetKind.AREA else self.draw.choice(_NEAR)} {near}"
            thing = thing.with_near(other)
        article = "an" if name[0] in "aeiou" else "a"
        return thing, {
            "a": f"{article} {name}{place}", "b": f"{name}{place}", "things": f"{plural_of(name)}{place}", "name": name,
            "where": place.strip(),
        }  # fmt: skip

    def _with(self, thing: Target, said: str) -> tuple[str, Intent]:
        """Return an order about a thing that is said by a pronoun or its name."""
        if said == "there" or self.draw.random() < 0.6:
            verb = self.draw.choice(_GO)
            return f"{verb.removesuffix(' to')} there" if said == "there" else f"{verb} {said}", Go(thing)
        amount, metres = self._metres()
        return self.draw.choice((
            (f"face {said}", Face(thing)), (f"look at {said}", Face(thing)), (f"circle {said}", Circle(thing)),
            (f"drive around {said}", Circle(thing)), (f"stop {amount} from {said}", StopAt(thing, metres)),
            (f"approach {said} to within {amount}", StopAt(thing, metres)),
            (f"go halfway to {said}", Between((Target(TargetKind.HERE), thing))),
            (f"go {amount} behind {said}", Beside(thing, Side.BEHIND, metres)),
        ))  # fmt: skip

    def _behind_another(self, text: str, does: Intent) -> Example:
        if self.draw.random() < 0.8:
            return self._example(text, (does,))
        first, before = self._go()
        return self._example(f"{first}{self.draw.choice(_THEN)}{text}", (before, does))

    def _steps(self) -> tuple[str, tuple[Intent, ...]]:
        """Return one order, or two."""
        orders = [self._order() for _ in range(self.draw.choice((1, 1, 1, 2)))]
        joint = self.draw.choice((" and ", " and then ", ", then "))
        return joint.join(said for said, _ in orders), tuple(meant for _, meant in orders)

    def _counted(self) -> tuple[str, Target]:
        """Return a thing that is counted from an end of its row, or from the nearest."""
        name = self._of(TargetKind.OBJECT)[1].name
        number = self.draw.choice((1, 2, 2, 2, 3, 3, 4, 5, 6))
        nth = "" if number == 1 else self.draw.choice(_ORDINALS[number])
        near, place = (), ""
        if self.draw.random() < 0.25:
            where, area = self._of(TargetKind.AREA)
            near, place = (area,), f" in {where}"
        if self.draw.random() < 0.4 and number > 1:
            pick = self.draw.choice(list(_CLOSEST))
            order = self.draw.choice(_CLOSEST[pick])
            said = self.draw.choice((f"the {nth} {order} {name}", f"the {nth}-{order} {name}", f"{nth} {order} {name}"))
            return said + place, Target(TargetKind.OBJECT, name, near, pick, number)
        pick = self.draw.choice(_ENDS)
        end = self.draw.choice((f"the {pick}", f"the {pick}", f"the {pick} end", f"{pick}", f"the {pick} side"))
        if number == 1:
            most = f"{pick}most" if pick in (Pick.LEFT, Pick.RIGHT) else f"{pick}ernmost"
            far = self.draw.choice(("furthest", "farthest", "most"))
            said = self.draw.choice((
                f"the {most} {name}", f"the {most} {name}", f"the first {name} from {end}", f"the {name} at {end}",
                f"the {name} {far} to the {pick}", f"the {name} that is {far} to the {pick}",
                f"the {name} {far} {pick}", f"the {pick} one of the two {plural_of(name)}",
                f"the {name} that is the {far} to the {pick}",
            ))  # fmt: skip
        else:
            said = self.draw.choice((
                f"the {nth} {name} from {end}", f"{nth} {name} from {end}", f"the {name} that is {nth} from {end}",
                f"the {nth} {name}, counting from {end}", f"the {name}, {nth} from {end}",
            ))  # fmt: skip
        return said + place, Target(TargetKind.OBJECT, name, near, pick, number)

    def _order(self) -> tuple[str, Intent]:
        orders: tuple[Callable[[], tuple[str, Intent]], ...] = (
            self._go, self._go, self._go, self._turn, self._move, self._face, self._between, self._beside, self._stop,
            self._circle, self._wait,
        )  # fmt: skip
        return self.draw.choice(orders)()

    def _go(self) -> tuple[str, Intent]:
        said, target = self._place() if self.draw.random() < 0.85 else self._counted()
        if self.draw.random() < 0.08:
            return self.draw.choice((("come back", Return()), ("return to the start", Return())))
        if self.draw.random() < 0.06 and target.kind is TargetKind.OBJECT and not target.near:
            return f"visit each of the {plural_of(target.name)}", VisitEach(target)
        return f"{self.draw.choice(_GO)} {said}", Go(target)

    def _turn(self) -> tuple[str, Intent]:
        side = self.draw.choice((-1, 1))
        word = "left" if side < 0 else "right"
        degrees = self.draw.choice((30, 45, 60, 90, self.draw.randint(1, 179)))
        unit = self.draw.choice((" degrees", " degrees", " deg", "°"))
        if self.draw.random() < 0.25:
            heading = self.draw.randrange(0, 360, 45)
            point = _COMPASS[heading // 45].replace("-", self.draw.choice(("", "-", " ")))
            return f"{self.draw.choice(('turn', 'turn to the', 'face', 'look', 'head'))} {point}", Turn(
                None, float(heading)
            )
        return self.draw.choice((
            (f"turn {word}", Turn(90.0 * side)), (f"turn {word} {degrees}{unit}", Turn(float(degrees * side))),
            (f"turn {degrees}{unit} {word}", Turn(float(degrees * side))),
            (f"turn to the {word} by {degrees}{unit}", Turn(float(degrees * side))),
            ("turn around", Turn(180.0)), (f"rotate {degrees}{unit} to the {word}", Turn(float(degrees * side))),
        ))  # fmt: skip

    def _metres(self) -> tuple[str, float]:
        metres = self.draw.choice(
            (1.0, 2.0, 3.0, 0.5, round(self.draw.uniform(0.1, 99.9), self.draw.choice((0, 1, 2))))
        )
        metres = max(0.1, metres)
        unit = self.draw.choice((" metres", " meters", " m", "m"))
        return (f"{metres:g}{unit}", metres)

    def _move(self) -> tuple[str, Intent]:
        said, metres = self._metres()
        forward = self.draw.random() < 0.65
        verb = self.draw.choice(("move", "go", "drive"))
        where = self.draw.choice(("forward", "forwards", "ahead") if forward else ("back", "backwards", "backward"))
        text = f"{verb} {where} {said}" if self.draw.random() < 0.7 else f"{verb} {said} {where}"
        return text, Move(metres if forward else -metres)

    def _face(self) -> tuple[str, Intent]:
        said, target = self._place() if self.draw.random() < 0.93 else self._counted()
        return f"{self.draw.choice(('face', 'look at', 'turn to', 'turn towards'))} {said}", Face(target)

    def _between(self) -> tuple[str, Intent]:
        (a, one), (b, other) = self._place(), self._place()
        if one == other:
            return self._go()
        verb = self.draw.choice(("move in between", "go between", "stand between", "stop between", "move between"))
        return f"{verb} {a} and {b}", Between((one, other))

    def _beside(self) -> tuple[str, Intent]:
        said, target = self._of(TargetKind.OBJECT)
        side = self.draw.choice(list(_SIDES))
        words = self.draw.choice(_SIDES[side])
        if self.draw.random() < 0.4:
            amount, metres = self._metres()
            return f"{self.draw.choice(('stop', 'stand', 'go'))} {amount} {words} {said}", Beside(target, side, metres)
        return f"{self.draw.choice(('go', 'move', 'stand', 'stop', 'drive'))} {words} {said}", Beside(target, side)

    def _stop(self) -> tuple[str, Intent]:
        (said, target), (amount, metres) = self._of(TargetKind.OBJECT), self._metres()
        return f"{self.draw.choice(('stop', 'stand', 'stay'))} {amount} from {said}", StopAt(target, metres)

    def _circle(self) -> tuple[str, Intent]:
        said, target = self._of(TargetKind.OBJECT) if self.draw.random() < 0.85 else self._counted()
        return f"{self.draw.choice(('circle', 'drive around', 'go around', 'go round'))} {said}", Circle(target)

    def _wait(self) -> tuple[str, Intent]:
        verb = self.draw.choice(("wait", "wait", "wait", "wait here", "pause", "stay there", "hold on"))
        count, unit = self.draw.choice((2, 5, 10, 20, 30, self.draw.randint(1, 59))), self.draw.choice((1.0, 1.0, 60.0))
        names = ("second", "sec", "s") if unit == 1.0 else ("minute", "minute", "min")
        number = self.draw.choice((str(count), str(count), _SPELLED.get(count, str(count))))
        if self.draw.random() < 0.15:
            count, number = 1, "a" if unit > 1.0 else "one"
        name = self.draw.choice(names)
        ending = "s" if count > 1 and len(name) > 1 else ""
        return f"{verb} {self.draw.choice(('', 'for '))}{number} {name}{ending}", Wait(count * unit)

    def _place(self) -> tuple[str, Target]:
        """Return a target in words, with or without what it is near."""
        kind = self.draw.choices(
            (TargetKind.OBJECT, TargetKind.SOUND, TargetKind.AREA, TargetKind.IMAGE, TargetKind.CLIP),
            (8, 3, 2, 1.5, 0.5),
        )[0]
        said, target = self._of(kind)
        if kind in (TargetKind.AREA, TargetKind.CLIP) or self.draw.random() < 0.5:
            return said, target
        if self.draw.random() < 0.06 and kind is TargetKind.OBJECT:
            part = self.draw.choice(_PARTS)
            return f"the {part} of {said}", Target(TargetKind.OBJECT, part, (target,))
        near: list[Target] = []
        for at in range(self.draw.choices((1, 2, 3), (7, 2, 1))[0]):
            other = self.draw.choice((TargetKind.OBJECT, TargetKind.SOUND, TargetKind.AREA, TargetKind.IMAGE))
            where, each = self._of(other)
            joint = (
                "in"
                if other is TargetKind.AREA
                else self.draw.choice(("and", *_NEAR))
                if at
                else self.draw.choice(_NEAR)
            )
            if other is TargetKind.AREA or near[-1:] == [] or near[-1].kind is not TargetKind.AREA:
                said += f" {joint} {where}"
                near.append(each)
        return said, target.with_near(*near)

    def _of(self, kind: TargetKind) -> tuple[str, Target]:
        if kind in (TargetKind.IMAGE, TargetKind.CLIP):
            ending = self.draw.choice(
                (".png", ".jpg", ".jpeg") if kind is TargetKind.IMAGE else (".wav", ".ogg", ".flac")
            )
            name = self.draw.choice(_FILES) + ending
            words = (
                ("the image", "the picture", "the photo")
                if kind is TargetKind.IMAGE
                else ("the sound", "the recording")
            )
            return f"{self.draw.choice(words)} {name}", Target(kind, name)
        name = self.names.draw(kind, self.draw)
        if kind is TargetKind.OBJECT and self.draw.random() < 0.05:
            name = f"{self.draw.choice(_COLOURS)} {self.draw.choice(('thing', 'object', 'box', 'one'))}"
        if kind is TargetKind.SOUND:
            return self.draw.choice((f"the sound of {name}", f"the sound of {name}", f"the {name} sound")), Target(
                kind, name
            )
        return f"{self.draw.choice(('the', 'the', 'the', 'a', 'my'))} {name}", Target(kind, name)

    def _salad(self) -> Example:
        """Return words in no order, which mean nothing."""
        words = " ".join(self._order()[0] for _ in range(3)).split()
        self.draw.shuffle(words)
        return self._example(" ".join(words[: self.draw.randint(4, 12)]), (Clarify(),))

    def _example(self, text: str, meant: tuple[Intent, ...]) -> Example:
        if self.draw.random() < 0.4:
            text = text[0].upper() + text[1:] + self.draw.choice((".", ".", "!", ""))
        return Example(text, meant, False, VOICE)
