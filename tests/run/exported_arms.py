"""Reads an exported arm apart from plumb, with nothing but Python's own library, and compares its tip with what a table says.

exported_arms.py urdf FILE TIP TABLE    a URDF, to the link TIP
exported_arms.py ur FILE TABLE          the `kinematics_params_file` of the ROS driver of Universal Robots, to the frame of the last joint

The table has a line a pose: the joints (rad), then where the tip is (x, y, z in mm, frame of the base). Prints the greatest distance, mm.
"""

import math
import sys
import xml.etree.ElementTree


def product(one, other):
    return [[sum(one[i][k] * other[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def frame(xyz, rpy):
    """Fixed axes, as the specification of URDF has it: Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, sr), (cp, sp), (cy, sy) = [(math.cos(a), math.sin(a)) for a in rpy]
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, xyz[0]],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, xyz[1]],
        [-sp, cp * sr, cp * cr, xyz[2]],
        [0.0, 0.0, 0.0, 1.0],
    ]


def turn(axis, angle):
    """Rodrigues' formula."""
    size = math.sqrt(sum(part * part for part in axis))
    x, y, z = [part / size for part in axis]
    c, s, v = math.cos(angle), math.sin(angle), 1.0 - math.cos(angle)
    return [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0.0],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0.0],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]


def numbers(text):
    return [float(part) for part in text.split()]


def urdf(path, tip):
    """The joints from the root to a link: kind, origin, axis."""
    joints = {}
    for joint in xml.etree.ElementTree.parse(path).getroot().findall("joint"):
        origin, axis = joint.find("origin"), joint.find("axis")
        origin = {} if origin is None else origin.attrib
        joints[joint.find("child").get("link")] = (
            joint.find("parent").get("link"),
            joint.get("type"),
            frame(numbers(origin.get("xyz", "0 0 0")), numbers(origin.get("rpy", "0 0 0"))),
            [1.0, 0.0, 0.0] if axis is None else numbers(axis.get("xyz")),
        )
    chain, link = [], tip
    while link in joints:
        link, kind, origin, axis = joints[link]
        chain.insert(0, (kind, origin, axis))
    return chain


def ur(path):
    """Six frames, each followed by a turn about its z; lengths in metres, angles in rad."""
    links, link = {}, None
    for line in open(path):
        key, _, value = line.strip().partition(":")
        if value.strip() and link is not None and line.startswith("    "):
            try:
                links[link][key] = float(value)
            except ValueError:
                pass
        elif line.startswith("  ") and not value.strip():
            link = key
            links[link] = {}
    order = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
    chain = []
    for name in order:
        part = links[name]
        origin = frame([part[k] for k in ("x", "y", "z")], [part[k] for k in ("roll", "pitch", "yaw")])
        chain.append(("revolute", origin, [0.0, 0.0, 1.0]))
    return chain


def tip(chain, q):
    at, q = frame([0.0] * 3, [0.0] * 3), list(q)
    for kind, origin, axis in chain:
        at = product(at, origin)
        if kind in ("revolute", "continuous"):
            at = product(at, turn(axis, q.pop(0)))
        elif kind == "prismatic":
            way = q.pop(0)
            at = product(at, frame([part * way for part in axis], [0.0] * 3))
    assert not q, "joints are left over"
    return [1000.0 * at[i][3] for i in range(3)]


def main():
    form, path, *rest = sys.argv[1:]
    chain = urdf(path, rest[0]) if form == "urdf" else ur(path)
    worst, poses = 0.0, 0
    for line in open(rest[-1]):
        cells = numbers(line)
        worst = max(worst, math.dist(tip(chain, cells[:-3]), cells[-3:]))
        poses += 1
    print(poses, worst)


main()
