"""What an answer looks like in a terminal."""

from avlmaps.cli.output import query_lines


def test_what_has_no_parts_and_no_size_shows_none() -> None:
    goal = {"position": [1.0, 2.0, 0.5], "probability": 0.5, "size": [0.0, 0.0, 0.0]}
    answer = {"parts": [], "goals": [goal], "found": True, "text": "It was last seen there.", "frame": "recording"}
    found, _, row = query_lines(answer)
    assert found == "found: It was last seen there." and "0.00" not in row
    whole = {**answer, "goals": [{**goal, "size": [0.5, 0.5, 0.0]}]}
    assert "0.50 x 0.50 x 0.00" in query_lines(whole)[-1]


def test_what_else_the_sentence_may_mean_is_named_where_it_is_there() -> None:
    other = {"query": "armchair", "probability": 0.612, "found": True, "goals": []}
    answer = {
        "parts": [], "goals": [], "found": True, "text": "The sofa is here.", "frame": "recording",
        "alternatives": [other, other | {"query": "bench", "found": False}],
    }  # fmt: skip
    assert query_lines(answer) == ["found: The sofa is here.", "or: armchair (0.61)"]
