"""Nets for tests, as lines "a b -> c : label"; a name with * has a token, a ~ is a blank."""

from smachpy.pnp import Arc, Net, Place, Transition


def net_of(text, name="plan"):
    places, transitions, arcs = {}, [], []
    for number, line in enumerate(filter(None, map(str.strip, text.splitlines()))):
        ends, _, label = line.partition(" : ")
        sources, _, targets = ends.partition("->")
        transitions.append(Transition(f"t{number}", label))
        for side, names in enumerate((sources, targets)):
            for word in names.split():
                label = word.strip("*").replace("~", " ")
                known = places.setdefault(label, Place(f"p{len(places)}", label))
                if word.endswith("*"):
                    places[label] = Place(known.id, label, 1)
                pair = (known.id, f"t{number}")
                arcs.append(Arc(*(reversed(pair) if side else pair)))
    return Net(name, tuple(places.values()), tuple(transitions), tuple(arcs))
