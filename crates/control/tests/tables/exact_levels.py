"""Adds the exact best level to every plant of synthesis.json, in arithmetic of 256 bits, rounding no excuse.

Run after make_synthesis.py, with python-flint and numpy installed:  python exact_levels.py < synthesis.json > settled.json
The tests read the table only; nobody needs Python to run them.

A level is feasible when it exceeds the floor set by the direct terms, both Riccati equations of Glover and Doyle (general
form: Hamiltonians with the inverse of the indefinite weight) have stabilising solutions X and Y, both are positive semidefinite,
and the spectral radius of XY stays under the square of the level. Bisection to 1e-9. The levels of SLICOT stay in `gamma`:
SLICOT watches closed loops computed in double precision and stops early where they break their bound or lose stability.
"""

import json
import sys

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx

ctx.prec = 256
TINY = arb(2) ** -100


def mid(m):
    """The same matrix without its error balls: iterations below are approximate, at 256 bits."""
    return type(m)(m.nrows(), m.ncols(), [x.mid() for x in m.entries()])


def real(rows):
    rows = np.asarray(rows, dtype=float)
    return arb_mat(rows.shape[0], rows.shape[1], [arb(float(x)) for x in rows.ravel()])


def stacked(blocks):
    rows = sum(row[0].nrows() for row in blocks)
    columns = sum(b.ncols() for b in blocks[0])
    out, top = arb_mat(rows, columns), 0
    for row in blocks:
        left = 0
        for b in row:
            for i in range(b.nrows()):
                for j in range(b.ncols()):
                    out[top + i, left + j] = b[i, j]
            left += b.ncols()
        top += row[0].nrows()
    return out


def neg(m):
    return m * arb(-1)


def stabilising(h, n):
    """X of the graph [I; X] of the stable subspace of a Hamiltonian, or None."""
    values, vectors = acb_mat(h).eig(right=True, algorithm="approx")
    size = max(abs(v).mid() for v in values)
    if min(abs(v.real).mid() for v in values) < TINY * size:
        return None
    stable = [k for k, v in enumerate(values) if v.real.mid() < 0]
    if len(stable) != n:
        return None
    u1 = acb_mat(n, n, [vectors[i, k].mid() for i in range(n) for k in stable])
    u2 = acb_mat(n, n, [vectors[n + i, k].mid() for i in range(n) for k in stable])
    try:
        x = u1.transpose().solve(u2.transpose(), algorithm="approx").transpose()
    except ZeroDivisionError:
        return None
    half = arb(0.5)
    return arb_mat(n, n, [((x[i, j].real + x[j, i].real) * half).mid() for i in range(n) for j in range(n)])


def eigenvalues(m):
    return [v.real.mid() for v in acb_mat(m).eig(algorithm="approx")]


def positive(x):
    values = eigenvalues(x)
    return min(values) >= -TINY * max([abs(v) for v in values] + [arb(1)])


class Plant:
    def __init__(self, p):
        a, b, c, d = (np.array(p[k], dtype=float) for k in "abcd")
        poles = np.abs(np.linalg.eigvals(a))
        poles = poles[poles > 1e-12 * poles.max()]
        # time in a natural unit: keeps the 256 bits for what matters
        unit = float(2.0 ** np.round(np.log2(np.exp(np.mean(np.log(poles)))))) if len(poles) else 1.0
        a, b = a / unit, b / unit
        m2, p2 = p["controls"], p["measurements"]
        self.n, self.m1, self.p1 = a.shape[0], b.shape[1] - m2, c.shape[0] - p2
        d11, d12, d21 = d[: self.p1, : self.m1], d[: self.p1, self.m1 :], d[self.p1 :, : self.m1]
        left = np.linalg.svd(d12)[0][:, m2:]
        right = np.linalg.svd(d21)[2][p2:].T
        norm = lambda m: np.linalg.norm(m, 2) if m.size else 0.0
        self.floor = max(norm(left.T @ d11), norm(d11 @ right))
        self.a, self.b, self.c = real(a), real(b), real(c)
        self.b1, self.c1 = real(b[:, : self.m1]), real(c[: self.p1])
        self.row = real(np.hstack([d11, d12]))
        self.column = real(np.vstack([d11, d21]))

    def half(self, a, b, c1, direct, count, gamma):
        """The Hamiltonian of one half: H for (A, B, C1, [D11 D12]), J for the dual."""
        r = direct.transpose() * direct
        for i in range(count):
            r[i, i] = r[i, i] - gamma * gamma
        n = self.n
        base = stacked([[a, arb_mat(n, n)], [neg(c1.transpose() * c1), neg(a.transpose())]])
        left = stacked([[b], [neg(c1.transpose() * direct)]])
        right = stacked([[direct.transpose() * c1, b.transpose()]])
        return mid(base - left * mid(r).solve(right, algorithm="approx"))

    def feasible(self, gamma):
        if gamma <= self.floor:
            return False
        g = arb(gamma)
        x = stabilising(self.half(self.a, self.b, self.c1, self.row, self.m1, g), self.n)
        if x is None or not positive(x):
            return False
        y = stabilising(self.half(self.a.transpose(), self.c.transpose(), self.b1.transpose(), self.column.transpose(), self.p1, g), self.n)
        if y is None or not positive(y):
            return False
        return max(eigenvalues(mid(x * y)) + [arb(0)]) < g * g


def level(p):
    plant = Plant(p)
    high = p["gamma"] * (1 + 1e-5)
    while not plant.feasible(high):
        high *= 1.01
    low = high / (1 + 3e-5)
    while plant.feasible(low):
        high, low = low, low / 2
        if low < 1e-12:
            return 0.0
    while high > low * (1 + 1e-9):
        middle = (low * high) ** 0.5
        if plant.feasible(middle):
            high = middle
        else:
            low = middle
    return high


def main():
    table = json.load(sys.stdin)
    for p in table["plants"]:
        p["exact"] = float(f"{level(p):.12g}")
        print(p["name"], p["gamma"], p["exact"], p["gamma"] / p["exact"] - 1 if p["exact"] else None, file=sys.stderr)
    plants = table.pop("plants")
    print("{")
    for key, value in table.items():
        print(f"{json.dumps(key)}: {json.dumps(value)},")
    print('"plants": [')
    print(",\n".join(json.dumps(p, separators=(",", ":")) for p in plants))
    print("]}")


main()
