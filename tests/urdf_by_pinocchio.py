"""M, h and gravity torques of a URDF file by Pinocchio, in Refdyn's coordinates: M qdd = h + Q, without damping.

A joint with several coordinates becomes a chain of single-coordinate joints between massless links, because Pinocchio uses different
coordinates for planar and floating joints.
"""
import random
import xml.etree.ElementTree as ElementTree

import numpy

LETTERS = {"prismatic": "xyz", "revolute": ("phi", "theta", "psi"), "continuous": ("phi", "theta", "psi")}
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "phi": (1, 0, 0), "theta": (0, 1, 0), "psi": (0, 0, 1)}
PLANES = (("y", "z", "phi"), ("z", "x", "theta"), ("x", "y", "psi"))


def axis_of(joint):
    given = joint.find("axis")
    return numpy.array([float(word) for word in given.get("xyz").split()] if given is not None else [1.0, 0, 0])


def largest(axis):
    """Index of the largest component; the later one if equal."""
    return max(range(3), key=lambda i: (abs(axis[i]), i))


def chain_of(joint):
    """(coordinate, type, axis) from the carrier outward."""
    child = joint.find("child").get("link")
    letters, frame = ("x", "y", "z", "psi", "theta", "phi"), numpy.eye(3)
    if joint.get("type") == "planar":
        axis = axis_of(joint) / numpy.linalg.norm(axis_of(joint))
        letters = PLANES[largest(axis)]
        if max(axis) < 1:  # not x, y or z: its own frame has it as z
            child, letters = f"{child}_plane", PLANES[2]
            side = numpy.cross((0, 0, 1), axis) / numpy.linalg.norm(axis[:2])
            frame = numpy.array((numpy.cross(side, axis), side, axis)).T
    return [(f"{child}_{letter}", "prismatic" if letter in "xyz" else "continuous", frame @ AXES[letter]) for letter in letters]


def as_chains(root):
    """Replaces planar and floating joints; returns the coordinate of each joint by its name."""
    coordinates = {}
    for joint in root.findall("joint"):
        kind, child = joint.get("type"), joint.find("child").get("link")
        if kind in LETTERS:
            coordinates[joint.get("name")] = f"{child}_{LETTERS[kind][largest(axis_of(joint))]}"
        elif kind != "fixed":
            carrier = joint.find("parent").get("link")
            chain = chain_of(joint)
            for i, (coordinate, part_kind, axis) in enumerate(chain):
                end = child if i == len(chain) - 1 else f"{child} before {chain[i + 1][0]}"
                part = ElementTree.SubElement(root, "joint", name=coordinate, type=part_kind)
                coordinates[coordinate] = coordinate
                ElementTree.SubElement(part, "parent", link=carrier)
                ElementTree.SubElement(part, "child", link=end)
                ElementTree.SubElement(part, "axis", xyz=" ".join(map(str, axis)))
                if part_kind == "prismatic":
                    ElementTree.SubElement(part, "limit", lower="-9", upper="9", velocity="9", effort="9")
                if i == 0 and joint.find("origin") is not None:
                    part.append(joint.find("origin"))
                if end != child:
                    ElementTree.SubElement(root, "link", name=end)
                carrier = end
            root.remove(joint)
    return coordinates


def with_unit_axes(root):
    """Pinocchio does not normalise the axis of the file."""
    for joint in root.findall("joint"):
        if joint.find("axis") is not None and joint.get("type") != "fixed":
            joint.find("axis").set("xyz", " ".join(repr(float(x)) for x in axis_of(joint) / numpy.linalg.norm(axis_of(joint))))


def rotors(root):
    """inertia gear^2 of each joint that has a rotor."""
    found = {}
    for transmission in root.findall("transmission"):
        inertia, gear = (transmission.find(f"actuator/{{http://drake.mit.edu}}{name}") for name in ("rotor_inertia", "gear_ratio"))
        if inertia is not None:
            found[transmission.find("joint").get("name")] = float(inertia.get("value")) * float(gear.get("value"))**2
    return found


class Reference:
    """One robot; `coordinates` are in Pinocchio's order."""

    def __init__(self, text):
        import pinocchio
        root = ElementTree.fromstring(text)
        self.pinocchio, names = pinocchio, as_chains(root)
        with_unit_axes(root)
        self.model = pinocchio.buildModelFromXML(ElementTree.tostring(root, encoding="unicode"))
        self.data = self.model.createData()
        self.joints = [self.model.joints[i] for i in range(1, self.model.njoints)]
        self.coordinates = [names[self.model.names[i]] for i in range(1, self.model.njoints)]
        for name, inertia in rotors(root).items():
            self.model.armature[self.model.joints[self.model.getJointId(name)].idx_v] = inertia

    def configuration(self, q):
        """Turns without limits are a cosine and a sine."""
        full = numpy.zeros(self.model.nq)
        for joint, value in zip(self.joints, q):
            full[joint.idx_q:joint.idx_q + joint.nq] = value if joint.nq == 1 else (numpy.cos(value), numpy.sin(value))
        return full

    def values(self, q, qd):
        """M, h + Q of a motion without damping, and Q due to gravity alone."""
        full, order = self.configuration(q), [joint.idx_v for joint in self.joints]
        rates = numpy.zeros(self.model.nv)
        rates[order] = qd
        M = self.pinocchio.crba(self.model, self.data, full)
        M = (numpy.triu(M) + numpy.triu(M, 1).T)[numpy.ix_(order, order)]
        return {"M": M.tolist(), "f": (-self.pinocchio.nonLinearEffects(self.model, self.data, full, rates))[order].tolist(),
                "gravity": (-self.pinocchio.computeGeneralizedGravity(self.model, self.data, full))[order].tolist()}

    def states(self, count, seed):
        """States with reference values, at random places with many significant digits."""
        chance = random.Random(seed)
        for _ in range(count):
            q = [chance.uniform(-2, 2) for _ in self.coordinates]
            qd = [chance.uniform(-3, 3) for _ in self.coordinates]
            yield {"q": q, "qd": qd, **self.values(q, qd)}
