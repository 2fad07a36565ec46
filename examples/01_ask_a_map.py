"""Ask a map in words: python examples/01_ask_a_map.py home.avlmap "where can I sit?"."""

import sys

import avlmaps

m = avlmaps.open_map(sys.argv[1])
answer = m.ask(sys.argv[2] if len(sys.argv) > 2 else "where can I sit?")
print(answer.text)
for goal in answer.goals:
    print(f"  {goal.position} with probability {goal.probability:.2f}")
for other in answer.alternatives:
    print("  or:", other.to_dict()["query"])
for note in answer.notes:
    print("  note:", note)
