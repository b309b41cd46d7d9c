"""Rewrites oracle/robot.json: the arm of models/robot.lua at random states, computed by Pinocchio.

    python3 -m venv VENV && VENV/bin/pip install pin && VENV/bin/python make_robot_references.py

The arm is written here a second time, number by number, so that a misread field of the model is detected, too. Accelerations of the points
E and grip come from spatial Jacobians in the ground's axes at the point (LOCAL_WORLD_ALIGNED) and their rate times qd.
"""
import json
import math
import pathlib
import random

import numpy
import pinocchio

PLACE = pathlib.Path(__file__).parent / "oracle" / "robot.json"
ACROSS, TILT, TOOL, ROTOR = (0.12, 0.97, -0.05), 0.17, 0.831, 1.37e-4
# Name, position, turns, kind, axis, mass, centre, inertia xx yy zz xy xz yz about the centre, rotor's inertia, gear.
LINKS = [
    ("pan", (0.021, -0.013, 0.163), [("z", 0.21)], "turn", (0, 0, 1), 3.761, (0.007, -0.021, 0.013),
     (0.0121, 0.0113, 0.0094, 0.0004, -0.0003, 0.0007), ROTOR, 101),
    ("lift", (0.013, 0.138, 0.004), [("y", 0.4)], "turn", ACROSS, 8.058, (0.213, 0.011, 0.047),
     (0.031, 0.142, 0.131, -0.002, 0.006, 0.001), ROTOR, -121),
    ("elbow", (0.425, -0.119, 0.008), [], "turn", ACROSS, 2.846, (0.151, -0.008, 0.012),
     (0.0051, 0.0417, 0.0401, 0.0008, -0.0012, 0.0003), ROTOR, 101),
    ("wrist_1", (0.392, 0.003, -0.011), [], "turn", (TILT, 0.9, 0.1), 1.371, (-0.006, 0.052, 0.017),
     (0.0026, 0.0021, 0.0029, 0.0001, 0.0002, -0.0003), 2.3e-5, 80),
    ("wrist_2", (0.004, 0.093, 0.002), [], "turn", (0, 0, -1), 1.298, (0.003, 0.009, -0.041),
     (0.0024, 0.0023, 0.0018, -0.0002, 0.0001, 0.0002), 0, 1),
    ("wrist_3", (-0.002, 0.006, -0.095), [], "turn", (-0.3, 0.7, 0.2), TOOL, (0.002, 0.061, -0.004),
     (0.0011, 0.0008, 0.0013, 0.0001, -0.0001, 0.0002), 0.013, 1),
    ("finger", (0.017, 0.112, 0.009), [], "slide", (0.3, -0.4, 0.5), 0.173, (0.004, 0.021, -0.002),
     (0.00012, 0.00009, 0.00011, 0, 0, 0), 3.1e-7, 2094.4),
]
POINTS = {"E": ("wrist_3", (0.011, 0.082, -0.017), [("z", 0.3), ("x", -0.4)]), "grip": ("finger", (0.003, 0.031, 0.002), [])}
GRAVITY = (0.31, -0.24, -9.79)


def placement(position, turns):
    rotation = numpy.eye(3)
    for axis, angle in turns:
        rotation = rotation @ pinocchio.utils.rotate(axis, angle)
    return pinocchio.SE3(rotation, numpy.array(position))


def build():
    model = pinocchio.Model()
    model.gravity = pinocchio.Motion(numpy.array(GRAVITY), numpy.zeros(3))
    parent = 0
    for name, position, turns, kind, axis, mass, center, (xx, yy, zz, xy, xz, yz), inertia, gear in LINKS:
        joint = {"turn": pinocchio.JointModelRevoluteUnaligned, "slide": pinocchio.JointModelPrismaticUnaligned}[kind]
        parent = model.addJoint(parent, joint(numpy.array(axis) / numpy.linalg.norm(axis)), placement(position, turns), name)
        tensor = numpy.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        model.appendBodyToJoint(parent, pinocchio.Inertia(mass, numpy.array(center), tensor), pinocchio.SE3.Identity())
        model.armature[model.nv - 1] = inertia * gear ** 2
    for name, (link, position, turns) in POINTS.items():
        model.addFrame(pinocchio.Frame(name, model.getJointId(link), 0, placement(position, turns), pinocchio.FrameType.OP_FRAME))
    return model


def values(model, q, qd):
    data, world = model.createData(), pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    M = pinocchio.crba(model, data, q)
    M = numpy.triu(M) + numpy.triu(M, 1).T
    qdd = numpy.array([3 * math.sin(1 + i) for i in range(model.nv)])
    found = {"q": q.tolist(), "qd": qd.tolist(), "qdd_given": qdd.tolist(), "inverse": pinocchio.rnea(model, data, q, qd, qdd).tolist(), "M": M.tolist(),
             "f": (-pinocchio.nonLinearEffects(model, data, q, qd)).tolist(),
             "qdd": pinocchio.aba(model, data, q, qd, numpy.zeros(model.nv)).tolist(), "points": {}}
    pinocchio.computeJointJacobiansTimeVariation(model, data, q, qd)
    pinocchio.updateFramePlacements(model, data)
    for name in POINTS:
        frame = model.getFrameId(name)
        J = pinocchio.getFrameJacobian(model, data, frame, world)
        rate = pinocchio.getFrameJacobianTimeVariation(model, data, frame, world)
        found["points"][name] = {"r": data.oMf[frame].translation.tolist(), "R": data.oMf[frame].rotation.tolist(),
                                 "J": J.tolist(), "Jd_qd": (rate @ qd).tolist()}
    return found


def main():
    model, rng, states = build(), random.Random(31), []
    for _ in range(3):
        q, qd = ([rng.uniform(-2, 2) for _ in range(model.nv)] for _ in range(2))
        states.append(values(model, numpy.array(q), numpy.array(qd)))
    PLACE.write_text(json.dumps({"library": f"pinocchio {pinocchio.__version__}", "states": states}, indent=1) + "\n")


main()
