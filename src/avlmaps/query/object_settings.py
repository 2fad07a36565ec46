"""Settings of a query for an object: from a word to instances."""

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """From a word to instances."""

    same_word_cosine: float = 0.95
    """A vocabulary word at least this close to the queried one names the same thing and does not compete with it."""
    least_score: float = 0.5
    """For an encoder that has no feature for "other": a voxel must score at least this."""
    margin_yes: float = 0.1
    """An instance that wins its voxels by this much on average is as likely right as wrong."""
    margin_yes_logits: float = 1.0
    """The same for an encoder with a scale for its cosines: the margin times its ``logit_scale``."""
    area_yes_m2: float = 0.01
    """Surface below which an instance is probably noise; a mug shows about 0.02 m²."""
    least_confidence: float = 0.3
    """Instances below this are noise (one or two voxels of 5 cm) and give no heat; 0 admits all, as the paper does."""
    least_in_company: float = 0.02
    """The same where the query has context: then a weak instance there is likelier than a
    confident one elsewhere."""
    score_in_company: float = 0.5
    """And there a voxel counts that scores at least this part of its best rival's score, for an encoder of names."""
    least_score_in_company: float = 0.0
    """And at least this, a score of its own."""
    guess_below: float = 0.05
    """Where the best of these is less confident, weaker voxels give the guess, for an encoder of names."""
    score_for_guess: float = 0.2
    """Then a voxel counts that scores at least this part of its best rival's score, and ``least_for_guess``."""
    least_for_guess: float = 0.1
    """A score, √p: 0.1 is a probability of 1 %."""
    room_weight: float = 0.75
    """How much the kind of room that a thing stands in counts, for an encoder of names: the thing's log-odds rise by
    this times ln of how many times as common it is in such rooms. 0: not at all. It and the next were chosen on eight
    development homes."""
    room_cost: float = 0.4
    """Nats that the log-odds lose with that: most things stand where things of their name do."""
    too_long: float = 1.5
    """An instance this many times as long as the largest thing of its name is cut where its voxels score least, and
    is less likely to be what it is called, for an encoder of names; 0: never."""
    link_m: float = 0.1
    """Voxels of an object no farther apart than this along every axis belong to one instance."""
    join_m: float = 0.3
    """Pieces over one another with no larger gap in height are one thing (the legs and the back of a chair)."""

    @property
    def share_in_company(self) -> float:
        """The part of its best rival's score from which a voxel counts where the query has context; 1: it must win."""
        return min(1.0, self.score_in_company)

    def for_guess(self) -> "ObjectSettings":
        """Return the settings under which weaker voxels count."""
        return replace(self, score_in_company=self.score_for_guess, least_score_in_company=self.least_for_guess)
