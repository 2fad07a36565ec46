"""Another day, another robot: a second map finds itself in the first, and what changed is known with its day.

``align`` finds the place by pictures, ``surfaces`` holds it against the geometry, ``evidence`` says what a day looked
at, ``unnamed`` what changed though no list names it, ``life`` what became of each thing, and ``merge`` writes the map
of all days.
"""
