"""From a reading to intents: orders in the order of doing, references resolved, corrections and repetitions applied."""

from dataclasses import dataclass, field, replace
from math import copysign
from typing import Any

from avlmaps.language.chart import Tree
from avlmaps.language.intents import (
    Beside,
    Between,
    Clarify,
    Face,
    Go,
    Intent,
    Kind,
    Move,
    Reason,
    Refuse,
    Repeat,
    Return,
    StopAt,
    Target,
    Turn,
    VisitEach,
    Wait,
)
from avlmaps.language.orders import MOST_TIMES, count_of, intents_of, on_targets, refuse
from avlmaps.language.readings import Item, Reading, Sentence
from avlmaps.language.targets import Memory, UnresolvedError, resolve

_SMALL_TALK = 5  # words of chat or of a question beside an order
_SPEAKING = frozenset({"tell", "say", "sing", "translate", "explain", "write"})
_HARD = frozenset({".", "!", "?", ";"})


@dataclass(frozen=True, slots=True)
class Composed:
    """The meaning of a reading.

    Attributes:
        intents: in the order of doing; empty where ``stop`` says why.
        stop: a refusal or a question instead.
        notes: how words were taken.
        skipped: words that the reading leaves out and that may matter.
    """

    intents: tuple[Intent, ...]
    stop: Refuse | Clarify | None
    notes: tuple[str, ...]
    skipped: tuple[str, ...]


@dataclass(slots=True)
class _Group:
    """Intents of one order, or of names that continue it."""

    intents: list[Intent]
    kind: str = "go"
    sentence: int = 0


@dataclass(slots=True)
class _Composer:
    sentence: Sentence
    memory: Memory = field(default_factory=Memory)
    groups: list[_Group] = field(default_factory=list)
    held: list[_Group] = field(default_factory=list)  # orders said after "before ..." that come first
    notes: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    join: str = ""  # BEFORE, AFTER, BUT_FIRST or CORRECT, until the next order
    number: int = 0  # of the sentence
    loop_from: int | None = None  # the group where a repetition of all that follows begins
    loop_times: int = 1
    moved: bool = False  # whether an order was put before another
    listing: bool = False  # whether "and" or "then" stands before the next name

    def item(self, item: Item, rest: tuple[Item, ...], before: Item | None) -> None:  # noqa: C901
        match item.kind:
            case "order":
                self.order(item, rest, before)
            case "bare":
                self.bare(item.value, rest)
            case "amount":
                self.amount(item.value)
            case "mention":
                self.mention(item.value)
            case "repeat":
                self.repeat(item.value, rest)
            case "THEN" if (
                item.value == "first"
                and not self.moved
                and len(self.groups) > 1
                and not any(one.kind in ("order", "bare") for one in rest)
            ):
                self.groups.insert(-1, self.groups.pop())
            case "THEN" | "mark" | "BUT":
                self.boundary(item)
            case "BEFORE":
                said = self.groups and self.groups[-1].sentence == self.number
                self.join = "" if said else "BEFORE"
            case "AFTER":
                said = self.groups and self.groups[-1].sentence == self.number
                self.join = "AFTER" if said and not (before is not None and before.kind in ("THEN", "mark")) else ""
            case "BUT_FIRST":
                self.join = "BUT_FIRST" if self.groups else ""
            case "CORRECT" | "MAKE_IT":
                self.join = "CORRECT" if self.groups else self.join
            case "THOUGH" if (
                len(self.groups) > 1 and not rest and item.value in ("first", "beforehand", "first though")
            ):
                self.groups.insert(-1, self.groups.pop())
            case "remark":
                self.files_of(item)
            case "skip":
                self.files_of(item)
                self.skipped.append(self.sentence.words(item.start, item.end))
            case _:
                pass

    def files_of(self, item: Item) -> None:
        """Remember the files that a remark names."""
        for token in self.sentence.tokens[item.start : item.end]:
            if token.kind in ("image", "clip"):
                self.memory.add(Target(Kind(token.kind), token.text))
                return
        if item.kind == "remark" and not self.groups:
            self.named_in(item)

    def named_in(self, item: Item) -> None:
        """Remember the first sound or thing that a remark names, for an "it" that follows."""
        for rule in ("clause_said", "strict_said"):
            for at in range(item.start, item.end):
                found = [edge for edge in self.sentence.chart.edges(rule, at) if edge.end <= item.end]
                if found:
                    best = max(found, key=lambda edge: (edge.end, -edge.cost))
                    self.memory.add(resolve(best.value, self.memory))
                    return

    def boundary(self, item: Item) -> None:
        words = self.sentence.words(item.start, item.end).strip()
        self.listing = words not in (",", "-", "(", ")", ".", ":")
        if self.sentence.words(item.start, item.end).strip() in _HARD and self.held and self.groups:
            self.flush()
        if self.sentence.words(item.start, item.end).strip() in _HARD:
            self.number += 1

    def amount(self, tree: Tree) -> None:
        """Correct the amount of the last order: "2 metres, no, 3 metres"."""
        last = self.groups[-1].intents[-1] if self.groups and self.join == "CORRECT" else None
        self.join = ""
        if isinstance(last, Move | Beside | StopAt) and tree.get("metres") is not None:
            metres = float(tree.get("metres"))
            back = isinstance(last, Move) and last.metres < 0
            self.groups[-1].intents[-1] = replace(last, metres=-metres if back else metres)
        elif self.groups and isinstance(self.groups[-1].intents[-1], Turn) and tree.get("metres") is not None:
            self.groups.append(_Group([Move(float(tree.get("metres")))], "move", self.number))
        elif self.groups and self.groups[-1].intents[-1] == Wait(None) and tree.get("seconds") is not None:
            self.groups[-1].intents[-1] = Wait(float(tree.get("seconds")))
        elif isinstance(last, Turn) and last.degrees is not None and tree.get("degrees") is not None:
            self.groups[-1].intents[-1] = replace(last, degrees=copysign(float(tree.get("degrees")), last.degrees))
        elif isinstance(last, Wait) and tree.get("seconds") is not None:
            self.groups[-1].intents[-1] = Wait(float(tree.get("seconds")))
        elif isinstance(last, Repeat) and count_of(tree.get("times")):
            self.groups[-1].intents[-1] = replace(last, times=int(count_of(tree.get("times")) or 1))
        else:
            raise UnresolvedError(Clarify("What is this amount for? Say it with the order."))

    def flush(self) -> None:
        self.groups += self.held
        self.held = []

    def order(self, item: Item, rest: tuple[Item, ...], before: Item | None) -> None:
        tree = item.value
        if isinstance(tree, Tree) and tree.rule == "refuse":
            raise UnresolvedError(refuse(tree.get("reason")))  # type: ignore[arg-type]
        found, notes = intents_of(tree, self.memory)
        intents = list(found)
        self.notes += notes
        if isinstance(tree, Tree) and tree.get("arrive") and self.groups:
            last = self.groups[-1].intents[-1]
            if isinstance(last, Go) and intents == [last]:
                return
            if before is not None and before.kind == "order":
                self.join = "AFTER"
        if self.groups and self.groups[-1].kind in ("beside", "between", "standoff") and _is_there(tree):
            return
        if self.is_pointed_out(item, rest):
            return
        if isinstance(tree, Tree) and tree.rule == "on_way" and not self.groups:
            self.held.append(_Group(intents, "go", self.number))
            return
        if self.groups and self.groups[-1].kind == "lead" and self.groups[-1].sentence == self.number:
            intents = self.led(intents)
        self.place(_Group(intents, tree.rule if isinstance(tree, Tree) else "go", self.number))

    def is_pointed_out(self, item: Item, rest: tuple[Item, ...]) -> bool:
        """Return whether an order only points at a thing: "see that vase? Circle it"."""
        tokens = self.sentence.tokens
        asked = item.end < len(tokens) and tokens[item.end].text == "?"
        return asked and tokens[item.start].text in ("see", "spot", "remember") and self.is_referred_to(rest)

    def led(self, intents: list[Intent]) -> list[Intent]:
        """Return an order after "in the kitchen, ...": a thing is the one in there; anything else is done there."""
        first, lead = intents[0], self.groups[-1].intents[0]
        if not isinstance(first, Go | Face) or not isinstance(lead, Go) or first.to in self.memory.targets[:-1]:
            return intents
        if first.to.kind is Kind.OBJECT and not first.to.near:
            self.groups.pop()
            changed = first.to.with_near(Target(lead.to.kind, lead.to.name), *lead.to.near)
            self.memory.add(changed)
            return [replace(first, to=changed), *intents[1:]]
        return intents

    def place(self, group: _Group) -> None:
        join, self.join = self.join, ""
        if join == "BEFORE":
            self.held.append(group)
        elif join in ("AFTER", "BUT_FIRST"):
            self.moved = True
            self.groups.insert(len(self.groups) - 1, group)
        elif join == "CORRECT" and self.groups:
            self.groups[-1] = group
        else:
            self.groups.append(group)

    def bare(self, tree: Any, rest: tuple[Item, ...]) -> None:
        target = resolve(tree.get("to") if isinstance(tree, Tree) and tree.rule == "bare" else tree, self.memory)
        refining = isinstance(tree, Tree) and isinstance(tree.get("to"), Tree) and tree.get("to").get("one") == "yes"
        correcting = self.join == "CORRECT" or (refining and bool(self.groups) and not self.listing)
        if not correcting and self.is_referred_to(rest) and not self.continues():
            self.memory.add(target)
            return
        self.memory.add(target)
        kind = self.groups[-1].kind if self.groups and (correcting or self.continues()) else "go"
        if correcting and self.groups:
            self.join = ""
            group = self.groups[-1]
            if refining:  # "the table in the hall, the one with the vase": both say where it is
                target = target.with_near(*_near_of(group.intents[-1], target))
                self.memory.add(target)
            group.intents[-1] = _with_target(group.intents[-1], target)
            return
        intent: Intent = Face(target) if kind == "face" else VisitEach(target) if kind == "each" else Go(target)
        if self.continues() and not self.join and not self.held:
            self.groups[-1].intents.append(intent)
            return
        self.place(_Group([intent], kind, self.number))

    def continues(self) -> bool:
        return (
            bool(self.groups)
            and self.groups[-1].sentence == self.number
            and self.groups[-1].kind in ("go", "face", "each")
        )

    def is_referred_to(self, rest: tuple[Item, ...]) -> bool:
        following = next((item for item in rest if item.kind in ("order", "refuse")), None)
        return following is not None and following.kind == "order" and _refers(following.value)

    def mention(self, tree: Any) -> None:
        if not isinstance(tree, Tree):
            self.memory.add(resolve(tree, self.memory))
            return
        for name in ("a", "b"):
            if tree.get(name) is not None:
                self.memory.add(resolve(tree.get(name), self.memory))
        if tree.get("a") is not None:
            return
        base = tree.get("to") or tree.get("sound")
        near: list[Target] = []
        for at in tree.all("at"):
            whole = resolve(Tree("target", (("at", at),), 0, 0), self.memory)
            near += [Target(whole.kind, whole.name, (), whole.pick), *whole.near]
        if base is None and not near:
            return
        if tree.get("same") == "yes":
            last = self.memory.last("it")
            better = last.with_near(*near)
            self.memory.targets.remove(last)
            self.memory.add(better)
            for group in self.groups:
                group.intents = [
                    on_targets(one, lambda target: better if target == last else target) for one in group.intents
                ]
            return
        target = resolve(base, self.memory).with_near(*near) if base is not None else near[0].with_near(*near[1:])
        self.memory.add(target)
        if tree.get("who") is not None and str(tree.get("who")) in ("i", "we", "we all", "we are all"):
            self.memory.speaker = target

    def repeat(self, tree: Any, rest: tuple[Item, ...]) -> None:
        times = (
            count_of(tree.get("times")) if isinstance(tree, Tree) and tree.get("times") is not None else count_of(tree)
        )
        if isinstance(tree, Tree) and tree.get("again") == "yes":
            times = 2
        if times is None or times < 1 or times != int(times) or times > MOST_TIMES:
            raise UnresolvedError(Clarify(f"How many times? Say a number from 1 to {MOST_TIMES}."))
        more = any(item.kind in ("order", "bare") for item in rest)
        ahead = isinstance(tree, Tree) and (
            tree.get("next") == "yes" or (tree.get("next") == "maybe" and not self.groups)
        )
        if more and (ahead or not self.groups):
            self.loop_from, self.loop_times = len(self.groups), int(times)
            return
        if not self.groups:
            raise UnresolvedError(Clarify("What should be repeated? Say what to do, then how often."))
        if times == 1:
            return
        everything = (
            isinstance(tree, Tree)
            and tree.rule == "repeat"
            and tree.get("times") is not None
            and tree.slots[0][0] == "times"
            and tree.get("all") == "yes"
        )
        again = isinstance(tree, Tree) and (tree.get("again") == "yes" or tree.get("all") == "yes" or everything)
        chosen = self.groups if again else self.groups[-1:]
        if not again and chosen[0].kind in ("shuttle", "roundtrip"):
            chosen[0].intents = [Repeat(int(times), tuple(chosen[0].intents))]
            return
        body = tuple(intent for group in chosen for intent in group.intents)
        del self.groups[len(self.groups) - len(chosen) :]
        self.groups.append(_Group([Repeat(int(times), body)], "repeat", self.number))


def compose(sentence: Sentence, reading: Reading) -> Composed:
    """Return the meaning of a reading."""
    composer = _Composer(sentence, notes=_without_effect(sentence))
    stop: Refuse | Clarify | None = None
    try:
        for k, item in enumerate(reading.items):
            if item.kind in ("refuse", "chat", "inquire"):
                if item.kind != "refuse" and any(one.kind == "order" for one in reading.items):
                    if sentence.tokens[item.start].text in _SPEAKING:
                        stop = refuse(Reason.MANIPULATION)
                        break
                    if item.end - item.start > _SMALL_TALK:  # too much to be left out
                        composer.skipped.append(sentence.words(item.start, item.end))
                    continue
                stop = refuse(item.value.get("reason"))
                break
            composer.item(item, reading.items[k + 1 :], reading.items[k - 1] if k else None)
        composer.flush()
    except UnresolvedError as fault:
        stop = fault.question
    intents = [intent for group in composer.groups for intent in group.intents]
    if composer.loop_from is not None and stop is None:
        before = [intent for group in composer.groups[: composer.loop_from] for intent in group.intents]
        body = tuple(intents[len(before) :])
        intents = [*before, Repeat(composer.loop_times, body)] if composer.loop_times > 1 else intents
    if stop is None and intents and isinstance(intents[0], Return):
        stop = Clarify("I do not know where you are. Which thing or room are you near?")
    if stop is None and not intents:
        stop = _nothing(composer, reading)
    return Composed(
        tuple(_tidied(intents)) if stop is None else (), stop, tuple(composer.notes), tuple(_phrases(composer, reading))
    )


def _without_effect(sentence: Sentence) -> list[str]:
    """Return a note for each word that says how fast or how quietly."""
    notes: list[str] = []
    end = 0
    for at in range(len(sentence.tokens)):
        slow = max(sentence.chart.terminal("SLOW", at), key=lambda edge: edge.end, default=None)
        if slow is not None and at >= end:
            end = slow.end
            notes.append(f"'{slow.value}' has no effect: the robot has one speed.")
    return notes


def _phrases(composer: _Composer, reading: Reading) -> list[str]:
    """Return the skipped words, neighbours as one phrase."""
    phrases: list[list[int]] = []
    for item in reading.items:
        long_talk = item.kind in ("chat", "inquire") and item.end - item.start > _SMALL_TALK
        if item.kind == "skip" or long_talk:
            if phrases and phrases[-1][1] == item.start:
                phrases[-1][1] = item.end
            else:
                phrases.append([item.start, item.end])
    for k, item in enumerate(reading.items[1:]):  # what follows "after" or "before" cannot be left out
        if item.kind == "remark" and reading.items[k].kind in ("AFTER", "BEFORE", "BUT_FIRST", "CORRECT"):
            phrases.append([item.start, item.end])
    return [composer.sentence.words(start, end) for start, end in phrases]


def _nothing(composer: _Composer, reading: Reading) -> Refuse | Clarify:
    if composer.memory.targets:
        return Clarify(f"What should I do with '{composer.memory.targets[-1].name}'? Say, for example, go to it.")
    if any(item.kind == "GREETING" for item in reading.items) and not composer.skipped:
        return refuse(Reason.CHAT)
    return refuse(Reason.UNKNOWN)


def _tidied(intents: list[Intent]) -> list[Intent]:
    """Return intents without a drive to where the robot was just sent."""
    kept: list[Intent] = []
    for intent in intents:
        if kept and intent == kept[-1] and isinstance(intent, Go | Face | Return):
            continue
        if (
            kept
            and isinstance(kept[-1], Face)
            and isinstance(intent, Go)
            and kept[-1].to == intent.to
            and intent.to.is_file
        ):
            kept.pop()
        kept.append(intent)
    return kept


def _near_of(intent: Intent, like: Target) -> tuple[Target, ...]:
    """Return where the target of an intent is, if it has the name of another target."""
    found = getattr(intent, "to", None) or getattr(intent, "of", None)
    return found.near if isinstance(found, Target) and found.name == like.name else ()


def _with_target(intent: Intent, target: Target) -> Intent:
    if isinstance(intent, Between):
        return Between((intent.of[0], target))
    if isinstance(intent, Repeat):
        return Repeat(intent.times, (*intent.body[:-1], _with_target(intent.body[-1], target)))
    changed = on_targets(intent, lambda _: target)
    return (
        changed
        if changed != intent or target in (getattr(intent, "to", None), getattr(intent, "of", None))
        else Go(target)
    )


def _is_there(tree: Any) -> bool:
    """Return whether an order goes to where the robot was just sent: "stop there"."""
    if not isinstance(tree, Tree) or tree.rule != "go":
        return False
    to = tree.get("to")
    return tree.get("there") == "yes" or (
        isinstance(to, Tree) and to.rule.startswith("pronoun") and to.get("it") == "there"
    )


def _refers(value: Any) -> bool:
    """Return whether a tree holds a pronoun."""
    if not isinstance(value, Tree):
        return False
    if (
        value.rule in ("pronoun", "pronoun_there")
        or value.get("it")
        or value.get("one")
        or value.get("two")
        or value.get("there")
    ):
        return True
    return any(_refers(inner) for _, inner in value.slots)
