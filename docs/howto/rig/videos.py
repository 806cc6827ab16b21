"""Synthetic videos of a capsule: positions in pixels, as tracking gives them."""

import csv

import numpy as np

from capsule_sym import load_parameters, simulate

TRUTH = load_parameters("device.toml").replace(mu=0.25, c=0.1, k2=60.0)
PIXELS, SLIP = 8000.0, 2e-3  # pixels a metre; the camera's clock is 0.2 % slow

draw = np.random.default_rng(31)
for name, P_d, Omega in (("slow", 0.25, 38.0), ("middle", 0.2, 45.0), ("fast", 0.3, 52.0)):
    device = TRUTH.replace(P_d=P_d, Omega=Omega)
    run = simulate(device.dimensionless(), periods=200)
    t = np.arange(0.0, 1.5, 1 / 120)  # 120 frames a second
    begin = (150 + draw.random()) * 2 * np.pi / Omega  # a phase that the camera does not know
    times = (begin + (1 + SLIP) * t) * device.natural_frequency
    x_r, _, _, x_c = device.displacement(run(times, position=True).T)
    frames = {"t": t}
    for series, x in (("x_m", x_r + x_c), ("x_c", x_c)):
        noise = 0.3 * draw.normal(size=len(t))
        for i in range(1, len(t)):
            noise[i] += 0.5 * noise[i - 1]  # light and vibration last longer than a frame
        lost = 60 * draw.normal(size=len(t)) * (draw.random(len(t)) < 0.05)  # another marker
        pixels = PIXELS * (x - x[0]) + draw.uniform(100, 900) + noise + lost
        pixels[draw.random(len(t)) < 0.03] = np.nan  # a frame without the marker
        frames[series] = pixels
    with open(f"{name}.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(frames)
        for row in zip(*frames.values(), strict=True):
            writer.writerow(
                [f"{row[0]:.6f}"] + ["" if np.isnan(v) else f"{v:.2f}" for v in row[1:]]
            )
