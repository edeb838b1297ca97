#!/usr/bin/env python3
"""Rules of integration through the thickness: error of moment and force of a bent strip, in per cent of the moment.

  thickness_rules.py

A strip of plane strain is bent to R/t from 5 to 100, without tension and with 24 tensions up to one that moves the neutral
surface out of it. Laws: elastic and perfectly plastic, linear hardening, Swift. The exact integrals have 40001 points. Gauss:
rules of Legendre over the whole thickness. Halves: Chebyshev's rules with equal weights in each half (kanagata's even
numbers). Needs NumPy only and shares nothing with the program.
"""

import numpy as np

RADII = (5, 7, 10, 15, 20, 30, 50, 70, 100)
YOUNG = 206e3 / (1 - 0.3**2)
CHEBYSHEV = {2: [1 / 3**0.5], 3: [0.0, 0.5**0.5],
             4: [(1 / 3 - 2 / (3 * 5**0.5)) ** 0.5, (1 / 3 + 2 / (3 * 5**0.5)) ** 0.5],
             5: [0.0, (5 / 12 - 11**0.5 / 12) ** 0.5, (5 / 12 + 11**0.5 / 12) ** 0.5]}


def gauss(count):
    return np.polynomial.legendre.leggauss(count)


def halves(count):
    upper = np.array(CHEBYSHEV[count // 2])
    whole = np.concatenate([-upper[upper > 0][::-1], upper])
    half = 0.5 + 0.5 * whole
    return np.concatenate([-half[::-1], half]), np.full(count, 2.0 / count)


def perfect(strain):
    return np.clip(YOUNG * strain, -200.0, 200.0)


def linear(strain):
    first = 200.0 / YOUNG
    size = np.abs(strain)
    return np.sign(strain) * np.where(size < first, YOUNG * size, 200.0 + (size - first) * 1000.0)


def swift(strain):
    k, start, power = 550.0, 0.005, 0.22
    first = k * start**power / YOUNG
    size = np.abs(strain)
    plastic = np.maximum(size - first, 0.0)
    for _ in range(60):
        off = YOUNG * (size - plastic) - k * (start + plastic) ** power
        plastic = np.maximum(plastic + off / (YOUNG + k * power * (start + plastic) ** (power - 1)), 0.0)
    return np.sign(strain) * np.where(size < first, YOUNG * size, k * (start + plastic) ** power)


FINE = np.linspace(-1, 1, 40001)


def resultants(law, rule, radius, tension):
    z, weight = rule
    stress = law(z / (2 * radius) + tension)
    return (weight * stress).sum(), (weight * stress * z).sum()


def exact(law, radius, tension):
    weight = np.full(len(FINE), FINE[1] - FINE[0])
    weight[[0, -1]] *= 0.5
    return resultants(law, (FINE, weight), radius, tension)


def row(law, rule):
    pure, bent = [], []
    for radius in RADII:
        scale = exact(law, radius, 0.0)[1]
        pure.append(100 * (resultants(law, rule, radius, 0.0)[1] / scale - 1))
        for tension in np.linspace(0, 1.2, 25) / (2 * radius):
            (n, m), (force, moment) = resultants(law, rule, radius, tension), exact(law, radius, tension)
            bent.append((100 * (m - moment) / scale, 50 * (n - force) / scale))
    bent = np.array(bent)
    return [max(map(abs, pure)), *np.sqrt((bent**2).mean(axis=0)), *np.abs(bent).max(axis=0)]


def main():
    print("| law | rule | points | moment, pure bending, largest | with tension: moment, force, root mean square | largest |")
    print("|---|---|---|---|---|---|")
    for law in (perfect, linear, swift):
        for name, rule, counts in (("Gauss", gauss, range(3, 11)), ("halves", halves, (4, 6, 8, 10))):
            for count in counts:
                a, m, n, mm, nn = row(law, rule(count))
                print(f"| {law.__name__} | {name} | {count} | {a:.2f} | {m:.1f}, {n:.1f} | {mm:.0f}, {nn:.0f} |")


if __name__ == "__main__":
    main()
