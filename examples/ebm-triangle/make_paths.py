"""Writes the beam paths of this example: the triangle of Béraud 2016 (section 3.3.2.2) and the rectangle its window is centred on.

Sizes: base 17.5 mm, height 7.5 mm, rectangle 15 x 8 mm; lines every 0.125 mm along the base, 980 mm/s, 60 kV, 5 mA, focus 4 mA.
"""
import pathlib

HEAD = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on"
SPEED, HATCH = 980.0, 0.125


def write(name, lines):
    rows, time, last = [HEAD], 0.0, None
    for n, ends in enumerate(lines):
        for x, y in ends if n % 2 == 0 else reversed(ends):
            if last:
                time += ((x - last[0]) ** 2 + (y - last[1]) ** 2) ** 0.5 / SPEED
            rows.append(f"{time:.9f},{x:.6f},{y:.6f},60000,0.005,0.004,1")
            last = (x, y)
    pathlib.Path(__file__).with_name(name).write_text("\n".join(rows) + "\n", encoding="utf-8")


heights = [(n + 0.5) * HATCH for n in range(60)]
write("triangle.csv", [((-8.75 * (1 - y / 7.5), y), (8.75 * (1 - y / 7.5), y)) for y in heights])
write("rectangle.csv", [((-7.5, (n + 0.5) * HATCH), (7.5, (n + 0.5) * HATCH)) for n in range(64)])
