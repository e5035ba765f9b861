"""Makes synthesis.json: generalised plants with the best H-infinity level that SLICOT finds for them.

Run with numpy, scipy and slycot installed:  python make_synthesis.py > synthesis.json
The tests read the table only; nobody needs Python to run them.

Reference levels are found by bisection on the closed loops that SB10AD returns for a given level (job = 4): a level counts as
reached when the loop is stable and its peak by AB13DD does not exceed it. This is done on balanced, time-scaled copies of
each plant (the best level does not change under scaling), in up to five time units; the lowest is kept, and `agreeing` of
them found it to 1e-6. `own_estimate` is what SLICOT's own search (job = 1) returns: it watches stability, not the bound, and
is too low on plants whose loop stays stable below the best level. `unscaled_excess` is what SLICOT's controller at 1.001
times the level does on the plant as given: closed-loop peak over level, minus one (null when SLICOT refuses, "unstable"
when its closed loop is).
"""

import json
import os
import sys

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[name] = "1"  # tiny matrices: threads only wait for each other

import numpy as np
import scipy.linalg as sl
import slycot

rng = np.random.default_rng(20200518)


def rounded(m, digits=8):
    m = np.asarray(m, dtype=float)
    return np.array([[float(f"{x:.{digits}g}") for x in row] for row in m]).reshape(m.shape)


def balanced(a, b, c, unit):
    """Time in units of 1/unit s; states scaled by powers of two so that [A B; C 0] is even."""
    a, b, c = a / unit, b / unit, c.copy()
    n = a.shape[0]
    for _ in range(200):
        changed = False
        for i in range(n):
            row = np.sqrt(np.sum(np.delete(a[i], i) ** 2) + np.sum(b[i] ** 2))
            col = np.sqrt(np.sum(np.delete(a[:, i], i) ** 2) + np.sum(c[:, i] ** 2))
            if row == 0 or col == 0:
                continue
            f = 2.0 ** np.round(np.log2(np.sqrt(row / col)))
            if f != 1 and np.hypot(row / f, col * f) < 0.95 * np.hypot(row, col):
                a[i] /= f
                a[:, i] *= f
                b[i] /= f
                c[:, i] *= f
                changed = True
        if not changed:
            break
    return a, b, c


def reached(a, b, c, d, p, gamma):
    """Whether SLICOT's controller for this level stabilises the loop and keeps its true peak under the level."""
    n, m, q = a.shape[0], b.shape[1], c.shape[0]
    try:
        ac, bc, cc, dc = slycot.sb10ad(n, m, q, p["controls"], p["measurements"], gamma, a, b, c, d, 4, 1e-9, 0.0)[5:9]
        if np.max(np.linalg.eigvals(ac).real) >= 0:
            return False
        k = ac.shape[0]
        return slycot.ab13dd("C", "I", "S", "D", k, bc.shape[1], cc.shape[0], ac, np.eye(k), bc, cc, dc, 1e-9)[0] <= gamma * (1 + 1e-7)
    except Exception:
        return False


def level(p, unit):
    """The lowest level that SLICOT reaches, by bisection on verified closed loops (relative 1e-7)."""
    a, b, c = balanced(p["a"], p["b"], p["c"], unit)
    high = 1.0
    while not reached(a, b, c, p["d"], p, high):
        high *= 4
        if high > 1e9:
            return None
    low = high / 4
    while reached(a, b, c, p["d"], p, low) and low > 1e-9:
        high, low = low, low / 4
    while high > low * (1 + 1e-7):
        middle = np.sqrt(low * high)
        if reached(a, b, c, p["d"], p, middle):
            high = middle
        else:
            low = middle
    return high


def own_estimate(p, unit):
    """What SLICOT's own search (job = 1) returns, which looks at stability only."""
    a, b, c = balanced(p["a"], p["b"], p["c"], unit)
    for start in 10.0 ** np.arange(1, 8):
        try:
            return float(slycot.sb10ad(a.shape[0], b.shape[1], c.shape[0], p["controls"], p["measurements"], start, a, b, c, p["d"], 1, 1e-9, 0.0)[0])
        except Exception:
            continue
    return None


def peak(ac, bc, cc, dc):
    """Largest gain of a stable closed loop, on a grid refined round its maximum."""
    poles = np.linalg.eigvals(ac)
    if np.max(poles.real) >= 0:
        return None
    size = np.abs(poles)
    grid = np.concatenate([[0.0], np.geomspace(size.min() / 30, size.max() * 30, 4000), np.abs(poles.imag), size])
    schur, u = sl.schur(ac.astype(complex))
    left, right = cc @ u, u.conj().T @ bc
    eye = np.eye(len(poles))

    def gain(w):
        return np.linalg.norm(left @ sl.solve_triangular(1j * w * eye - schur, right) + dc, 2)

    best = max(grid, key=gain)
    for width in (1e-2, 1e-3, 1e-4):
        best = max(np.append(best * np.linspace(1 - width, 1 + width, 101), best), key=gain)
    return gain(best)


def unscaled_excess(p, gamma):
    n, m, q = p["a"].shape[0], p["b"].shape[1], p["c"].shape[0]
    try:
        out = slycot.sb10ad(n, m, q, p["controls"], p["measurements"], 1.001 * gamma, p["a"], p["b"], p["c"], p["d"], 4, 1e-9, 0.0)
        worst = peak(*out[5:9])
    except Exception:
        return None
    return "unstable" if worst is None else float(f"{worst / gamma - 1:.4g}")


def stacked(name, kind, a, b1, b2, c1, c2, d11, d12, d21, d22):
    return {
        "name": name,
        "kind": kind,
        "controls": b2.shape[1],
        "measurements": c2.shape[0],
        "a": rounded(a),
        "b": rounded(np.hstack([b1, b2])),
        "c": rounded(np.vstack([c1, c2])),
        "d": rounded(np.vstack([np.hstack([d11, d12]), np.hstack([d21, d22])])),
    }


def full_rank(rows, cols):
    while True:
        d = rng.standard_normal((rows, cols))
        if np.linalg.svd(d)[1].min() > 0.2:
            return d


def random_plant(index, kind):
    n = int(rng.integers(1, 13))
    m2, p2 = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    m1, p1 = p2 + int(rng.integers(0, 4)), m2 + int(rng.integers(0, 4))
    a = rng.standard_normal((n, n)) * rng.uniform(0.3, 3)
    if kind == "random-stable":
        a -= (np.max(np.linalg.eigvals(a).real) + rng.uniform(0.05, 2)) * np.eye(n)
    d11 = np.zeros((p1, m1)) if rng.random() < 0.3 else rng.standard_normal((p1, m1)) * rng.uniform(0.1, 1)
    d22 = np.zeros((p2, m2)) if rng.random() < 0.5 else rng.standard_normal((p2, m2)) * 0.3
    r = rng.standard_normal
    return stacked(f"{kind}-{index}", kind, a, r((n, m1)), r((n, m2)), r((p1, n)), r((p2, n)), d11, full_rank(p1, m2), full_rank(p2, m1), d22)


def first_order(template):
    """State space of the weight whose inverse has gain g0 at rest, g1 far above, one at w."""
    g0, g1, w = template
    a, b = g1 * np.sqrt(abs(g0**2 - 1)), g0 * w * np.sqrt(abs(g1**2 - 1))
    c, d = np.sqrt(abs(g0**2 - 1)), w * np.sqrt(abs(g1**2 - 1))
    # (c s + d)/(a s + b)
    return -b / a, 1.0, d / a - c * b / a**2, c / a


def servo(name, kind, a, b, c, w1, w2, w3):
    """Mixed sensitivity round one input and one output: reference and input disturbance in, weighted error and command out."""
    n = a.shape[0]
    (a1, b1, c1, d1), (a2, b2, c2, d2), (a3, b3, c3, d3) = (first_order(w) for w in (w1, w2, w3))
    big = np.zeros((n + 3, n + 3))
    big[:n, :n] = a
    big[:n, n + 2] = b * c3
    big[n, :n], big[n, n] = -b1 * c, a1
    big[n + 1, n + 1] = a2
    big[n + 2, n + 2] = a3
    bw = np.zeros((n + 3, 2))
    bw[:n, 1] = b * d3
    bw[n, 0], bw[n + 2, 1] = b1, b3
    bu = np.zeros((n + 3, 1))
    bu[:n, 0], bu[n + 1, 0] = b, b2
    ce = np.zeros((2, n + 3))
    ce[0, :n], ce[0, n], ce[1, n + 1] = -d1 * c, c1, c2
    cy = np.zeros((1, n + 3))
    cy[0, :n] = -c
    return stacked(name, kind, big, bw, bu, ce, cy, np.array([[d1, 0], [0, 0]]), np.array([[0.0], [d2]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))


def galvanometer(index):
    """Current-controlled galvanometers with a flexible mode, in degrees, companion form: badly scaled on purpose."""
    r, l = rng.uniform(0.8, 4), rng.uniform(80e-6, 300e-6)
    kc = 10 ** rng.uniform(-2.5, -1.7)
    j = kc / 10 ** rng.uniform(4.8, 5.4)
    b = 10 ** rng.uniform(-6, -5)
    w, xi = 2 * np.pi * rng.uniform(2500, 8000), rng.uniform(0.01, 0.05)
    kr = rng.uniform(0.1, 0.4) * kc / j
    t = rng.uniform(5e-5, 1e-4)
    k = rng.uniform(0.5, 1.5) * abs(r + 1j * 1e4 * l) / abs(1 + 1 / (1j * 1e4 * t))
    mode = np.array([1, 2 * xi * w, w * w])
    rigid = np.array([j, b])
    # res(s) = kr s/mode, velocity per current = kc/rigid + res
    up = np.polyadd(kc * mode, np.polymul([kr, 0], rigid))
    electric = np.polyadd(np.polymul(np.polymul([l, r], rigid), mode), kc * up)
    den = np.polyadd(np.polymul([t, 0], electric), k * np.polymul([t, 1], np.polymul(rigid, mode)))
    num = 180 / np.pi * k * np.polymul([t, 1], up)
    den = np.polymul(den, [1, 0])
    num, den = num / den[0], den / den[0]
    n = len(den) - 1
    a = np.eye(n, k=1)
    a[-1] = -den[:0:-1]
    bb = np.zeros(n)
    bb[-1] = 1
    c = np.zeros(n)
    c[: len(num)] = num[::-1]
    band = rng.uniform(1500, 4000)
    w1 = (10 ** rng.uniform(-3.5, -2), rng.uniform(1.001, 2), band)
    w2 = (10 ** rng.uniform(1.2, 2.2), 10 ** rng.uniform(-1.5, -0.5), band * 10 ** rng.uniform(1.5, 2.3))
    w3 = (rng.uniform(3, 20), rng.uniform(0.5, 0.95), band / rng.uniform(5, 20))
    return servo(f"galvanometer-{index}", "galvanometer", a, bb, c, w1, w2, w3)


def chain(index):
    """Masses, springs and dampers in a row: force at one end, position measured at the other or at the same one."""
    masses = int(rng.integers(2, 7))
    k = 10 ** rng.uniform(0, 3, masses)
    m = 10 ** rng.uniform(-1, 1, masses)
    stiff = np.zeros((masses, masses))
    for i in range(masses):
        stiff[i, i] += k[i]
        if i > 0:
            stiff[i - 1, i - 1] += k[i]
            stiff[i, i - 1] -= k[i]
            stiff[i - 1, i] -= k[i]
    if rng.random() < 0.5:
        stiff[0, 0] -= k[0]  # free: a rigid mode
    inverse = np.diag(1 / m)
    damp = rng.uniform(0.001, 0.02) * stiff / np.sqrt(np.max(k)) + rng.uniform(0, 0.1) * np.eye(masses)
    n = 2 * masses
    a = np.block([[np.zeros((masses, masses)), np.eye(masses)], [-inverse @ stiff, -inverse @ damp]])
    b2 = np.zeros((n, 1))
    b2[masses, 0] = 1 / m[0]
    c2 = np.zeros((1, n))
    c2[0, 0 if rng.random() < 0.5 else masses - 1] = 1
    b1 = np.hstack([np.vstack([np.zeros((masses, masses)), inverse]), np.zeros((n, 1))])
    c1 = np.vstack([np.hstack([np.eye(masses), np.zeros((masses, masses))]), np.zeros((1, n))])
    d12 = np.zeros((masses + 1, 1))
    d12[-1] = rng.uniform(0.01, 1)
    d21 = np.zeros((1, masses + 1))
    d21[0, -1] = rng.uniform(0.01, 1)
    return stacked(f"chain-{index}", "chain", a, b1, b2, c1, c2, np.zeros((masses + 1, masses + 1)), d12, d21, np.zeros((1, 1)))


def rod(index):
    """Heat along a rod in finite differences: heaters and thermometers, up to 24 states."""
    n = int(rng.integers(8, 25))
    a = (np.diag(-2 * np.ones(n)) + np.eye(n, k=1) + np.eye(n, k=-1)) * rng.uniform(0.5, 2) * (n + 1) ** 2 / 100
    a[n // 2, n // 2] += rng.uniform(0, 8)  # a reaction that may run away
    heaters, sensors = int(rng.integers(1, 3)), int(rng.integers(1, 3))
    b2, c2 = np.zeros((n, heaters)), np.zeros((sensors, n))
    for i in range(heaters):
        b2[(i + 1) * n // (heaters + 1), i] = 1
    for i in range(sensors):
        c2[i, (2 * i + 1) * n // (2 * sensors + 1)] = 1
    b1 = np.hstack([np.eye(n)[:, ::3], np.zeros((n, sensors))])
    c1 = np.vstack([np.eye(n)[::4], np.zeros((heaters, n))])
    d12 = np.vstack([np.zeros((c1.shape[0] - heaters, heaters)), rng.uniform(0.1, 1) * np.eye(heaters)])
    d21 = np.hstack([np.zeros((sensors, b1.shape[1] - sensors)), rng.uniform(0.05, 0.5) * np.eye(sensors)])
    return stacked(f"rod-{index}", "rod", a, b1, b2, c1, c2, np.zeros((c1.shape[0], b1.shape[1])), d12, d21, np.zeros((sensors, heaters)))


def craft(index):
    """Short-period and phugoid-like flight dynamics with elevator and throttle, actuators as lags; slow and fast modes mixed."""
    slow, fast = rng.uniform(0.02, 0.2), rng.uniform(1, 5)
    a = np.zeros((6, 6))
    a[:2, :2] = [[-0.05 * slow, -slow], [slow, -0.05 * slow]]
    sign = 1 if rng.random() < 0.5 else -1  # statically unstable half of the time
    a[2:4, 2:4] = [[-rng.uniform(0.3, 2), 1], [-sign * fast**2 / 4, -rng.uniform(0.3, 2)]]
    a[:2, 2:4] = rng.standard_normal((2, 2)) * 0.5
    a[2:4, :2] = rng.standard_normal((2, 2)) * 0.05
    a[4, 4], a[5, 5] = -20, -rng.uniform(0.2, 2)
    a[2:4, 4] = [-0.1, -rng.uniform(2, 12)]
    a[0, 5] = rng.uniform(0.5, 5)
    b2 = np.zeros((6, 2))
    b2[4, 0], b2[5, 1] = 20, -a[5, 5]
    c2 = np.zeros((2, 6))
    c2[0, 0], c2[1, 3] = 1, 1
    b1 = np.hstack([np.diag([1, 0.5, 0.3, 0.5, 0, 0])[:, :4], np.zeros((6, 2))])
    c1 = np.vstack([np.diag(rng.uniform(0.3, 3, 6))[:4], np.zeros((2, 6))])
    d12 = np.vstack([np.zeros((4, 2)), np.diag(rng.uniform(0.2, 2, 2))])
    d21 = np.hstack([np.zeros((2, 4)), np.diag(rng.uniform(0.02, 0.5, 2))])
    return stacked(f"craft-{index}", "craft", a, b1, b2, c1, c2, np.zeros((6, 6)), d12, d21, np.zeros((2, 2)))


def slicot_example():
    """Example data of SB10AD and SB10FD in the SLICOT documentation."""
    a = np.array([[-1, 0, 4, 5, -3, -2], [-2, 4, -7, -2, 0, 3], [-6, 9, -5, 0, 2, -1], [-8, 4, 7, -1, -3, 0], [2, 5, 8, -9, 1, -4], [3, -5, 8, 0, 2, -6]])
    b = np.array([[-3, -4, -2, 1, 0], [2, 0, 1, -5, 2], [-5, -7, 0, 7, -2], [4, -6, 1, 1, -2], [-3, 9, -8, 0, 5], [1, -2, 3, -6, -2]])
    c = np.array([[1, -1, 2, -4, 0, -3], [-3, 0, 5, -1, 1, 1], [-7, 5, 0, -8, 2, -2], [9, -3, 4, 0, 3, 7], [0, 1, -2, 1, -6, -2]])
    d = np.array([[1, -2, -3, 0, 0], [0, 4, 0, 1, 0], [5, -3, -4, 0, 1], [0, 1, 0, 1, -3], [0, 0, 1, 7, 1]])
    f = lambda m: np.asarray(m, dtype=float)
    return {"name": "slicot-sb10ad", "kind": "published", "controls": 2, "measurements": 2, "a": f(a), "b": f(b), "c": f(c), "d": f(d)}


def plants():
    yield slicot_example()
    for i in range(60):
        yield random_plant(i, "random-stable")
    for i in range(60):
        yield random_plant(i, "random-unstable")
    for i in range(60):
        yield galvanometer(i)
    for i in range(30):
        yield chain(i)
    for i in range(15):
        yield rod(i)
    for i in range(20):
        yield craft(i)


def main():
    kept, dropped = [], []
    for p in plants():
        poles = np.abs(np.linalg.eigvals(p["a"]))
        poles = poles[poles > 1e-12 * poles.max()]
        unit = np.exp(np.mean(np.log(poles))) if len(poles) else 1.0
        levels = []
        for u in (unit, 4 * unit, unit / 4, 16 * unit, unit / 16):
            g = level(p, u)
            levels += [] if g is None else [g]
            if len(levels) >= 2 and np.sum(np.array(levels) < min(levels) * (1 + 1e-8)) >= 2:
                break
        if not levels:
            dropped.append({"name": p["name"], "reason": "SLICOT finds no level in any scaling"})
            continue
        best = min(levels)
        p["gamma"] = float(f"{best:.12g}")
        p["agreeing"] = int(np.sum(np.array(levels) < best * (1 + 1e-6)))
        p["own_estimate"] = own_estimate(p, unit)
        p["unscaled_excess"] = unscaled_excess(p, best)
        for key in "abcd":
            p[key] = p[key].tolist()
        kept.append(p)
        print(p["name"], p["gamma"], p["agreeing"], p["own_estimate"], p["unscaled_excess"], file=sys.stderr)
    head = {"made_by": "make_synthesis.py", "slycot": slycot.__version__, "numpy": np.__version__, "dropped": dropped}
    print("{")
    for key, value in head.items():
        print(f"{json.dumps(key)}: {json.dumps(value)},")
    print('"plants": [')
    print(",\n".join(json.dumps(p, separators=(",", ":")) for p in kept))
    print("]}")


main()
