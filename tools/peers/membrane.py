"""Stretching of a clamped disc over a hemisphere without friction, by other means than the program's: an axisymmetric
rigid-plastic membrane (von Mises, a power of the plastic strain) whose plastic work is made least increment by increment.

Twice the increments move the travel at 70 kN by 0.05 mm, more elements by nothing. Alone: prints the travel [mm] at
every 10 kN and the largest load.
"""

import math

K, EPS0, N = 589.0, 1e-4, 0.216
PUNCH, ENTRY, CLAMP, THICKNESS = 50.8, 6.35, 59.18, 1.0
STIFFNESS = 2e4  # Of the contact: a node over 1 mm of element, 1 rad times its radius; under 0.01 mm deep at the end.


class Membrane:
    def __init__(self, elements):
        self.count = elements
        self.start = [CLAMP * i / elements for i in range(elements + 1)]
        self.points = [[r, 0.5 * THICKNESS] for r in self.start]
        self.strain = [0.0] * elements
        self.thickness = [THICKNESS] * elements
        pairs = list(zip(self.start, self.start[1:]))
        self.volume = [THICKNESS * math.pi * (b * b - a * a) for a, b in pairs]

    def begin(self, centre):
        """Fixes what an increment refers to; `centre` is the height of the punch's centre."""
        self.centre = centre
        self.before = [p[:] for p in self.points]
        t = self.thickness
        self.half = [0.5 * t[0], *(0.25 * (a + b) for a, b in zip(t, t[1:])), 0.5 * t[-1]]

    def strains(self, e, points):
        """Increments along the meridian and around it, the radius in the middle, the vector along and its length squared."""
        (ra, za), (rb, zb) = points[e], points[e + 1]
        (pa, ya), (pb, yb) = self.before[e], self.before[e + 1]
        dr, dz = rb - ra, zb - za
        square = dr * dr + dz * dz
        a = 0.5 * math.log(square / ((pb - pa) ** 2 + (yb - ya) ** 2))
        return a, math.log((ra + rb) / (pa + pb)), 0.5 * (ra + rb), dr, dz, square

    def element(self, e, points):
        """Plastic work and its derivatives by the four coordinates."""
        a, b, radius, dr, dz, square = self.strains(e, points)
        q = math.sqrt(4 / 3 * (a * a + a * b + b * b) + 1e-10)
        grown = EPS0 + self.strain[e] + q
        work = self.volume[e] * K / (N + 1) * (grown ** (N + 1) - (EPS0 + self.strain[e]) ** (N + 1))
        stress = self.volume[e] * K * grown**N * 2 / 3 / q
        along, around = stress * (2 * a + b), stress * (2 * b + a)
        u, w, v = along * dr / square, along * dz / square, 0.5 * around / radius
        return work, (v - u, -w, v + u, w)

    def contact(self, i, point):
        """Energy and its derivatives of a node in the punch or the die; the punch's share of the force down."""
        energy, gr, gz, down = 0.0, 0.0, 0.0, 0.0
        if i == self.count:
            return energy, (gr, gz), down
        k = STIFFNESS * max(self.start[i], 0.3) * CLAMP / self.count
        for r, z, size, punch in ((0.0, self.centre, PUNCH, True), (CLAMP, -ENTRY, ENTRY, False)):
            x, y = point[0] - r, point[1] - z
            far = math.hypot(x, y)
            gap = far - size - self.half[i]
            if gap < 0:
                energy += 0.5 * k * gap * gap
                gr += k * gap * x / far
                gz += k * gap * y / far
                down += k * gap * y / far if punch else 0.0
        return energy, (gr, gz), down

    def whole(self, points):
        """Energy, its derivatives by node, and the punch's force."""
        energy, force = 0.0, 0.0
        slope = [[0.0, 0.0] for _ in points]
        for e in range(self.count):
            work, g = self.element(e, points)
            energy += work
            for k in range(4):
                slope[e + k // 2][k % 2] += g[k]
        for i, point in enumerate(points):
            held, g, down = self.contact(i, point)
            energy += held
            force += down
            slope[i][0] += g[0]
            slope[i][1] += g[1]
        slope[0][0] = slope[-1][0] = slope[-1][1] = 0.0
        return energy, slope, force

    def band(self):
        """Second derivatives, differences of the first, as rows of a symmetric band of half width 4."""
        size, h = 2 * (self.count + 1), 1e-6
        rows = [[0.0] * 4 for _ in range(size)]
        for e in range(self.count):
            near = [self.points[e][:], self.points[e + 1][:]]
            both = []
            for k in range(4):
                ends = []
                for sign in (1, -1):
                    near[k // 2][k % 2] += sign * h
                    ends.append(self.element(e, {e: near[0], e + 1: near[1]})[1])
                    near[k // 2][k % 2] -= sign * h
                both.append([(x - y) / (2 * h) for x, y in zip(*ends)])
            for k in range(4):
                for j in range(k + 1):
                    rows[2 * e + k][k - j] += 0.5 * (both[k][j] + both[j][k])
        for i, point in enumerate(self.points):
            for k in range(2):
                ends = []
                for sign in (1, -1):
                    moved = point[:]
                    moved[k] += sign * h
                    ends.append(self.contact(i, moved)[1])
                for j in range(k + 1):
                    rows[2 * i + k][k - j] += (ends[0][j] - ends[1][j]) / (2 * h)
        for fixed in (0, size - 2, size - 1):
            for k in range(4):
                rows[fixed][k] = 0.0
                if fixed + k < size:
                    rows[fixed + k][k] = 0.0
            rows[fixed][0] = 1.0
        return rows

    def direction(self, slope):
        """Newton's, of second derivatives raised until they are positive."""
        rows, raised = self.band(), 0.0
        size = len(rows)
        mean = sum(abs(r[0]) for r in rows) / size
        while True:
            lower = [[0.0] * 4 for _ in range(size)]
            for i in range(size):
                for k in range(min(3, i), -1, -1):
                    j = i - k
                    value = rows[i][k] + (raised if k == 0 else 0.0)
                    value -= sum(lower[i][i - m] * lower[j][j - m] for m in range(max(i - 3, j - 3, 0), j))
                    if k:
                        lower[i][k] = value / lower[j][0]
                    elif value > 0:
                        lower[i][0] = math.sqrt(value)
                    else:
                        break
                if not lower[i][0]:
                    break
            else:
                break
            raised = max(10 * raised, 1e-5 * mean)
        x = [-g for pair in slope for g in pair]
        for i in range(size):
            x[i] = (x[i] - sum(lower[i][k] * x[i - k] for k in range(1, min(3, i) + 1))) / lower[i][0]
        for i in reversed(range(size)):
            x[i] = (x[i] - sum(lower[i + k][k] * x[i + k] for k in range(1, min(3, size - 1 - i) + 1))) / lower[i][0]
        return x

    def settle(self):
        """Makes the work least; the punch's force [N]."""
        for _ in range(60):
            energy, slope, force = self.whole(self.points)
            if max(abs(g) for pair in slope for g in pair) < 2e-4 * max(100.0, force):
                return force
            way = self.direction(slope)
            falls = sum(g * w for g, w in zip((g for pair in slope for g in pair), way))
            share = min(1.0, 1.0 / max(abs(w) for w in way))
            while share > 1e-6:
                tried = [[p[0] + share * way[2 * i], p[1] + share * way[2 * i + 1]] for i, p in enumerate(self.points)]
                if self.whole(tried)[0] < energy + 1e-4 * share * falls or abs(falls) < 1e-10 * abs(energy):
                    break
                share *= 0.5
            self.points = tried
        raise ArithmeticError("the membrane found no least work")

    def end(self):
        for e in range(self.count):
            a, b, *_ = self.strains(e, self.points)
            self.strain[e] += math.sqrt(4 / 3 * (a * a + a * b + b * b))
            self.thickness[e] *= math.exp(-a - b)


def curve(travel=46.0, increments=184, elements=80):
    """Load [kN] and travel [mm] of every increment."""
    sheet, found, last = Membrane(elements), [(0.0, 0.0)], None
    for k in range(1, increments + 1):
        now = travel * k / increments
        sheet.begin(THICKNESS + PUNCH - now)
        if last:
            sheet.points = [[2 * x - y for x, y in zip(p, o)] for p, o in zip(sheet.points, last)]
        else:
            sheet.points = [[r, 0.5 * THICKNESS - now * (1 - r / CLAMP)] for r in sheet.start]
        last = sheet.before
        found.append((sheet.settle() / 1000, now))
        sheet.end()
    return found


def travels(loads, found):
    """Travel [mm] at every load [kN] while it rises; None beyond the largest."""
    at = {}
    for load in loads:
        at[load] = None
        for (a, x), (b, y) in zip(found, found[1:]):
            if a <= load <= b:
                at[load] = x + (y - x) * (load - a) / (b - a)
                break
    return at


if __name__ == "__main__":
    found = curve()
    for load, travel in travels(range(10, 80, 10), found).items():
        print(load, "kN:", "not reached" if travel is None else f"{travel:.2f} mm")
    print("largest load: {:.2f} kN at {:.1f} mm".format(*max(found)))
