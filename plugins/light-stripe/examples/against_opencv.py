#!/usr/bin/env python3
"""Threshold to centreline against OpenCV, on the same frames, one thread each, in turns.

    cargo build --release -p plumb-light-stripe --example extract_speed
    python plugins/light-stripe/examples/against_opencv.py target/release/examples/extract_speed
"""
import os, subprocess, sys, tempfile, time
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
import cv2, numpy as np
cv2.setNumThreads(1)
THRESHOLD, FRAMES, ROUNDS = 60, 16, 25
NAMES = {"centroid": "plumb centroid", "binary": "plumb binary", "read": "pure read"}


def clutter(h, w, seed):
    """A stripe of Gaussian cross section with steps, slopes and a gap, spurs and specks around it, and noise."""
    r = np.random.default_rng(seed); y = np.arange(h); c = np.full(h, w * 0.45)
    c += 0.10 * w * (y / h - 0.5) + 0.03 * w * np.sin(2 * np.pi * y / h * 1.3 + r.uniform(0, 6))
    a, b = sorted(r.integers(h // 5, 4 * h // 5, 2)); c[a:b] += r.uniform(-0.9, 0.9)
    I = 8.0 + 180.0 * np.exp(-0.5 * ((np.arange(w)[None, :] - c[:, None]) / 1.6) ** 2)
    g = int(h * 0.9); I[g:g + max(2, h // 64)] = 8.0
    for _ in range(12):
        yy = r.integers(0, h - 8); xx = r.integers(0, w - 12)
        if abs(xx + 4 - c[yy]) >= 20: I[yy:yy + r.integers(2, 6), xx:xx + r.integers(3, 10)] = r.uniform(90, 220)
    for _ in range(40): I[r.integers(0, h), r.integers(0, w)] += r.uniform(0, 150)
    I += r.normal(0, 1, I.shape) * np.sqrt(9.0 + I * 0.05)
    return np.clip(np.rint(I), 0, 255).astype(np.uint8)


def noise(h, w, seed):
    """A quarter of all pixels lit, without order."""
    r = np.random.default_rng(seed)
    return np.where(r.random((h, w)) < 0.25, 200, 10).astype(np.uint8)


def contours(image, x):
    _, b = cv2.threshold(image, THRESHOLD, 255, cv2.THRESH_BINARY)
    cs, _ = cv2.findContours(b, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    boxes = [cv2.boundingRect(c) for c in cs]; k = int(np.argmax([q[3] for q in boxes])); x0, y0, w, h = boxes[k]
    m = np.zeros((h, w), np.uint8); cv2.drawContours(m, cs, k, 1, -1, offset=(-x0, -y0))
    m = (m * (b[y0:y0 + h, x0:x0 + w] > 0)).astype(np.float32); n = m.sum(1)
    return y0, m @ x[x0:x0 + w] / np.maximum(n, 1), n


def components(image, x):
    _, b = cv2.threshold(image, THRESHOLD, 1, cv2.THRESH_BINARY)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(b, connectivity=8, ltype=cv2.CV_32S)
    k = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_HEIGHT])); x0, y0, w, h = stats[k, :4]
    m = (labels[y0:y0 + h, x0:x0 + w] == k).astype(np.float32); n = m.sum(1)
    return y0, m @ x[x0:x0 + w] / np.maximum(n, 1), n


def bare(image, _):
    cv2.threshold(image, THRESHOLD, 1, cv2.THRESH_BINARY)


def in_turn(what, number):
    """All of them, from another one each time."""
    first = number % len(what)
    return what[first:] + what[:first]


print(f"OpenCV {cv2.__version__}, one thread, {FRAMES} frames, {ROUNDS} rounds in turns; median microseconds a frame")
for name, make, sizes in (("stripe in clutter", clutter, ((256, 256), (1280, 1024))), ("dense noise", noise, ((256, 256), (1280, 1024)))):
    for w, h in sizes:
        with tempfile.TemporaryDirectory() as folder:
            frames = [make(h, w, seed) for seed in range(FRAMES)]
            for i, frame in enumerate(frames):
                cv2.imwrite(f"{folder}/{i:02}.pgm", frame)
            ours = subprocess.Popen([sys.argv[1], folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
            instructions = ours.stdout.readline().strip()
            x = np.arange(w, dtype=np.float32); times = {}
            rounds = ROUNDS if make is clutter else 6
            for number in range(rounds):
                # Who comes first finds the caches full of the others' frames: each is first in its turn.
                for what in in_turn(("centroid", "binary", "read"), number):
                    ours.stdin.write(what + "\n"); times.setdefault(NAMES[what], []).extend(map(float, ours.stdout.readline().split()))
                for peer, run in in_turn((("findContours", contours), ("componentsWithStats", components), ("bare threshold", bare)), number):
                    for frame in frames:
                        t = time.perf_counter(); run(frame, x); times.setdefault(peer, []).append((time.perf_counter() - t) * 1e6)
            ours.stdin.write("points\n"); rate = float(ours.stdout.readline()); ours.stdin.close(); ours.wait()
            us = {k: float(np.median(v)) for k, v in times.items()}
            print(f"{name}, {w} x {h} ({instructions}): " + ", ".join(f"{k} {v:.2f}" for k, v in us.items()))
            print(f"    findContours / plumb {us['findContours'] / us['plumb centroid']:.1f}, with stats / plumb {us['componentsWithStats'] / us['plumb centroid']:.1f},"
                  f" plumb / bare threshold {us['plumb centroid'] / us['bare threshold']:.2f}, plumb / pure read {us['plumb centroid'] / us['pure read']:.2f}; points through K {rate:.0f} million a second")
