#!/usr/bin/env python3
"""Rewrites an IGES file's trimmed surfaces (144, with boundaries 142) as bounded surfaces (143, with boundaries 141).

  tools/peers/iges143.py IN.igs OUT.igs

For files as Open CASCADE writes them. Composite curves (102) of a boundary are taken apart: a 141 lists each curve in space
with its parameter curves. Entities that nothing refers to afterwards are removed and the rest is numbered anew."""

import pathlib
import sys

SEPARATORS = ",;"


def tokens(text):
    """Parameters of one record (up to its record delimiter), Hollerith strings kept whole."""
    found, at, start = [], 0, 0
    while at < len(text):
        if text[at] == "H" and text[start:at].strip().isdigit():
            at += 1 + int(text[start:at])
        if text[at] in SEPARATORS:
            found.append(text[start:at].strip())
            if text[at] == ";":
                break
            start = at + 1
        at += 1
    return found


def read(path):
    """The lines of start and global section; entities by directory number: 18 fields and their parameters."""
    lines = path.read_text("latin-1").splitlines()
    sections = {letter: [line for line in lines if line[72:73] == letter] for letter in "SGDP"}
    entities = {}
    for k in range(0, len(sections["D"]), 2):
        pair = sections["D"][k] + sections["D"][k + 1]
        fields = [pair[i:i + 8] for i in (*range(0, 72, 8), *range(80, 152, 8))]
        first, count = int(fields[1]) - 1, int(fields[12])
        text = "".join(line[:64] for line in sections["P"][first:first + count])
        entities[k + 1] = (fields, tokens(text))
    return sections["S"] + sections["G"], entities


def members(entities, pointer):
    """A curve's own curves: those of a composite curve, taken apart, or itself."""
    if not pointer:
        return []
    parameters = entities[pointer][1]
    if parameters[0] != "102":
        return [pointer]
    return [one for child in parameters[2:2 + int(parameters[1])] for one in members(entities, int(child))]


def boundary(entities, parameters, where):
    """A 141 from the parameters of a 142."""
    surface, plane, space, preferred = (int(value or 0) for value in parameters[2:6])
    in_space, in_plane = members(entities, space), members(entities, plane)
    if not in_space:
        raise ValueError(f"D{where} (142): no curve in space; a 141 needs one")
    if in_plane and len(in_plane) != len(in_space):
        raise ValueError(f"D{where} (142): {len(in_space)} curves in space, {len(in_plane)} of parameters")
    # PREF of a 142: 1 parameters, 2 space, 3 equal; of a 141: 1 space, 2 parameters, 3 equal.
    swapped = {1: 2, 2: 1}.get(preferred, preferred) if in_plane else 1
    made = ["141", int(bool(in_plane)), swapped, surface, len(in_space)]
    for k, curve in enumerate(in_space):
        made += [curve, 1, *((1, in_plane[k]) if in_plane else (0,))]
    return [str(value) for value in made]


def bounded(entities):
    """Turns every 142 into a 141 and every 144 into a 143, in their places."""
    for number, (fields, parameters) in entities.items():
        if parameters[0] == "142":
            entities[number] = (retyped(fields, "141"), boundary(entities, parameters, number))
    for number, (fields, parameters) in entities.items():
        if parameters[0] != "144":
            continue
        if parameters[2] != "1":
            raise ValueError(f"D{number} (144): its outer boundary is that of its surface (N1 = 0), which a 143 cannot have")
        inner = int(parameters[3])
        loops, rest = parameters[4:5 + inner], parameters[5 + inner:]
        kind = max(entities[int(loop)][1][1] for loop in loops)
        entities[number] = (retyped(fields, "143"), ["143", kind, parameters[1], str(len(loops)), *loops, *rest])


def retyped(fields, kind):
    fields = list(fields)
    fields[0] = fields[9] = kind.rjust(8)
    return fields


def pointer_places(parameters):
    """Indices of the parameters that are pointers."""
    kind, count = parameters[0], len(parameters)
    number = lambda at: int(parameters[at] or 0)
    own = {"102": lambda: range(2, 2 + number(1)), "108": lambda: [5], "120": lambda: [1, 2], "122": lambda: [1],
           "140": lambda: [5], "402": lambda: range(2, 2 + number(1)),
           "143": lambda: [2, *range(4, 4 + number(3))]}
    if kind == "141":
        places, at = [3], 5
        for _ in range(number(4)):
            places += [at, *range(at + 3, at + 3 + number(at + 2))]
            at += 3 + number(at + 2)
        end = at
    else:
        places = list(own[kind]()) if kind in own else []
        end = {"120": 5, "122": 5, "140": 6, "108": 10}.get(kind, max(places, default=0) + 1) if places else count
    extra, at = [], end  # back pointers, then properties, each with its count
    while at < count and kind in ("141", "143", "402", "102", "108", "120", "122", "140"):
        extra += range(at + 1, min(at + 1 + number(at), count))
        at += 1 + number(at)
    return places + extra


def used(entities):
    """Numbers of the entities that are left: roots (not subordinate) and all that they refer to."""
    stack = [n for n, (fields, _) in entities.items() if fields[8][2:4] in ("00", "  ")]
    found = set()
    while stack:
        number = stack.pop()
        if number in found or number not in entities:
            continue
        found.add(number)
        fields, parameters = entities[number]
        stack += [int(parameters[at] or 0) for at in pointer_places(parameters)]
        stack += [abs(int(fields[k].strip() or 0)) for k in (2, 3, 4, 5, 6, 7, 11)]
    return found


def write(path, head, entities):
    kept = sorted(used(entities))
    anew = {old: 2 * k + 1 for k, old in enumerate(kept)}
    directory, data = [], []
    for old in kept:
        fields, parameters = entities[old]
        fields, parameters = list(fields), list(parameters)
        for at in pointer_places(parameters):
            parameters[at] = str(anew.get(int(parameters[at] or 0), 0))
        for k in (2, 3, 4, 5, 6, 7, 11):
            value = int(fields[k].strip() or 0)
            is_pointer = value < 0 or (k in (6, 7) and value > 0)
            if is_pointer:
                fields[k] = str((-1 if value < 0 else 1) * anew.get(abs(value), 0)).rjust(8)
        rows = wrapped(parameters)
        fields[1], fields[12] = str(len(data) + 1).rjust(8), str(len(rows)).rjust(8)
        data += [f"{row:<64}{anew[old]:>8}P" for row in rows]
        for half in (fields[:9], fields[9:]):
            directory.append("".join(half).ljust(72) + "D")
    lines = head + [f"{line}{k + 1:>7}" for part in (directory, data) for k, line in enumerate(part)]
    counts = [sum(line[72] == letter for line in head) for letter in "SG"]
    lines.append(f"S{counts[0]:>7}G{counts[1]:>7}D{len(directory):>7}P{len(data):>7}".ljust(72) + "T      1")
    path.write_text("\n".join(lines) + "\n", "latin-1")


def wrapped(parameters):
    """Rows of at most 64 characters; strings that are longer run on over rows."""
    rows = [""]
    for k, value in enumerate(parameters):
        part = value + (";" if k == len(parameters) - 1 else ",")
        if len(rows[-1]) + len(part) > 64 and rows[-1]:
            rows.append("")
        rows[-1] += part
        while len(rows[-1]) > 64:
            rows.append(rows[-1][64:])
            rows[-2] = rows[-2][:64]
    return rows


def rewrite(source, target):
    head, entities = read(source)
    bounded(entities)
    write(target, head, entities)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        rewrite(*(pathlib.Path(name) for name in sys.argv[1:]))
    except ValueError as error:
        sys.exit(f"tools/peers/iges143.py: {sys.argv[1]}: {error}")


if __name__ == "__main__":
    main()
