"""Gains of a linear quadratic regulator with observer, from a linear model: lqr.py LINEAR.json GAINS.lua"""
import json
import sys

import numpy
import scipy.linalg

EVERY = 0.005
with open(sys.argv[1]) as file:
    linear = json.load(file)
A, B, C = (numpy.array(linear[name]) for name in "ABC")
n, input_ = len(A), linear["inputs"].index("torque")
B, C = B[:, [input_]], C[[linear["outputs"].index("encoder")]]
held = scipy.linalg.expm(numpy.block([[A, B], [numpy.zeros((1, n + 1))]]) * EVERY)  # the torque is held between samples
Ad, Bd = held[:n, :n], held[:n, n:]
P = scipy.linalg.solve_discrete_are(Ad, Bd, numpy.diag([10, 10, 0.1, 0.1]), [[0.1]])
K = numpy.linalg.solve(0.1 + Bd.T @ P @ Bd, Bd.T @ P @ Ad)[0]
S = scipy.linalg.solve_discrete_are(Ad.T, C.T, numpy.diag([1e-4, 1e-4, 1, 1]), [[1e-6]])
L = (Ad @ S @ C.T / (1e-6 + C @ S @ C.T))[:, 0]


def lua(values):
    return "{ " + ", ".join(lua(value) if numpy.ndim(value) else repr(float(value)) for value in values) + " }"


with open(sys.argv[2], "w") as file:
    file.write(f"return {{ every = {EVERY}, K = {lua(K)}, L = {lua(L)}, A = {lua(Ad)}, B = {lua(Bd[:, 0])} }}\n")
