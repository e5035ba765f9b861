"""Writes bench.csv, the record of a galvanometer on a bench: voltage of a binary sequence, current with noise, angle in counts of an encoder.

    python3 examples/scan-head-bench/make_bench.py bench.csv

The motor is simulated here, apart from meltpath: fourth-order Runge-Kutta in steps of 5 µs. Only sums, products and roots, so that the same record comes
out on every machine.
"""
import math
import sys

RESISTANCE, INDUCTANCE, TORQUE_CONSTANT = 2.1, 150e-6, 7.4e-3  # Ω, H, N·m/A = V·s/rad
INERTIA, VISCOUS, COULOMB, BIAS = 6.3e-8, 2.5e-6, 4.5e-5, 2e-6  # kg·m², N·m·s/rad, N·m, N·m
OMEGA, DAMPING, GAIN_RATIO = 2 * math.pi * 3100.0, 0.02, 0.25  # rad/s, 1, 1: a flexible mode
CREEP = 0.02  # rad/s: over which dry friction turns round
SAMPLE, PIECES, SAMPLES = 50e-6, 10, 30_000
AMPLITUDE = 0.3  # V
NOISE, COUNT, ZERO = 1e-3, 40.0 / 2**20, 2**19  # A; degrees a count, and counts that read zero


def slope(x, voltage):
    current, speed, _, mode, mode_speed = x
    turning = speed + mode_speed
    torque = TORQUE_CONSTANT * current - COULOMB * turning / math.sqrt(turning**2 + CREEP**2) - BIAS
    return (
        (voltage - RESISTANCE * current - TORQUE_CONSTANT * turning) / INDUCTANCE,
        (torque - VISCOUS * speed) / INERTIA,
        speed,
        mode_speed,
        GAIN_RATIO * torque / INERTIA - 2 * DAMPING * OMEGA * mode_speed - OMEGA**2 * mode,
    )


def advance(x, voltage, h):
    def moved(by, k):
        return tuple(a + by * b for a, b in zip(x, k))

    k1 = slope(x, voltage)
    k2 = slope(moved(h / 2, k1), voltage)
    k3 = slope(moved(h / 2, k2), voltage)
    k4 = slope(moved(h, k3), voltage)
    return tuple(a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4))


def noise(seed):
    """Nearly normal numbers: sums of twelve from a linear congruential generator (Knuth's MMIX)."""
    while True:
        total = -6.0
        for _ in range(12):
            seed = (6364136223846793005 * seed + 1442695040888963407) % 2**64
            total += seed / 2**64
        yield total


def main(path):
    x, register, disturbed = (0.0,) * 5, 0xACE1, noise(1)
    with open(path, "w", newline="\n") as out:
        out.write("t_us,U_V,i_mA,encoder\n")
        for k in range(SAMPLES):
            # a shift register of 16 stages
            bit = (register ^ register >> 1 ^ register >> 3 ^ register >> 12) & 1
            register = register >> 1 | bit << 15
            voltage = AMPLITUDE if register & 1 else -AMPLITUDE
            counts = ZERO + round(math.degrees(x[2] + x[3]) / COUNT)
            out.write(f"{50 * k},{voltage},{1e3 * (x[0] + NOISE * next(disturbed)):.2f},{counts}\n")
            for _ in range(PIECES):
                x = advance(x, voltage, SAMPLE / PIECES)


main(sys.argv[1])
