#!/usr/bin/env python3
"""How long the fit of the UR5's geometry takes, against scipy's least_squares and Ceres, in turns in one run.

    cargo build --release -p plumb-diagnosis --example fit_time
    python3 tests/bench/fit.py MODEL.yaml TABLE.csv [ROUNDS]

Needs numpy and scipy, and pyceres for Ceres. Everyone fits the same 39 parameters (zeros, lengths, offsets, twists and
skews of six joints, base and target) to the same rows, from the nominal arm with the base brought near by a rigid motion
(which the program finds itself, within its time). The peers' residuals are vectorised over the rows; their derivatives are
what the peers make of them: scipy's finite differences, and for Ceres a Jacobian by complex steps, since its automatic
derivatives cannot be reached from Python. Nobody is informed which parameters the table cannot determine.

Everyone is timed by the processor time used, the peers on one thread each, so that a busy machine does not decide. What of Ceres's time is not spent in Python's residuals and derivatives is
distinguished: it is what its own steps take, however fast derivatives came.
"""

import os
import re
import statistics
import subprocess
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
from scipy.optimize import least_squares

try:
    import pyceres
except ImportError:
    pyceres = None

FITS = 50
PROGRAM = os.path.join(os.path.dirname(__file__), "../../target/release/examples/fit_time")


def read(model, table):
    """DH rows (a, alpha, d, theta), tool, joints (rad) and points (mm)."""
    text = open(model).read()
    number = lambda line, key: float(re.search(rf"\b{key}: ([-\d.e]+)", line).group(1))
    rows = np.array(
        [
            [number(l, "a_mm"), np.radians(number(l, "alpha_deg")), number(l, "d_mm"), np.radians(number(l, "theta_deg"))]
            for l in re.findall(r"- \{name: .*\}", text)
        ]
    )
    tool = np.array([float(x) for x in re.search(r"p1: \{xyz_mm: \[(.*?)\]", text).group(1).split(",")])
    with open(table) as file:
        names = file.readline().strip().split(",")
        cells = np.array([[float(x) for x in line.split(",")] for line in file])
    q = np.radians(cells[:, [names.index(f"q{j + 1}_deg") for j in range(len(rows))]])
    p = cells[:, [names.index(f"p1_{axis}_mm") for axis in "xyz"]]
    return rows, tool, q, p


def turn_z(turns, rotation):
    c, s = np.cos(turns), np.sin(turns)
    x, y = rotation[..., 0], rotation[..., 1]
    return np.stack([x * c[:, None] + y * s[:, None], y * c[:, None] - x * s[:, None], rotation[..., 2]], -1)


def turn_x(angle, rotation):
    c, s = np.cos(angle), np.sin(angle)
    y, z = rotation[..., 1], rotation[..., 2]
    return np.stack([rotation[..., 0], y * c + z * s, z * c - y * s], -1)


def turn_y(angle, rotation):
    c, s = np.cos(angle), np.sin(angle)
    x, z = rotation[..., 0], rotation[..., 2]
    return np.stack([x * c - z * s, rotation[..., 1], z * c + x * s], -1)


def small_rotation(v):
    """Rotation by the vector v, by its power series: holds for complex steps as well."""
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    total = np.eye(3, dtype=k.dtype)
    term = total
    for n in range(1, 12):
        term = term @ k / n
        total = total + term
    return total


class Arm:
    def __init__(self, rows, tool, q, p):
        self.rows, self.tool, self.q, self.p = rows, tool, q, p
        self.rotation, self.origin = np.eye(3), np.zeros(3)
        inside = self.points(np.zeros(39))
        a, b = inside - inside.mean(0), p - p.mean(0)
        u, _, vt = np.linalg.svd(b.T @ a)
        self.rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
        self.origin = p.mean(0) - self.rotation @ inside.mean(0)

    def points(self, x):
        count = len(self.q)
        rotation = np.tile(np.eye(3, dtype=x.dtype), (count, 1, 1))
        place = np.zeros((count, 3), dtype=x.dtype)
        for j, (a, alpha, d, theta) in enumerate(self.rows):
            zero, length, offset, twist, skew = x[9 + 5 * j : 14 + 5 * j]
            rotation = turn_y(skew, rotation)
            rotation = turn_z(self.q[:, j] + theta + zero, rotation)
            place = place + (d + offset) * rotation[..., 2] + (a + length) * rotation[..., 0]
            rotation = turn_x(alpha + twist, rotation)
        inside = place + rotation @ (self.tool + x[6:9])
        return inside @ (small_rotation(x[3:6]) @ self.rotation).T + self.origin + x[0:3]

    def residuals(self, x):
        return (self.p - self.points(x)).ravel()

    def jacobian(self, x):
        columns = []
        for index in range(len(x)):
            moved = x.astype(complex)
            moved[index] += 1e-30j
            columns.append(self.residuals(moved).imag / 1e-30)
        return np.stack(columns, -1)

    def rms(self, x):
        return float(np.sqrt((self.residuals(x) ** 2).sum() / len(self.q)))


class Cost(pyceres.CostFunction if pyceres else object):
    def __init__(self, arm):
        super().__init__()
        self.arm = arm
        self.inside = 0.0
        self.set_num_residuals(3 * len(arm.q))
        self.set_parameter_block_sizes([39])

    def Evaluate(self, parameters, residuals, jacobians):
        start = time.process_time()
        x = np.array(parameters[0])
        residuals[:] = self.arm.residuals(x)
        if jacobians is not None:
            jacobians[0][:] = self.arm.jacobian(x).ravel()
        self.inside += time.process_time() - start
        return True


def by_ceres(arm, own):
    """Where Ceres ends; the seconds of its own steps are appended to `own`."""
    x = np.zeros(39)
    problem = pyceres.Problem()
    cost = Cost(arm)
    problem.add_residual_block(cost, None, [x])
    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.DENSE_QR
    options.max_num_iterations = 200
    options.num_threads = 1
    start = time.process_time()
    pyceres.solve(options, problem, pyceres.SolverSummary())
    own.append(time.process_time() - start - cost.inside)
    return x


def main():
    model, table = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    program = subprocess.Popen([PROGRAM, model, table], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    fitted = [int(row) for row in program.stdout.readline().split()]
    rows, tool, q, p = read(model, table)
    arm = Arm(rows, tool, q[fitted], p[fitted])
    print(f"{len(fitted)} rows, 39 parameters, {rounds} rounds in turns; load {os.getloadavg()[0]:.1f}", flush=True)

    def used():
        """Processor seconds the program has used, to a hundredth."""
        fields = open(f"/proc/{program.pid}/stat").read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def plumb():
        """The mean of so many fits that a hundredth of a second does not matter."""
        start = used()
        for _ in range(FITS):
            program.stdin.write("\n")
            program.stdin.flush()
            seconds, rms, *_ = program.stdout.readline().split()
            walls.append(float(seconds))
        return (used() - start) / FITS, float(rms)

    def timed(solve):
        start = time.process_time()
        x = solve()
        return time.process_time() - start, arm.rms(x)

    own, walls = [], []
    zeros = np.zeros(39)
    contest = {
        "plumb": plumb,
        "scipy trf": lambda: timed(lambda: least_squares(arm.residuals, zeros, x_scale="jac").x),
        "scipy lm": lambda: timed(lambda: least_squares(arm.residuals, zeros, x_scale="jac", method="lm").x),
        "scipy trf, complex-step Jacobian": lambda: timed(
            lambda: least_squares(arm.residuals, zeros, jac=arm.jacobian, x_scale="jac").x
        ),
    }
    if pyceres:
        contest["Ceres, complex-step Jacobian"] = lambda: timed(lambda: by_ceres(arm, own))
    results = {name: [] for name in contest}
    for _ in range(rounds):
        for name, solve in contest.items():
            results[name].append(solve())
            print(f"  {name}: {results[name][-1][0]:.4f} s, rms {results[name][-1][1]:.4f} mm", flush=True)
    program.stdin.close()
    program.wait()
    print(f"seconds: least, median, most; RMS mm; load {os.getloadavg()[0]:.1f}")
    base = statistics.median(seconds for seconds, _ in results["plumb"])
    for name, runs in results.items():
        seconds = [run[0] for run in runs]
        middle = statistics.median(seconds)
        print(f"{name:34} {min(seconds):9.4f} {middle:9.4f} {max(seconds):9.4f}  rms {runs[-1][1]:.4f}  {middle / base:7.1f} times plumb")
    print(f"plumb by the clock on the wall: least {min(walls):.4f}, median {statistics.median(walls):.4f} s")
    if own:
        middle = statistics.median(own)
        print(f"of which Ceres's own steps {middle:.4f} s, {middle / base:.1f} times plumb")


if __name__ == "__main__":
    main()
