"""An answer as JSON, and a picture of its heat: python examples/10_answers_for_a_program.py home.avlmap heat.png."""

import json
import sys

import avlmaps

m = avlmaps.open_map(sys.argv[1])
answer = m.ask("how many chairs are there?")
print(json.dumps(answer.to_dict(), indent=2))
if answer.heat is not None:
    print(answer.heat.plot(sys.argv[2]))
